// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/ggx.hpp"

#include "renderer/materials/hemisphere.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(GgxParameters& p) {
    return {
        scene::image_or(config::key("roughness", &p.roughness)
                            .range(0, 1)
                            .help("Perceptual roughness of the microfacets; alpha of GGX is its square")),
        scene::image_or(config::key("reflectance_f0", &p.reflectance_f0)
                            .range(0, 1)
                            .help("Fresnel reflectance at normal incidence, F0")),
        scene::image_or(config::key("base_albedo", &p.base_albedo)
                            .range(0, 1)
                            .help("Albedo of the diffuse base under a dielectric; 0: metal, without a base")),
    };
}

namespace {

constexpr double min_alpha = 1e-4;

inline double fifth_power(double x) {
    const double x2 = x * x;
    return x2 * x2 * x;
}

/// Smith's Lambda for GGX at cosine c.
inline double smith_lambda(double c, double alpha2) {
    const double tan2 = (1 - c * c) / (c * c);
    return 0.5 * (__builtin_sqrt(1 + alpha2 * (tan2 > 0 ? tan2 : 0.0)) - 1);
}

/// Distribution D of the microfacet normals, 1/sr.
inline double ggx_distribution(double cos_h, double alpha2) {
    const double q = cos_h * cos_h * (alpha2 - 1) + 1;
    return alpha2 * std::numbers::inv_pi / (q * q);
}

double alpha_of(double roughness) {
    return std::fmax(roughness * roughness, min_alpha);
}

template<typename Parameter>
[[gnu::always_inline]] inline void ggx_loop(const ScatterPacket& s, const Parameter& alpha,
                                            const Parameter& f0, const Parameter& base_albedo, Doubles& r) {
    for (int i = 0; i < packet_size; ++i) {
        const double alpha2 = alpha[i] * alpha[i];
        const double base = 28.0 / 23.0 * std::numbers::inv_pi * base_albedo[i] * (1 - f0[i]);
        const double mu0 = s.cos_in[i] > 1e-9 ? s.cos_in[i] : 1e-9;
        const double mu = s.cos_out[i] > 1e-9 ? s.cos_out[i] : 1e-9;
        // |in + out|^2 = 2 + 2 cos g; the half vector's cosines follow.
        const double sum2 = 2 + 2 * s.cos_phase[i];
        const double inv = 1 / __builtin_sqrt(sum2 > 1e-18 ? sum2 : 1e-18);
        double cos_h = (mu0 + mu) * inv;
        cos_h = cos_h > 1 ? 1.0 : cos_h;
        const double cos_d = 0.5 / inv;
        const double d = ggx_distribution(cos_h, alpha2);
        const double g2 = 1 / (1 + smith_lambda(mu0, alpha2) + smith_lambda(mu, alpha2));
        const double f = f0[i] + (1 - f0[i]) * fifth_power(1 - (cos_d < 1 ? cos_d : 1.0));
        const double diffuse =
            base * mu0 * (1 - fifth_power(1 - 0.5 * mu0)) * (1 - fifth_power(1 - 0.5 * mu));
        const double value = d * g2 * f / (4 * mu) + diffuse;
        r[i] = s.cos_in[i] > 0 ? value : 0.0;
    }
}

GgxParameters at(const ParameterPacket& varied, int lane) {
    return {varied.value[0][lane], varied.value[1][lane], varied.value[2][lane]};
}

} // namespace

Ggx::Ggx(const GgxParameters& d)
    : alpha_(alpha_of(d.roughness)),
      f0_(d.reflectance_f0),
      base_(d.base_albedo),
      specular_share_(d.base_albedo > 0 ? 0.5 : 1.0) {}

void Ggx::reflectance(const ScatterPacket& s, Doubles& r) const {
    s.varied != nullptr ? evaluate_varied(s, r) : evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Ggx::evaluate(const ScatterPacket& s, Doubles& r) const {
    ggx_loop(s, SameInAllLanes{alpha_}, SameInAllLanes{f0_}, SameInAllLanes{base_}, r);
}

OBSCURA_VECTOR_CLONES void Ggx::evaluate_varied(const ScatterPacket& s, Doubles& r) const {
    Doubles alpha;
    for (int i = 0; i < packet_size; ++i)
        alpha[i] = alpha_of(s.varied->value[0][i]);
    ggx_loop(s, alpha, s.varied->value[1], s.varied->value[2], r);
}

Vec3 Ggx::sample(Vec3 out, double u, double v) const {
    if (u >= specular_share_) return cosine_hemisphere((u - specular_share_) / (1 - specular_share_), v);
    u /= specular_share_;
    // Heitz 2018: stretch, sample the projected half disc, unstretch.
    const Vec3 stretched = normalized(Vec3{alpha_ * out.x, alpha_ * out.y, out.z});
    const double flat = stretched.x * stretched.x + stretched.y * stretched.y;
    const Vec3 t1 = flat > 0 ? Vec3{-stretched.y, stretched.x, 0} / std::sqrt(flat) : Vec3{1, 0, 0};
    const Vec3 t2 = cross(stretched, t1);
    double sine = 0;
    double cosine = 0;
    sincos_turn(v, sine, cosine);
    const double radius = std::sqrt(u);
    const double p1 = radius * cosine;
    const double mix = 0.5 * (1 + stretched.z);
    const double p2 = (1 - mix) * std::sqrt(std::fmax(0.0, 1 - p1 * p1)) + mix * radius * sine;
    const Vec3 h = t1 * p1 + t2 * p2 + stretched * std::sqrt(std::fmax(0.0, 1 - p1 * p1 - p2 * p2));
    const Vec3 normal = normalized(Vec3{alpha_ * h.x, alpha_ * h.y, std::fmax(1e-12, h.z)});
    return normal * (2 * dot(out, normal)) - out;
}

double Ggx::pdf(Vec3 out, Vec3 in) const {
    if (in.z <= 0 || out.z <= 0) return 0;
    const double alpha2 = alpha_ * alpha_;
    const Vec3 h = normalized(in + out);
    const double g1 = 1 / (1 + smith_lambda(out.z, alpha2));
    const double visible = g1 * ggx_distribution(h.z, alpha2) / (4 * out.z);
    return specular_share_ * visible + (1 - specular_share_) * in.z * std::numbers::inv_pi;
}

Vec3 Ggx::sample_varied(const ParameterPacket& varied, int lane, Vec3 out, double u, double v) const {
    return Ggx(at(varied, lane)).sample(out, u, v);
}

double Ggx::pdf_varied(const ParameterPacket& varied, int lane, Vec3 out, Vec3 in) const {
    return Ggx(at(varied, lane)).pdf(out, in);
}

} // namespace obscura::renderer
