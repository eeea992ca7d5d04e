// The perfect mirror.
#pragma once

#include "renderer/materials/material.hpp"

namespace obscura::renderer {

/// Sends light back in one direction only, so that no lamp is ever met by chance: its light is found by
/// following the reflected ray.
class Mirror final : public Material {
public:
    explicit Mirror(const scene::Mirror& d) : reflectance_(d.reflectance) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;
    [[nodiscard]] double mirror_reflectance() const override { return reflectance_; }

private:
    double reflectance_;
};

} // namespace obscura::renderer
