// SPDX-License-Identifier: Apache-2.0
// Checks of a shape before it is used: whether rays find a closed surface, and how sure they are.
#pragma once

#include "models/kinds/shape_program.hpp"

#include <string>
#include <vector>

namespace obscura::models {

/// What 4096 rays through random points of the ball, and points on it, have found. Angles in degrees are
/// those of the frame of the shape.
struct ShapeReport {
    double hit_share = 0;           ///< of the rays
    bool inside_everywhere = false; ///< the whole ball
    double cut_share = 0;           ///< of the sphere that bounds it: the value is not positive there
    double cut_longitude_deg = 0, cut_latitude_deg = 0;
    double doubtful_share = 0; ///< of the rays: see ShapeHits
    Vec3 doubtful_at{};
    double worst_slope = 0; ///< largest slope that was met at the surface and on the rays to it
    double thinnest_m = 0;  ///< way through the body of a ray that hits it straight on; 0: no hits
    Vec3 thinnest_at{};
    double largest_m = 0; ///< distance of a point of the surface from the origin
    double evaluations_a_ray = 0;
};
[[nodiscard]] ShapeReport report_on(const ShapeProgram& shape);

/// Why the shape cannot be used; empty: it can.
[[nodiscard]] std::string refusal_by(const ShapeReport& report, const ShapeProgram& shape);
/// What users should know, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> warnings_by(const ShapeReport& report, const ShapeProgram& shape);

} // namespace obscura::models
