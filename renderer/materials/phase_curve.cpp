// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/phase_curve.hpp"

#include "core/monotone_cubic.hpp"
#include "core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Largest phase angle of the table: at 180 degrees a sphere shows no light, whatever f.
constexpr double last_table_deg = 179;
/// Steps of factor_: 0.06 degrees at opposition, 0.6 degrees at 168 degrees.
constexpr int curve_steps = 2048;

} // namespace

scene::ParameterList declare(PhaseCurveParameters& p) {
    return {
        config::key("albedo", &p.albedo)
            .range(0, 2)
            .required()
            .help(
                "Geometric albedo: light of a sphere at phase 0 over that of a Lambert disc of its size and albedo 1"),
        config::key("phase_deg", &p.phase_deg)
            .unit("deg")
            .range(0, last_table_deg)
            .required()
            .help("Phase angles of the phase curve, from 0 up"),
        config::key("phase_mag", &p.phase_mag)
            .unit("mag")
            .range(-5, 30)
            .required()
            .help(
                "Magnitudes of a sphere at these phase angles, less that at phase 0; a monotone cubic between"),
        config::key("lunar_share", &p.lunar_share)
            .range(0, 1)
            .help("Share L of the Lommel-Seeliger law in the limb darkening; 0: "
                  "Lambert's law, 1: no limb darkening at phase 0"),
    };
}

std::vector<scene::Conflict> conflicts_in(const PhaseCurveParameters& p) {
    const std::vector<double>& g = p.phase_deg;
    if (g.size() < 2 || g.front() != 0 ||
        std::adjacent_find(g.begin(), g.end(), [](double a, double b) { return a >= b; }) != g.end())
        return {{"phase_deg", "allowed are two or more angles that begin at 0 and increase"}};
    if (p.phase_mag.size() != g.size())
        return {{"phase_mag", fmt::format("{} magnitudes, allowed as many as there are angles: {}",
                                          p.phase_mag.size(), g.size())}};
    if (p.phase_mag.front() != 0) return {{"phase_mag", "the first magnitude must be 0"}};
    return {};
}

double lommel_seeliger_phase(double phase_rad) {
    const double half = phase_rad / 2;
    if (half < 1e-9) return 1;
    return 1 - std::sin(half) * std::tan(half) * std::log(1 / std::tan(half / 2));
}

double lambert_phase(double phase_rad) {
    return (std::sin(phase_rad) + (std::numbers::pi - phase_rad) * std::cos(phase_rad)) / std::numbers::pi;
}

PhaseCurve::PhaseCurve(const PhaseCurveParameters& p) : lunar_share_(p.lunar_share) {
    const std::vector<double> slopes = monotone_slopes(p.phase_deg, p.phase_mag);
    factor_.resize(curve_steps + 2);
    for (int i = 0; i <= curve_steps + 1; ++i) {
        const double g_deg =
            std::min(2 * std::asin(std::min(1.0, double(i) / curve_steps)) / degree, p.phase_deg.back());
        const double light =
            p.albedo * std::pow(10, -0.4 * monotone_cubic(p.phase_deg, p.phase_mag, slopes, g_deg));
        const double disc = p.lunar_share * lommel_seeliger_phase(g_deg * degree) +
                            (1 - p.lunar_share) * 2 / 3 * lambert_phase(g_deg * degree);
        factor_[static_cast<std::size_t>(i)] = light / disc * std::numbers::inv_pi;
    }
}

void PhaseCurve::reflectance(const ScatterPacket& s, Doubles& r) const {
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i];
        if (!(mu0 > 0)) {
            r[i] = 0;
            continue;
        }
        // sin(g / 2), and from there the table.
        const double at = curve_steps * std::sqrt(std::clamp((1 - s.cos_phase[i]) / 2, 0.0, 1.0));
        const auto k = static_cast<std::size_t>(at);
        const double t = at - static_cast<double>(k);
        const double f = factor_[k] + t * (factor_[k + 1] - factor_[k]);
        r[i] = f * mu0 * (2 * lunar_share_ / (mu0 + s.cos_out[i]) + 1 - lunar_share_);
    }
}

} // namespace obscura::renderer
