// The Lommel-Seeliger law: single scattering in a dark, porous surface.
#pragma once

#include "renderer/materials/material.hpp"

namespace obscura::renderer {

/// r = w / (4 pi) mu0 / (mu0 + mu), isotropic single scattering. Hapke, Theory of Reflectance and Emittance
/// Spectroscopy, 2nd ed. (2012), eq. 8.35a.
class LommelSeeliger final : public Material {
public:
    explicit LommelSeeliger(const scene::LommelSeeliger& d) : albedo_(d.albedo) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    double albedo_;
};

} // namespace obscura::renderer
