// Hapke's model of particulate surfaces, with both opposition effects, roughness and porosity.
#pragma once

#include "renderer/materials/material.hpp"

namespace obscura::renderer {

/// r = K w / (4 pi) mu0e / (mu0e + mue) [p(g) (1 + Bs0 Bs(g)) + H(mu0e/K) H(mue/K) - 1] (1 + Bc0 Bc(g)) S(i,
/// e, psi). Two-lobed Henyey-Greenstein p(g), H function of Hapke (2002), shadow-hiding and
/// coherent-backscatter surges, porosity factor K, macroscopic roughness S with effective cosines mu0e, mue.
/// Hapke, Theory of Reflectance and Emittance Spectroscopy, 2nd ed. (Cambridge 2012),
/// eqs. 6.7a, 7.45, 8.56, 9.22, 9.43, 12.46 to 12.55.
class Hapke final : public Material {
public:
    explicit Hapke(const scene::Hapke& d);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// The loop itself: a virtual function cannot be compiled for several instruction sets.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    scene::Hapke d_;
    double porosity_factor_; ///< K
    double r0_;              ///< diffusive reflectance (1 - gamma) / (1 + gamma)
    double tan_roughness_, cot_roughness_, chi_;
    bool rough_;
};

} // namespace obscura::renderer
