// SPDX-License-Identifier: Apache-2.0
// Heights from a raster, blended over those below it towards the edge of its samples.
#pragma once

#include "terrain/geometry/map_block.hpp"
#include "terrain/height_layer.hpp"
#include "terrain/maps/coverage.hpp"
#include "terrain/maps/raster.hpp"
#include "terrain/maps/slope_levels.hpp"

#include <memory>
#include <mutex>
#include <optional>

namespace obscura::terrain {

/// A raster as a source of heights: metres = offset_m + scale_m * sample.
struct HeightRaster {
    std::shared_ptr<const Raster> raster;
    HeightMeaning meaning = HeightMeaning::height;
    double scale_m = 1, offset_m = 0;
};

/// base + w (raster - base), w = smoothstep of the distance to the edge of the samples over the feather.
/// Immutable; thread-safe.
class RasterLayer final : public HeightLayer {
public:
    /// `coverage`: none if the raster covers the whole of `domain` without holes, which needs no blending.
    RasterLayer(const SurfaceDomain& domain, HeightRaster source,
                std::shared_ptr<const Coverage> coverage = nullptr, double feather_m = 0);

    void apply(const VertexGrid& grid, std::span<double> heights_m,
               std::span<double> sample_spacings_m) const override;
    [[nodiscard]] bool hides_below(const Cap& cap) const override { return covers(cap); }
    [[nodiscard]] HeightRange range(const Cap& cap, double spacing_m, HeightRange below) const override;
    [[nodiscard]] double sample_spacing_m(Vec3 position_m) const override;
    /// Nothing for rasters that SlopeLevels does not look through, which happens at the first call.
    void add_lost_slopes(std::span<const Vec3> positions_m, double spacing_m,
                         std::span<const double> sample_spacings_m, std::span<double> lost) const override;

    /// Height above the reference surface along the direction from its centre at a point of it, m; NaN where
    /// the raster has none. `reader`: of the source's raster.
    [[nodiscard]] double height_m(Raster::Reader& reader, Vec3 position_m, double spacing_m) const;
    [[nodiscard]] const Raster& raster() const { return *source_.raster; }

private:
    [[nodiscard]] Raster::Located located(Vec3 position_m) const;
    void load(std::span<const Vec3> positions, MapBlock& block) const;
    /// Whether all positions of the cap take the raster's height alone.
    [[nodiscard]] bool covers(const Cap& cap) const;
    /// Share of the raster's height in the result, 0 to 1.
    [[nodiscard]] double weight(const Raster::Located& located, double metres_per_radian) const;
    [[nodiscard]] double footprint(Vec3 position_m, double spacing_m) const;
    [[nodiscard]] double along_normal_m(Raster::Reader& reader, Vec3 position_m, double spacing_m) const;
    /// Bounds of height_m() in a cap; least above largest if there are no samples.
    [[nodiscard]] HeightRange bounds(const Cap& cap, double spacing_m) const;

    SurfaceDomain domain_;
    HeightRaster source_;
    std::shared_ptr<const Coverage> coverage_;
    double feather_m_;
    mutable std::once_flag slopes_made_;
    mutable std::unique_ptr<const SlopeLevels> slopes_;
};

} // namespace obscura::terrain
