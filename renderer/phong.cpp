#include "renderer/phong.hpp"

#include "renderer/hemisphere.hpp"
#include "renderer/vector_functions.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {

void Phong::reflectance(const ScatterPacket& s, Doubles& r) const {
    evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Phong::evaluate(const ScatterPacket& s, Doubles& r) const {
    const double diffuse = d_.diffuse * std::numbers::inv_pi;
    const double specular = d_.specular * (d_.exponent + 2) * std::numbers::inv_pi / 2;
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i];
        const double cos_delta = 2 * mu0 * s.cos_out[i] - s.cos_phase[i];
        const double lobe =
            cos_delta > 1e-30 ? vector_pow(cos_delta > 1e-30 ? cos_delta : 1.0, d_.exponent) : 0.0;
        const double value = mu0 * (diffuse + specular * lobe);
        r[i] = mu0 > 0 ? value : 0.0;
    }
}

double Phong::diffuse_share() const {
    const double sum = d_.diffuse + d_.specular;
    return sum > 0 ? d_.diffuse / sum : 1.0;
}

Vec3 Phong::sample(Vec3 out, double u, double v) const {
    const double share = diffuse_share();
    if (u < share) return cosine_hemisphere(u / share, v);
    u = (u - share) / (1 - share);
    const double cos_delta = vector_pow(1 - u, 1 / (d_.exponent + 1));
    return around({-out.x, -out.y, out.z}, cos_delta, v);
}

double Phong::pdf(Vec3 out, Vec3 in) const {
    if (in.z <= 0) return 0;
    const double share = diffuse_share();
    const double cos_delta = 2 * in.z * out.z - dot(in, out);
    const double lobe = cos_delta > 0 ? (d_.exponent + 1) * std::numbers::inv_pi / 2 *
                                            vector_pow(cos_delta > 1e-30 ? cos_delta : 1e-30, d_.exponent)
                                      : 0.0;
    return share * in.z * std::numbers::inv_pi + (1 - share) * lobe;
}

} // namespace obscura::renderer
