// SPDX-License-Identifier: Apache-2.0
// Ground of a body along a line on which heights count.
#pragma once

#include "renderer/scene/surface_place.hpp"
#include "renderer/shapes/shape.hpp"

#include <cstdint>
#include <optional>

namespace obscura::renderer {

/// How finely the ground of a terrain is looked at.
enum class GroundDetail : std::uint8_t {
    coarse, ///< the level of queries, see TerrainShape; fast
    finest, ///< cells of about a centimetre: makes the tiles there
};

/// Height of the outermost surface over the foot of the line, m; none: the line meets no surface on this
/// side of the body.
[[nodiscard]] std::optional<double> ground_height_m(const Shape& shape, const scene::HeightLine& line,
                                                    GroundDetail detail);

} // namespace obscura::renderer
