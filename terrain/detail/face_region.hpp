// SPDX-License-Identifier: Apache-2.0
// Part of a face that a cap covers, and vertices by number.
#pragma once

#include "terrain/height_layer.hpp"
#include "terrain/surface_domain.hpp"

#include <cmath>
#include <cstdint>
#include <optional>

namespace obscura::terrain {

/// Rectangle of a face, -1 to 1.
struct FaceRegion {
    double u0 = -1, u1 = 1, v0 = -1, v1 = 1;
};

/// Contains all points of the face within the cap; empty: there are none. Not exact in its last bits.
[[nodiscard]] std::optional<FaceRegion> region_of_cap(const SurfaceDomain& domain, std::uint8_t face,
                                                      const Cap& cap);

/// u or v of vertex `number` of a level, counted from the face's corner; as SurfaceDomain::coordinate has it.
[[nodiscard]] inline double vertex_coordinate(int level, std::int64_t number) {
    return std::ldexp(static_cast<double>(number) * (2.0 / tile_cells), -level) - 1;
}
/// Number of the last vertex not beyond a coordinate.
[[nodiscard]] inline std::int64_t vertex_below(int level, double coordinate) {
    return static_cast<std::int64_t>(std::floor(std::ldexp((coordinate + 1) * (tile_cells / 2.0), level)));
}

} // namespace obscura::terrain
