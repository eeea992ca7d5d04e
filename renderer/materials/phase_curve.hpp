// SPDX-License-Identifier: Apache-2.0
// Scattering law whose sphere has a given disc-integrated phase curve.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

#include <vector>

namespace obscura::renderer {

/// Parameters of PhaseCurve.
struct PhaseCurveParameters {
    static constexpr std::string_view kind = "phase-curve";
    static constexpr std::string_view help =
        "Measured phase curve: a sphere has the given geometric albedo and magnitudes over phase; "
        "limb darkening between Lommel-Seeliger's and Lambert's law.";
    using Family = scene::MaterialFamily;

    double albedo = 0.1; ///< geometric, of a sphere at phase 0
    /// Phase angles in degrees, from 0 up, and magnitudes there less that at phase 0.
    std::vector<double> phase_deg{0, 120}, phase_mag{0, 3.6};
    double lunar_share = 0.5; ///< L
};
[[nodiscard]] scene::ParameterList declare(PhaseCurveParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const PhaseCurveParameters& p);

/// Light of a Lommel-Seeliger and of a Lambert sphere at phase angle g over that at phase 0. Russell, ApJ 43,
/// 173 (1916).
[[nodiscard]] double lommel_seeliger_phase(double phase_rad);
[[nodiscard]] double lambert_phase(double phase_rad);

/// r = f(g) / pi mu0 [2 L / (mu0 + mu) + 1 - L], L constant, f such that a sphere has the phase curve:
/// f = p 10^(-0.4 m(g)) / (L Phi_LS(g) + (1 - L) 2/3 Phi_Lambert(g)). m is a monotone cubic through the
/// table; beyond its last angle f keeps its value. The disc function is that of McEwen, Icarus 92 (1991) 298,
/// eq. 4. Reciprocal. An empirical law: where the light of a thin crescent comes from a haze that scatters
/// forwards, as on Venus beyond 160 degrees, the surface appears brighter than a white one.
class PhaseCurve final : public Material {
public:
    using Parameters = PhaseCurveParameters;

    explicit PhaseCurve(const PhaseCurveParameters& p);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// f / pi at equal steps of sin(g / 2), whose square is linear in the cosine: fine near opposition.
    std::vector<double> factor_;
    double lunar_share_;
};

} // namespace obscura::renderer
