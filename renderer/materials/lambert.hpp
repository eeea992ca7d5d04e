// Lambert's law.
#pragma once

#include "renderer/materials/material.hpp"

namespace obscura::renderer {

/// r = albedo / pi cos(i).
class Lambert final : public Material {
public:
    explicit Lambert(const scene::Lambert& d) : albedo_(d.albedo) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    double albedo_;
};

} // namespace obscura::renderer
