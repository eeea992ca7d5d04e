// SPDX-License-Identifier: Apache-2.0
// The lunar-Lambert law: a mix of Lommel-Seeliger and Lambert that depends on the phase angle.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

#include <array>

namespace obscura::renderer {

/// Parameters of LunarLambert.
struct LunarLambertParameters {
    static constexpr std::string_view kind = "lunar-lambert";
    static constexpr std::string_view help =
        "Lunar-Lambert law (McEwen): Lambert and Lommel-Seeliger mixed by the phase angle.";
    using Family = scene::MaterialFamily;

    double albedo = 0.1;
    /// L(g): coefficients of the phase angle in degrees, constant term first; the default is the Moon's.
    std::array<double, 4> weight{1, -0.019, 2.42e-4, -1.46e-6};
};
[[nodiscard]] scene::ParameterList declare(LunarLambertParameters& p);

/// r = A / pi [2 L(g) mu0 / (mu0 + mu) + (1 - L(g)) mu0], L a cubic of the phase angle in degrees, held
/// within [0, 1]. McEwen, Photometric functions for photoclinometry and other applications, Icarus 92 (1991)
/// 298, eq. 4; the default polynomial is the lunar one of McEwen, LPSC XXVII (1996) 841.
class LunarLambert final : public Material {
public:
    using Parameters = LunarLambertParameters;

    explicit LunarLambert(const LunarLambertParameters& d) : d_(d) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// Loop over the lanes, compiled for several instruction sets, which a virtual function cannot be.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    /// As evaluate(), with a weight L given for each lane instead of by the phase angle.
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    LunarLambertParameters d_;
};

} // namespace obscura::renderer
