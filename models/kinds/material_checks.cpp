// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/material_checks.hpp"

#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace obscura::models {
namespace {

constexpr std::size_t grid = 24;
constexpr std::size_t directions_in_all = grid * grid * grid;
static_assert(directions_in_all % Program::lane_step == 0);

/// Directions of the grid: midpoints in the squared cosines, which weigh a hemisphere by the cosine, and in
/// azimuth.
struct ScatterGrid {
    std::vector<double> in, out, phase;

    ScatterGrid() {
        for (std::size_t i = 0; i < grid; ++i)
            for (std::size_t k = 0; k < grid; ++k)
                for (std::size_t m = 0; m < grid; ++m) {
                    const double mu0 = cosine(i), mu = cosine(k);
                    in.push_back(mu0);
                    out.push_back(mu);
                    phase.push_back(mu0 * mu +
                                    std::sqrt((1 - mu0 * mu0) * (1 - mu * mu)) * std::cos(azimuth(m)));
                }
    }
    static double cosine(std::size_t i) { return std::sqrt((static_cast<double>(i) + 0.5) / grid); }
    static double azimuth(std::size_t m) { return std::numbers::pi * (static_cast<double>(m) + 0.5) / grid; }
    [[nodiscard]] ScatterAngles angles(std::size_t index) const {
        return {std::acos(in[index]) / degree, std::acos(out[index]) / degree,
                azimuth(index % grid) / degree};
    }
};

} // namespace

std::string text_of(const ScatterAngles& a) {
    return fmt::format("at incidence {:.0f}, emission {:.0f}, azimuth {:.0f} deg", a.incidence_deg,
                       a.emission_deg, a.azimuth_deg);
}

MaterialReport report_on(const MaterialProgram& law, double varied) {
    const ScatterGrid at;
    const std::vector<double> parameter(directions_in_all, varied);
    const std::array<const double*, MaterialProgram::max_varied> rows = [&] {
        std::array<const double*, MaterialProgram::max_varied> all{};
        all.fill(parameter.data());
        return all;
    }();
    std::vector<double> r(directions_in_all), swapped(directions_in_all);
    law.evaluate(at.in.data(), at.out.data(), at.phase.data(), rows.data(), r.data(), r.size());
    law.evaluate(at.out.data(), at.in.data(), at.phase.data(), rows.data(), swapped.data(), r.size());

    MaterialReport report;
    double most_negative = 0;
    std::array<double, grid> albedos{};
    for (std::size_t i = 0; i < r.size(); ++i) {
        if (!std::isfinite(r[i])) {
            if (report.not_finite_share == 0) report.not_finite_at = at.angles(i);
            report.not_finite_share += 1.0 / directions_in_all;
            continue;
        }
        if (r[i] < 0) {
            report.negative_share += 1.0 / directions_in_all;
            if (r[i] < most_negative) {
                most_negative = r[i];
                report.negative_at = at.angles(i);
            }
        }
        // Each direction of emission stands for pi / grid^2 of the cosine-weighted hemisphere.
        albedos[i / (grid * grid)] += std::max(r[i], 0.0) / at.in[i] * std::numbers::pi / (grid * grid);
        const double there = r[i] / at.in[i], back = swapped[i] / at.out[i];
        const double difference = std::abs(there - back) / std::max({std::abs(there), std::abs(back), 1e-12});
        if (difference > report.asymmetry) {
            report.asymmetry = difference;
            report.asymmetry_at = at.angles(i);
        }
    }
    const auto largest = std::max_element(albedos.begin(), albedos.end());
    report.largest_albedo = *largest;
    report.largest_albedo_at_deg =
        std::acos(ScatterGrid::cosine(static_cast<std::size_t>(largest - albedos.begin()))) / degree;
    return report;
}

std::string refusal_by(const MaterialReport& report, bool bounces) {
    if (report.not_finite_share > 0)
        return fmt::format("brdf() is not finite for {:.1f} % of lit and seen directions, {}",
                           std::max(report.not_finite_share * 100, 0.1), text_of(report.not_finite_at));
    // The sum over the grid is good to some 1e-3 for laws with a sharp lobe.
    if (bounces && report.largest_albedo > 1.001)
        return fmt::format(
            "brdf() reflects {:.4g} of the light that comes in at incidence {:.0f} deg: allowed is 1 where "
            "light is reflected more than once",
            report.largest_albedo, report.largest_albedo_at_deg);
    return "";
}

std::vector<std::string> warnings_by(const MaterialReport& report, bool bounces) {
    std::vector<std::string> lines;
    if (!bounces && report.largest_albedo > 1.001)
        lines.push_back(fmt::format(
            "brdf() reflects {:.4g} of the light that comes in at incidence {:.0f} deg, which is more "
            "than all",
            report.largest_albedo, report.largest_albedo_at_deg));
    if (report.negative_share > 0)
        lines.push_back(fmt::format(
            "brdf() is negative for {:.1f} % of lit and seen directions, most {}: counts as 0 there",
            std::max(report.negative_share * 100, 0.1), text_of(report.negative_at)));
    if (report.asymmetry > 1e-6)
        lines.push_back(fmt::format(
            "brdf() is not reciprocal: exchanging light and camera changes it by {:.2g} of itself {}",
            report.asymmetry, text_of(report.asymmetry_at)));
    return lines;
}

} // namespace obscura::models
