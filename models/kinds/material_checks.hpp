// SPDX-License-Identifier: Apache-2.0
// Checks of a scattering law at load: finite, positive, reciprocal, and no more light than came in.
#pragma once

#include "models/kinds/material_program.hpp"

#include <string>

namespace obscura::models {

/// Directions of light and camera, degrees.
struct ScatterAngles {
    double incidence_deg = 0, emission_deg = 0, azimuth_deg = 0;
};
/// "at incidence 30, emission 60, azimuth 180 deg"
[[nodiscard]] std::string text_of(const ScatterAngles& angles);

/// What a law does on a grid of lit and seen directions.
struct MaterialReport {
    double largest_albedo = 0;        ///< directional-hemispherical reflectance
    double largest_albedo_at_deg = 0; ///< its angle of incidence
    double not_finite_share = 0;      ///< of the directions
    ScatterAngles not_finite_at{};    ///< the first
    double negative_share = 0;        ///< of the directions
    ScatterAngles negative_at{};      ///< of the most negative value
    double asymmetry = 0;             ///< largest relative difference of r(i, e) / mu0 from r(e, i) / mu
    ScatterAngles asymmetry_at{};
};
/// With all varied parameters at `varied`. 24 x 24 x 24 directions.
[[nodiscard]] MaterialReport report_on(const MaterialProgram& law, double varied = 0.5);

/// Why the law cannot be used; empty: it can. `bounces`: light is reflected more than once.
[[nodiscard]] std::string refusal_by(const MaterialReport& report, bool bounces);
/// What a user should know of the law, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> warnings_by(const MaterialReport& report, bool bounces);

} // namespace obscura::models
