// SPDX-License-Identifier: Apache-2.0
// The Oren-Nayar law: a rough surface made of Lambertian facets.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of OrenNayar.
struct OrenNayarParameters {
    static constexpr std::string_view kind = "oren-nayar";
    static constexpr std::string_view help = "Oren-Nayar law: a rough surface made of Lambertian facets.";
    using Family = scene::MaterialFamily;

    double albedo = 0.5;    ///< of the facets
    double slope_rad = 0.3; ///< standard deviation of the facets' slope angle
};
[[nodiscard]] scene::ParameterList declare(OrenNayarParameters& p);

/// r = A / pi mu0 [a + b max(0, cos phi) sin(alpha) tan(beta)], the qualitative model: a = 1 - sigma^2 / (2
/// (sigma^2 + 0.33)), b = 0.45 sigma^2 / (sigma^2 + 0.09), sigma the standard deviation of the facets' slope
/// in radians, alpha and beta the larger and the smaller of the angles of incidence and emission. Oren and
/// Nayar, Generalization of Lambert's reflectance model, SIGGRAPH 94, eq. 30.
class OrenNayar final : public Material {
public:
    using Parameters = OrenNayarParameters;

    explicit OrenNayar(const OrenNayarParameters& d);
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// Loop over the lanes, compiled for several instruction sets, which a virtual function cannot be.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    double scale_, a_, b_;
};

} // namespace obscura::renderer
