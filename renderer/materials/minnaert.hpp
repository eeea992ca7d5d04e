// Minnaert's empirical law.
#pragma once

#include "renderer/materials/material.hpp"

namespace obscura::renderer {

/// r = A / pi mu0^k mu^(k-1). k = 1 is Lambert. Minnaert, The reciprocity principle in lunar photometry, ApJ
/// 93 (1941) 403. For k < 1 the law diverges at the limb; its Bond albedo 4 A / (k + 1)^2 may not exceed 1.
class Minnaert final : public Material {
public:
    explicit Minnaert(const scene::Minnaert& d) : d_(d) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// The loop itself: a virtual function cannot be compiled for several instruction sets.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    scene::Minnaert d_;
};

} // namespace obscura::renderer
