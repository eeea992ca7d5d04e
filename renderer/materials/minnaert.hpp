// SPDX-License-Identifier: Apache-2.0
// Minnaert's empirical law.
#pragma once

#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Parameters of Minnaert.
struct MinnaertParameters {
    static constexpr std::string_view kind = "minnaert";
    static constexpr std::string_view help = "Minnaert's empirical law, limb darkening by one exponent.";
    using Family = scene::MaterialFamily;

    double albedo = 0.1;
    double exponent = 0.7; ///< k
};
[[nodiscard]] scene::ParameterList declare(MinnaertParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const MinnaertParameters& p);

/// r = A / pi mu0^k mu^(k-1). k = 1 is Lambert. Minnaert, The reciprocity principle in lunar photometry, ApJ
/// 93 (1941) 403. For k < 1 the law diverges at the limb; its Bond albedo 4 A / (k + 1)^2 may not exceed 1.
class Minnaert final : public Material {
public:
    using Parameters = MinnaertParameters;

    explicit Minnaert(const MinnaertParameters& d) : d_(d) {}
    void reflectance(const ScatterPacket& s, Doubles& r) const override;

private:
    /// Loop over the lanes, compiled for several instruction sets, which a virtual function cannot be.
    void evaluate(const ScatterPacket& s, Doubles& r) const;
    void evaluate_varied(const ScatterPacket& s, Doubles& r) const;
    MinnaertParameters d_;
};

} // namespace obscura::renderer
