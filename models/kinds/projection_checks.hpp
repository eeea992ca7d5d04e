// SPDX-License-Identifier: Apache-2.0
// Checks of a projection at load: seen, one to one, its two directions one another's inverse.
#pragma once

#include "models/kinds/projection_program.hpp"

#include <string>
#include <vector>

namespace obscura::models {

/// Image point, px.
struct CheckedPoint {
    double x = 0, y = 0;
};

/// What a projection does on a grid of 33 x 33 points of the sensor, and for directions all round.
struct ProjectionReport {
    double seen_share = 0;    ///< of the points
    bool mirrored = false;    ///< the image is
    bool folded = false;      ///< mirrored in parts only
    CheckedPoint folded_at{}; ///< the first point that differs from those before
    double round_trip_px = 0; ///< largest distance of a point from that of its direction; infinite: none
    CheckedPoint round_trip_at{};
    double hole_share = 0; ///< of the points: not seen amid others that are
    CheckedPoint hole_at{};
    double ambiguous_share = 0; ///< of directions on the sensor: another one falls on the same point
    CheckedPoint ambiguous_at{};
    std::array<double, 2> ambiguous_deg{}; ///< angles of the two to the boresight
    double lost_share = 0;                 ///< of directions on the sensor: Newton's steps do not find them
    CheckedPoint lost_at{};
    double field_deg = 0;           ///< largest angle to the boresight that a point of the grid sees
    bool transmission_valid = true; ///< 0..1 wherever something is seen
    double transmission = 1;        ///< the worst value
    CheckedPoint transmission_at{};
};
[[nodiscard]] ProjectionReport report_on(const ProjectionProgram& projection);

/// Why the projection cannot be used; empty: it can.
[[nodiscard]] std::string refusal_by(const ProjectionReport& report);
/// What a user should know of it, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> warnings_by(const ProjectionReport& report);

} // namespace obscura::models
