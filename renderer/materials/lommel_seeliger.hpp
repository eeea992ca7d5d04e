// SPDX-License-Identifier: Apache-2.0
// The Lommel-Seeliger law: single scattering in a dark, porous surface.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of LommelSeeliger.
struct LommelSeeligerParameters {
    static constexpr std::string_view kind = "lommel-seeliger";
    static constexpr std::string_view help =
        "Lommel-Seeliger law: single scattering in a dark, porous surface.";
    using Family = scene::MaterialFamily;

    double albedo = 0.1; ///< single-scattering albedo w
};
[[nodiscard]] scene::ParameterList declare(LommelSeeligerParameters& p);

/// r = w / (4 pi) mu0 / (mu0 + mu), isotropic single scattering. Hapke, Theory of Reflectance and Emittance
/// Spectroscopy, 2nd ed. (2012), eq. 8.35a.
class LommelSeeliger final : public Material {
public:
    using Parameters = LommelSeeligerParameters;

    explicit LommelSeeliger(const LommelSeeligerParameters& d) : albedo_(d.albedo) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    double albedo_;
};

} // namespace obscura::renderer
