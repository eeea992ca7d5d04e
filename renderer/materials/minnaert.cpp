// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/minnaert.hpp"

#include "core/math/vector_functions.hpp"

#include <fmt/format.h>

#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(MinnaertParameters& p) {
    return {
        config::key("albedo", &p.albedo)
            .range(0, 1)
            .required()
            .help(
                "Minnaert albedo A: the normal albedo; the Bond albedo 4 A / (exponent + 1)^2 may not exceed 1"),
        scene::image_or(config::key("exponent", &p.exponent)
                            .range(0.3, 2)
                            .help("Minnaert exponent k; 1: Lambert's law, less: brighter limb")),
    };
}

std::vector<scene::Conflict> conflicts_in(const MinnaertParameters& p) {
    const double most = (p.exponent + 1) * (p.exponent + 1) / 4; // Bond albedo 1
    if (p.albedo <= most) return {};
    return {{"albedo", fmt::format("{}: allowed 0 to {} with this exponent", p.albedo, most)}};
}

namespace {

template<typename Parameter>
[[gnu::always_inline]] inline void minnaert_loop(const ScatterPacket& s, double albedo,
                                                 const Parameter& exponent, Doubles& r) {
    const double scale = albedo * std::numbers::inv_pi;
    constexpr double least = 1e-12; // keeps the logarithm finite; the light there is too faint to detect
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i] > least ? s.cos_in[i] : least;
        const double mu = s.cos_out[i] > least ? s.cos_out[i] : least;
        const double value = scale * mu0 * vector_pow(mu0 * mu, exponent[i] - 1);
        r[i] = s.cos_in[i] > 0 ? value : 0.0;
    }
}

} // namespace

void Minnaert::reflectance(const ScatterPacket& s, Doubles& r) const {
    s.varied != nullptr ? evaluate_varied(s, r) : evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Minnaert::evaluate(const ScatterPacket& s, Doubles& r) const {
    minnaert_loop(s, d_.albedo, SameInAllLanes{d_.exponent}, r);
}

OBSCURA_VECTOR_CLONES void Minnaert::evaluate_varied(const ScatterPacket& s, Doubles& r) const {
    minnaert_loop(s, d_.albedo, s.varied->value[0], r);
}

} // namespace obscura::renderer
