// SPDX-License-Identifier: Apache-2.0
// Checks of a scattering law at load: finite, positive, reciprocal, and no more light than came in.
#pragma once

#include "models/kinds/material_program.hpp"

#include <span>
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
/// Report on brdf(), with its rows at `rows`: 24 x 24 x 24 directions, in all bands.
[[nodiscard]] MaterialReport report_on(const MaterialProgram& law, std::span<const double> rows);
/// With all rows but the time at `row`.
[[nodiscard]] MaterialReport report_on(const MaterialProgram& law, double row = 0.5);

/// What emission() does on 912 angles of emission, with an argument `emission` of 1 where it varies.
struct EmissionReport {
    double not_finite_share = 0, not_finite_at_deg = 0; ///< of the angles, and the first
    double negative_share = 0, negative_at_deg = 0; ///< of the angles, and that of the most negative value
};
[[nodiscard]] EmissionReport report_on_emission(const MaterialProgram& emission,
                                                std::span<const double> rows);
/// Why emission() cannot be used; empty: it can.
[[nodiscard]] std::string refusal_by(const EmissionReport& report);
/// What a user should know of it; empty: nothing.
[[nodiscard]] std::string warning_by(const EmissionReport& report);

/// Why the law cannot be used; empty: it can. `bounces`: light is reflected more than once.
[[nodiscard]] std::string refusal_by(const MaterialReport& report, bool bounces);
/// What a user should know of the law, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> warnings_by(const MaterialReport& report, bool bounces);

} // namespace obscura::models
