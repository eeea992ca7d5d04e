// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/lunar_lambert.hpp"

#include "core/math/vector_functions.hpp"

#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(LunarLambertParameters& p) {
    return {
        config::key("albedo", &p.albedo)
            .range(0, 1)
            .required()
            .help("Albedo A, the factor of both parts of the lunar-Lambert law: the normal albedo"),
        scene::image_or(
            config::key("weight", config::Numbers{p.weight.data(), p.weight.size()})
                .range(-1e6, 1e6)
                .help(
                    "Weight L(g) of the Lommel-Seeliger part: coefficients of the phase angle in degrees, constant term first; "
                    "the Moon's by default")),
    };
}

namespace {

[[gnu::always_inline]] inline double mixed(double scale, double mu0, double mu, double l) {
    l = l < 0 ? 0 : l;
    l = l > 1 ? 1 : l;
    const double value = scale * mu0 * (2 * l / (mu0 + mu) + (1 - l));
    return mu0 > 0 ? value : 0.0;
}

} // namespace

void LunarLambert::reflectance(const ScatterPacket& s, Doubles& r) const {
    s.varied != nullptr ? evaluate_varied(s, r) : evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void LunarLambert::evaluate(const ScatterPacket& s, Doubles& r) const {
    const double scale = d_.albedo * std::numbers::inv_pi;
    for (int i = 0; i < packet_size; ++i) {
        const double g = vector_acos(s.cos_phase[i]) * (180 * std::numbers::inv_pi);
        const double l = d_.weight[0] + g * (d_.weight[1] + g * (d_.weight[2] + g * d_.weight[3]));
        r[i] = mixed(scale, s.cos_in[i], s.cos_out[i], l);
    }
}

OBSCURA_VECTOR_CLONES void LunarLambert::evaluate_varied(const ScatterPacket& s, Doubles& r) const {
    const double scale = d_.albedo * std::numbers::inv_pi;
    for (int i = 0; i < packet_size; ++i)
        r[i] = mixed(scale, s.cos_in[i], s.cos_out[i], s.varied->value[0][i]);
}

} // namespace obscura::renderer
