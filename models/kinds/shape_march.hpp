// SPDX-License-Identifier: Apache-2.0
// Rays to the surface of a model of kind "shape", 16 at a time.
#pragma once

#include "models/kinds/shape_program.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace obscura::models {

inline constexpr std::size_t shape_lanes = Program::lane_step;

/// 16 rays in the frame of the shape. Directions are unit vectors.
struct ShapeRays {
    std::array<Vec3, shape_lanes> origin{}, direction{};
    std::array<double, shape_lanes> t_max{}; ///< where the search ends; 0 or less: no ray
    double origin_error_m = 0; ///< rounding of origins beyond that of lengths of the body's size
};

/// Nearest hits.
struct ShapeHits {
    std::array<double, shape_lanes> t{}; ///< distance; infinite: none
    /// The hit, or that there is none, is not sure: the value changed by more than its slope allows, is not
    /// a number, or the steps ran out.
    std::array<bool, shape_lanes> doubtful{};
    std::uint32_t evaluations = 0; ///< of 16 lanes
};

/// Steps of a ray before it is given up as doubtful.
inline constexpr int max_shape_steps = 256;

/// Goes along each ray by steps that the bounds of its cell allow: f + f' s - max_bend s^2 / 2 and f -
/// max_slope s are bounds from below, so that no root is passed; near a root these are Newton's steps. A ray
/// that starts on the surface, within rounding, and points outwards does not hit it there. Real-time safe.
void trace(const ShapeProgram& shape, const ShapeRays& rays, ShapeHits& hits) noexcept;

} // namespace obscura::models
