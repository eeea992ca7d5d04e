#include "renderer/minnaert.hpp"

#include "renderer/vector_functions.hpp"

#include <numbers>

namespace obscura::renderer {

void Minnaert::reflectance(const ScatterPacket& s, Doubles& r) const {
    evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Minnaert::evaluate(const ScatterPacket& s, Doubles& r) const {
    const double scale = d_.albedo * std::numbers::inv_pi;
    constexpr double least = 1e-12; // keeps the logarithm finite; the light there is below any detector
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i] > least ? s.cos_in[i] : least;
        const double mu = s.cos_out[i] > least ? s.cos_out[i] : least;
        const double value = scale * mu0 * vector_pow(mu0 * mu, d_.exponent - 1);
        r[i] = s.cos_in[i] > 0 ? value : 0.0;
    }
}

} // namespace obscura::renderer
