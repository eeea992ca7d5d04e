// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/phong.hpp"

#include "core/math/vector_functions.hpp"
#include "renderer/materials/hemisphere.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(PhongParameters& p) {
    return {
        scene::image_or(config::key("diffuse", &p.diffuse)
                            .range(0, 1)
                            .help("Diffuse reflectance; together with the specular one at most 1")),
        scene::image_or(config::key("specular", &p.specular)
                            .range(0, 1)
                            .help("Specular reflectance; together with the diffuse one at most 1")),
        scene::image_or(config::key("exponent", &p.exponent)
                            .range(0, 1e5)
                            .help("Sharpness of the highlight: exponent of the cosine")),
    };
}

std::vector<scene::Conflict> conflicts_in(const PhongParameters& p) {
    if (p.specular <= 1 - p.diffuse) return {};
    return {{"specular",
             fmt::format("{}: allowed 0 to {} beside the diffuse reflectance", p.specular, 1 - p.diffuse)}};
}

namespace {

template<typename Parameter>
[[gnu::always_inline]] inline void phong_loop(const ScatterPacket& s, const Parameter& kd,
                                              const Parameter& ks, const Parameter& exponent, Doubles& r) {
    for (int i = 0; i < packet_size; ++i) {
        const double diffuse = kd[i] * std::numbers::inv_pi;
        const double specular = ks[i] * (exponent[i] + 2) * std::numbers::inv_pi / 2;
        const double mu0 = s.cos_in[i];
        const double cos_delta = 2 * mu0 * s.cos_out[i] - s.cos_phase[i];
        const double lobe =
            cos_delta > 1e-30 ? vector_pow(cos_delta > 1e-30 ? cos_delta : 1.0, exponent[i]) : 0.0;
        const double value = mu0 * (diffuse + specular * lobe);
        r[i] = mu0 > 0 ? value : 0.0;
    }
}

double diffuse_share(const PhongParameters& d) {
    const double sum = d.diffuse + d.specular;
    return sum > 0 ? d.diffuse / sum : 1.0;
}

PhongParameters at_lane(const ParameterPacket& varied, int lane) {
    return {varied.value[0][lane], varied.value[1][lane], varied.value[2][lane]};
}

} // namespace

void Phong::reflectance(const ScatterPacket& s, Doubles& r) const {
    s.varied != nullptr ? evaluate_varied(s, r) : evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Phong::evaluate(const ScatterPacket& s, Doubles& r) const {
    phong_loop(s, SameInAllLanes{d_.diffuse}, SameInAllLanes{d_.specular}, SameInAllLanes{d_.exponent}, r);
}

OBSCURA_VECTOR_CLONES void Phong::evaluate_varied(const ScatterPacket& s, Doubles& r) const {
    phong_loop(s, s.varied->value[0], s.varied->value[1], s.varied->value[2], r);
}

Vec3 Phong::sample(Vec3 out, double u, double v) const {
    const double share = diffuse_share(d_);
    if (u < share) return cosine_hemisphere(u / share, v);
    u = (u - share) / (1 - share);
    const double cos_delta = vector_pow(1 - u, 1 / (d_.exponent + 1));
    return around({-out.x, -out.y, out.z}, cos_delta, v);
}

double Phong::pdf(Vec3 out, Vec3 in) const {
    if (in.z <= 0) return 0;
    const double share = diffuse_share(d_);
    const double cos_delta = 2 * in.z * out.z - dot(in, out);
    const double lobe = cos_delta > 0 ? (d_.exponent + 1) * std::numbers::inv_pi / 2 *
                                            vector_pow(cos_delta > 1e-30 ? cos_delta : 1e-30, d_.exponent)
                                      : 0.0;
    return share * in.z * std::numbers::inv_pi + (1 - share) * lobe;
}

Vec3 Phong::sample_varied(const ParameterPacket& varied, int lane, Vec3 out, double u, double v) const {
    return Phong(at_lane(varied, lane)).sample(out, u, v);
}

double Phong::pdf_varied(const ParameterPacket& varied, int lane, Vec3 out, Vec3 in) const {
    return Phong(at_lane(varied, lane)).pdf(out, in);
}

} // namespace obscura::renderer
