// SPDX-License-Identifier: Apache-2.0
// Nested albedo maps of a planet or terrain: factors on the reflectance, patches over a base.
#pragma once

#include "core/geometry.hpp"
#include "core/spectral_band.hpp"
#include "renderer/textures/texture.hpp"
#include "terrain/geometry/map_frame.hpp"
#include "terrain/maps/coverage.hpp"
#include "terrain/surface_domain.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::renderer {

/// One map.
struct AlbedoSource {
    std::string name; ///< for messages: its file
    MapTexture map;
    terrain::MapFrame frame;
    double offset = 0, gain = 1; ///< factor = offset + gain * texel
    /// Maps of higher priority cover those of lower; of equal ones the later covers the earlier.
    int priority = 0;
    /// Width of the blend at the edge, m; none: default_feather_m().
    std::optional<double> feather_m{};
};

/// factor = below + w (map - below), with w = smoothstep of the distance to the edge of the map's samples
/// over the feather, as of heights (terrain/maps/raster_layer.hpp); below the lowest map it is 1. Immutable;
/// thread-safe.
///
/// Look-ups are averages over the footprint of the ray, by the map's mip levels. In giant textures they wait
/// for tiles or take coarser levels (renderer/textures/paged_texture.hpp), then they are real-time safe.
class NestedAlbedo {
public:
    static constexpr std::size_t max_sources = 64;

    /// At most max_sources. Throws InputError with one line that names the file.
    NestedAlbedo(const terrain::SurfaceDomain& domain, std::vector<AlbedoSource> sources,
                 const std::vector<SpectralBand>& bands);

    /// Fills `out[0, channels)` with the factors of the first bands at a point of the body, as means over the
    /// parallelogram with the edges `a_m` and `b_m`.
    void factors(Vec3 position_m, Vec3 a_m, Vec3 b_m, std::size_t channels, double* out) const;

    /// Whether the factor is the same in all bands.
    [[nodiscard]] bool grey() const { return grey_; }
    /// Mean over the body, first band.
    [[nodiscard]] double mean() const { return mean_; }
    /// Lines on edges and overlaps, for people.
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
    /// The textures of all maps.
    [[nodiscard]] std::vector<std::shared_ptr<const Texture>> textures() const;

private:
    struct Source {
        std::string name;
        std::shared_ptr<const Texture> texture;
        terrain::MapFrame frame;
        std::shared_ptr<const terrain::Coverage> coverage; ///< null: the whole body
        std::vector<double> weights;                       ///< band x plane
        double offset = 0, gain = 1, feather_m = 0;
    };
    /// Share of a map in the factor, 0 to 1.
    [[nodiscard]] double weight(const Source& source, Vec3 position_m) const;
    /// Factors by the first `count` sources alone.
    void factors_of(std::size_t count, Vec3 position_m, Vec3 a_m, Vec3 b_m, std::size_t channels,
                    double* out) const;
    static void lookup(const Source& source, Vec3 position_m, Vec3 a_m, Vec3 b_m, std::size_t channels,
                       double* out);
    void compare(const Source& source, std::optional<double> feather_m, double& chosen_feather_m);
    [[nodiscard]] double mean_over_body() const;

    terrain::SurfaceDomain domain_;
    std::vector<Source> sources_; ///< from the lowest upwards
    std::size_t bands_;
    std::vector<std::string> notes_;
    bool grey_ = true;
    double mean_ = 1;
};

} // namespace obscura::renderer
