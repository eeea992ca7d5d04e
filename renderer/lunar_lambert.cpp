#include "renderer/lunar_lambert.hpp"

#include "renderer/vector_functions.hpp"

#include <numbers>

namespace obscura::renderer {

void LunarLambert::reflectance(const ScatterPacket& s, Doubles& r) const {
    evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void LunarLambert::evaluate(const ScatterPacket& s, Doubles& r) const {
    const double scale = d_.albedo * std::numbers::inv_pi;
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i];
        const double g = vector_acos(s.cos_phase[i]) * (180 * std::numbers::inv_pi);
        double l = d_.weight[0] + g * (d_.weight[1] + g * (d_.weight[2] + g * d_.weight[3]));
        l = l < 0 ? 0 : l;
        l = l > 1 ? 1 : l;
        const double value = scale * mu0 * (2 * l / (mu0 + s.cos_out[i]) + (1 - l));
        r[i] = mu0 > 0 ? value : 0.0;
    }
}

} // namespace obscura::renderer
