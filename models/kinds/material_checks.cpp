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

namespace {

/// Adds what one band of a law does to a report of all.
void add_band(const ScatterGrid& at, const std::vector<double>& r, const std::vector<double>& swapped,
              double share, MaterialReport& report, double& most_negative) {
    std::array<double, grid> albedos{};
    for (std::size_t i = 0; i < r.size(); ++i) {
        if (!std::isfinite(r[i])) {
            if (report.not_finite_share == 0) report.not_finite_at = at.angles(i);
            report.not_finite_share += share;
            continue;
        }
        if (r[i] < 0) {
            report.negative_share += share;
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
    if (*largest <= report.largest_albedo) return;
    report.largest_albedo = *largest;
    report.largest_albedo_at_deg =
        std::acos(ScatterGrid::cosine(static_cast<std::size_t>(largest - albedos.begin()))) / degree;
}

} // namespace

MaterialReport report_on(const MaterialProgram& law, double row) {
    std::vector<double> rows(law.rows(), row);
    rows[law.row(SurfaceRow::t)] = 0;
    return report_on(law, rows);
}

MaterialReport report_on(const MaterialProgram& law, std::span<const double> rows) {
    const ScatterGrid at;
    std::vector<std::vector<double>> filled;
    std::vector<const double*> row_starts;
    for (const double value : rows)
        row_starts.push_back(filled.emplace_back(directions_in_all, value).data());
    std::vector<std::vector<double>> r(law.outputs(), std::vector<double>(directions_in_all)), swapped = r;
    std::vector<double*> to_r, to_swapped;
    for (std::size_t k = 0; k < law.outputs(); ++k) {
        to_r.push_back(r[k].data());
        to_swapped.push_back(swapped[k].data());
    }
    law.evaluate(at.in.data(), at.out.data(), at.phase.data(), row_starts.data(), to_r.data(),
                 directions_in_all);
    law.evaluate(at.out.data(), at.in.data(), at.phase.data(), row_starts.data(), to_swapped.data(),
                 directions_in_all);
    MaterialReport report;
    double most_negative = 0;
    for (std::size_t k = 0; k < law.outputs(); ++k)
        add_band(at, r[k], swapped[k], 1.0 / static_cast<double>(directions_in_all * law.outputs()), report,
                 most_negative);
    return report;
}

EmissionReport report_on_emission(const MaterialProgram& emission, std::span<const double> rows) {
    constexpr std::size_t angles = 57 * Program::lane_step;
    std::vector<double> cosines, ones(angles, 1);
    const auto angle_deg = [](std::size_t i) { return 90 * (static_cast<double>(i) + 0.5) / angles; };
    for (std::size_t i = 0; i < angles; ++i)
        cosines.push_back(std::cos(angle_deg(i) * degree));
    std::vector<std::vector<double>> filled, out(emission.outputs(), std::vector<double>(angles));
    std::vector<const double*> starts;
    for (const double value : rows)
        filled.emplace_back(angles, value);
    for (const std::vector<double>& row : filled)
        starts.push_back(row.data());
    std::vector<double*> to_out;
    for (std::vector<double>& row : out)
        to_out.push_back(row.data());
    emission.evaluate(ones.data(), cosines.data(), cosines.data(), starts.data(), to_out.data(), angles);
    EmissionReport report;
    double most_negative = 0;
    for (const std::vector<double>& band : out)
        for (std::size_t i = 0; i < angles; ++i) {
            const double share = 1.0 / static_cast<double>(angles * out.size());
            if (!std::isfinite(band[i])) {
                if (report.not_finite_share == 0) report.not_finite_at_deg = angle_deg(i);
                report.not_finite_share += share;
            } else if (band[i] < 0) {
                report.negative_share += share;
                if (band[i] < most_negative) {
                    most_negative = band[i];
                    report.negative_at_deg = angle_deg(i);
                }
            }
        }
    return report;
}

std::string refusal_by(const EmissionReport& report) {
    return report.not_finite_share > 0
               ? fmt::format("emission() is not finite for {:.1f} % of angles, at emission {:.0f} deg",
                             std::max(report.not_finite_share * 100, 0.1), report.not_finite_at_deg)
               : "";
}

std::string warning_by(const EmissionReport& report) {
    return report.negative_share > 0
               ? fmt::format(
                     "emission() is negative for {:.1f} % of angles, most at emission {:.0f} deg: counts as 0 there",
                     std::max(report.negative_share * 100, 0.1), report.negative_at_deg)
               : "";
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
