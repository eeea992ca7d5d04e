// SPDX-License-Identifier: Apache-2.0
// The modified Phong law, normalised so that energy is conserved.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of Phong.
struct PhongParameters {
    static constexpr std::string_view kind = "phong";
    static constexpr std::string_view help = "Phong's law, normalised so that energy is conserved.";
    using Family = scene::MaterialFamily;

    double diffuse = 0.3, specular = 0.3; ///< diffuse + specular <= 1
    double exponent = 20;
};
[[nodiscard]] scene::ParameterList declare(PhongParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const PhongParameters& p);

/// r = mu0 [kd / pi + ks (n + 2) / (2 pi) cos^n(delta)], delta the angle between the viewer and the mirror
/// direction. kd + ks <= 1. Lafortune and Willems, Using the modified Phong reflectance model for physically
/// based rendering, KU Leuven report CW197 (1994), eq. 6.
class Phong final : public Material {
public:
    using Parameters = PhongParameters;

    explicit Phong(const PhongParameters& d) : d_(d) {}
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
    PhongParameters d_;
};

} // namespace obscura::renderer
