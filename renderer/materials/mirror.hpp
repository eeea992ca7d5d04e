// SPDX-License-Identifier: Apache-2.0
// The perfect mirror.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of Mirror.
struct MirrorParameters {
    static constexpr std::string_view kind = "mirror";
    static constexpr std::string_view help =
        "Perfect mirror; reflections are seen only with max_bounces above 0.";
    using Family = scene::MaterialFamily;

    double reflectance = 0.9;
};
[[nodiscard]] scene::ParameterList declare(MirrorParameters& p);

/// BRDF is a delta distribution: light sampling never finds its light, which comes from following the
/// mirrored ray.
class Mirror final : public Material {
public:
    using Parameters = MirrorParameters;

    explicit Mirror(const MirrorParameters& d) : reflectance_(d.reflectance) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;
    [[nodiscard]] bool cosine_weighted() const override { return false; }
    [[nodiscard]] double mirror_reflectance() const override { return reflectance_; }

private:
    double reflectance_;
};

} // namespace obscura::renderer
