// SPDX-License-Identifier: Apache-2.0
// Craters and boulders of a terrain that are in the pixels of a frame, for the truth table.
#pragma once

#include "renderer/planets/surface_tiles.hpp"
#include "renderer/truth/field_cone.hpp"
#include "renderer/truth/row_states.hpp"
#include "terrain/feature_search.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace obscura::renderer {

struct FeatureInView {
    terrain::SurfaceFeature feature;
    std::size_t layer = 0; ///< of the terrain
    Vec3 point_m;          ///< of the surface as the frame shows it, body frame
    double size_px = 0;    ///< diameter over range and the angle of a pixel in the middle of the image
};

/// Finds the features that are largest in the picture, in the field of the first, middle and last row. Looks
/// only at what may be in view, by the bounds of tiles that are there, and takes memory for those that it
/// keeps alone. Those of which later ones left less than `min_share` do not count.
class FeatureFinder final : public terrain::FeatureSearch {
public:
    static constexpr double min_share = 0.1;

    /// `body` is a terrain. The arguments outlive this.
    FeatureFinder(const TruthScene& scene, RowStates& states, std::size_t body);

    /// The largest first; valid as long as this object.
    [[nodiscard]] std::span<const FeatureInView> find();

    [[nodiscard]] bool wants(terrain::TileKey square, double largest_m) override;
    [[nodiscard]] bool wants(Vec3 position_m, double diameter_m) override;
    void add(const terrain::SurfaceFeature& feature) override;
    [[nodiscard]] std::pmr::memory_resource& memory() override { return states_.memory(); }

private:
    /// Bounds of unit heights.
    struct Heights {
        double least, largest;
    };
    /// Heights of the square of a level that has the point (u, v) of a face, and all below it, as far as its
    /// tiles are known.
    [[nodiscard]] Heights heights_of(std::uint8_t face, std::uint32_t u, std::uint32_t v, int levels) const;
    /// Whether features of up to `largest_m` are large enough, in the field and not behind the horizon,
    /// anywhere above a cap.
    [[nodiscard]] bool in_view(const terrain::Cap& cap, Heights heights, double largest_m) const;
    [[nodiscard]] bool on_pixels(Vec3 point_m);
    /// Keeps those of what was found that are in the picture.
    void take_found();
    void keep(const terrain::SurfaceFeature& feature, Vec3 point_m);
    /// Size that the next feature must have.
    [[nodiscard]] double min_px() const;

    const TruthScene& scene_;
    RowStates& states_;
    std::size_t body_;
    const SurfaceTiles& tiles_;
    FeatureLimits limits_;
    FieldCone cone_;
    std::size_t layer_ = 0;
    std::array<terrain::SurfaceFeature, packet_size> found_{}; ///< whose place is not known yet
    std::size_t found_count_ = 0;
    std::pmr::vector<FeatureInView> kept_; ///< a heap, the smallest first
};

} // namespace obscura::renderer
