// SPDX-License-Identifier: Apache-2.0
// Hapke's model of particulate surfaces, with both opposition effects, roughness and porosity.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of Hapke.
struct HapkeParameters {
    static constexpr std::string_view kind = "hapke";
    static constexpr std::string_view help =
        "Hapke's model (2012) of particulate surfaces: both opposition surges, roughness and porosity.";
    using Family = scene::MaterialFamily;

    double single_scattering_albedo = 0.3; ///< w
    double phase_b = 0.3, phase_c = 0.5;   ///< two-lobed Henyey-Greenstein; c = 1: all backwards
    double shadow_hiding_b0 = 0, shadow_hiding_h = 0.05;
    double backscatter_b0 = 0, backscatter_h = 0.1;
    double roughness_rad = 0;  ///< mean slope angle theta-bar
    double filling_factor = 0; ///< phi; 0: no porosity correction
};
[[nodiscard]] scene::ParameterList declare(HapkeParameters& p);

/// r = K w / (4 pi) mu0e / (mu0e + mue) [p(g) (1 + Bs0 Bs(g)) + H(mu0e/K) H(mue/K) - 1] (1 + Bc0 Bc(g)) S(i,
/// e, psi). Two-lobed Henyey-Greenstein p(g), H function of Hapke (2002), shadow-hiding and
/// coherent-backscatter surges, porosity factor K, macroscopic roughness S with effective cosines mu0e, mue.
/// Hapke, Theory of Reflectance and Emittance Spectroscopy, 2nd ed. (Cambridge 2012),
/// eqs. 6.7a, 7.45, 8.56, 9.22, 9.43, 12.46 to 12.55.
class Hapke final : public Material {
public:
    using Parameters = HapkeParameters;

    explicit Hapke(const HapkeParameters& d);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// Loop over the lanes, compiled for several instruction sets, which a virtual function cannot be.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    HapkeParameters d_;
    double porosity_factor_; ///< K
    double r0_;              ///< diffusive reflectance (1 - gamma) / (1 + gamma)
    double tan_roughness_, cot_roughness_, chi_;
    bool rough_;
};

} // namespace obscura::renderer
