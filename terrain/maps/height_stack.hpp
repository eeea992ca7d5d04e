// SPDX-License-Identifier: Apache-2.0
// Nested height sources of one terrain: patches over a base, with the statistics of their overlaps.
#pragma once

#include "core/text/enum_names.hpp"
#include "terrain/height_layer.hpp"
#include "terrain/maps/raster_layer.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::terrain {

/// How a patch is fitted to what is below it.
enum class PatchMatch : std::uint8_t {
    none,   ///< its heights as they are
    offset, ///< shifted by the mean difference over the overlap
};
constexpr auto enum_names(PatchMatch /*type*/) {
    return std::array{EnumName{PatchMatch::none, "none"}, EnumName{PatchMatch::offset, "offset"}};
}

/// One source.
struct HeightSource {
    std::string name; ///< for messages: its file
    HeightRaster raster;
    /// Sources of higher priority cover those of lower; of equal ones the later covers the earlier.
    int priority = 0;
    /// Width of the blend at the edge, m; none: 16 of its own pixels and at least 4 of those below, at most a
    /// quarter of its shorter side.
    std::optional<double> feather_m{};
    PatchMatch match = PatchMatch::none;
};

/// Differences of a source from those below it, over its pixels.
struct Overlap {
    std::string name;
    std::int64_t points = 0; ///< that were compared
    double mean_m = 0, rms_m = 0;
    double shift_m = 0;   ///< that `match` added
    double feather_m = 0; ///< of the blend
};
/// "patch.tif: 250000 points over what is below: mean -2.06 m, rms 6.76 m; blended over 1897 m".
[[nodiscard]] std::string to_string(const Overlap& overlap);

/// Height sources of a terrain as layers.
struct HeightStack {
    std::vector<std::shared_ptr<const HeightLayer>> layers; ///< from the lowest upwards
    std::vector<Overlap> overlaps;                          ///< of each source but the lowest
};

/// Sorts the sources by priority and makes layers of them. Throws InputError if the lowest leaves part of the
/// domain without heights, naming the place.
[[nodiscard]] HeightStack make_height_stack(const SurfaceDomain& domain, std::vector<HeightSource> sources);

/// Height of a stack of layers at points of the reference surface.
[[nodiscard]] std::vector<double> heights_at(const std::vector<std::shared_ptr<const HeightLayer>>& layers,
                                             std::span<const Vec3> positions_m, double spacing_m);

} // namespace obscura::terrain
