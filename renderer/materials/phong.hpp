// The modified Phong law, normalised so that energy is conserved.
#pragma once

#include "renderer/materials/material.hpp"

namespace obscura::renderer {

/// r = mu0 [kd / pi + ks (n + 2) / (2 pi) cos^n(delta)], delta the angle between the viewer and the mirror
/// direction. kd + ks <= 1. Lafortune and Willems, Using the modified Phong reflectance model for physically
/// based rendering, KU Leuven report CW197 (1994), eq. 6.
class Phong final : public Material {
public:
    explicit Phong(const scene::Phong& d) : d_(d) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;
    [[nodiscard]] Vec3 sample(Vec3 out, double u, double v) const override;
    [[nodiscard]] double pdf(Vec3 out, Vec3 in) const override;
    [[nodiscard]] Vec3 sample_varied(const ParameterPacket& varied, int lane, Vec3 out, double u,
                                     double v) const override;
    [[nodiscard]] double pdf_varied(const ParameterPacket& varied, int lane, Vec3 out,
                                    Vec3 in) const override;

private:
    /// The loop itself: a virtual function cannot be compiled for several instruction sets.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    scene::Phong d_;
};

} // namespace obscura::renderer
