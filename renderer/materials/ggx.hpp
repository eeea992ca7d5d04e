// SPDX-License-Identifier: Apache-2.0
// GGX microfacet BRDF for metals, and for dielectrics over a diffuse base.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of Ggx.
struct GgxParameters {
    static constexpr std::string_view kind = "ggx";
    static constexpr std::string_view help =
        "GGX microfacet law: a metal, or a dielectric over a diffuse base.";
    using Family = scene::MaterialFamily;

    double roughness = 0.3;       ///< perceptual; alpha is its square
    double reflectance_f0 = 0.04; ///< at normal incidence
    double base_albedo = 0;       ///< 0 for metals
};
[[nodiscard]] scene::ParameterList declare(GgxParameters& p);

/// r = mu0 [D G2 F / (4 mu0 mu) + diffuse]. D by Trowbridge and Reitz (Walter et al., EGSR 2007, eq. 33),
/// height-correlated Smith G2 (Heitz, JCGT 3(2) 2014), Fresnel by Schlick (1994), visible normals sampled by
/// Heitz (JCGT 7(4) 2018). The base under a dielectric is Ashikhmin and Shirley's (2000, eq. 5): reciprocal,
/// and loses what the surface reflects. Metals have no base. Single scattering between facets only: energy is
/// lost at high roughness.
class Ggx final : public Material {
public:
    using Parameters = GgxParameters;

    explicit Ggx(const GgxParameters& d);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;
    [[nodiscard]] Vec3 sample(Vec3 out, double u, double v) const override;
    [[nodiscard]] double pdf(Vec3 out, Vec3 in) const override;
    [[nodiscard]] bool cosine_weighted() const override { return false; }
    [[nodiscard]] Vec3 sample_varied(const ParameterPacket& varied, int lane, Vec3 out, double u,
                                     double v) const override;
    [[nodiscard]] double pdf_varied(const ParameterPacket& varied, int lane, Vec3 out,
                                    Vec3 in) const override;

private:
    /// Loop over the lanes, compiled for several instruction sets, which a virtual function cannot be.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    double alpha_;          ///< square of the roughness
    double f0_;             ///< reflectance at normal incidence
    double base_;           ///< albedo of the base, 0 for metals
    double specular_share_; ///< fraction of samples that go to the specular lobe
};

} // namespace obscura::renderer
