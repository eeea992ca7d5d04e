// SPDX-License-Identifier: Apache-2.0
// Lambert's law.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of Lambert.
struct LambertParameters {
    static constexpr std::string_view kind = "lambert";
    static constexpr std::string_view help = "Lambert's law: the same radiance in every direction.";
    using Family = scene::MaterialFamily;

    double albedo = 0.1; ///< hemispherical reflectance
};
[[nodiscard]] scene::ParameterList declare(LambertParameters& p);

/// r = albedo / pi cos(i).
class Lambert : public Material {
public:
    using Parameters = LambertParameters;

    explicit Lambert(const LambertParameters& d) : albedo_(d.albedo) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    double albedo_;
};

} // namespace obscura::renderer
