#include "renderer/hapke.hpp"

#include "renderer/vector_functions.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Below this the surface is smooth for every purpose, and the cotangent would overflow.
constexpr double least_roughness_rad = 1e-4;

inline double clamp(double x, double least, double most) {
    x = x < least ? least : x;
    return x > most ? most : x;
}

/// sqrt that the vectoriser knows as one instruction (std::sqrt may set errno).
inline double root(double x) {
    return __builtin_sqrt(x > 0 ? x : 0.0);
}

} // namespace

Hapke::Hapke(const scene::Hapke& d) : d_(d) {
    const double filling = 1.209 * std::cbrt(d.filling_factor * d.filling_factor);
    porosity_factor_ = filling > 1e-9 ? -std::log1p(-filling) / filling : 1.0;
    const double gamma = std::sqrt(1 - d.single_scattering_albedo);
    r0_ = (1 - gamma) / (1 + gamma);
    rough_ = d.roughness_rad > least_roughness_rad;
    tan_roughness_ = rough_ ? std::tan(d.roughness_rad) : 0.0;
    cot_roughness_ = rough_ ? 1 / tan_roughness_ : 0.0;
    chi_ = 1 / std::sqrt(1 + std::numbers::pi * tan_roughness_ * tan_roughness_);
}

void Hapke::reflectance(const ScatterPacket& s, Doubles& r) const {
    evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Hapke::evaluate(const ScatterPacket& s, Doubles& r) const {
    constexpr double inv_pi = std::numbers::inv_pi;
    const double w = d_.single_scattering_albedo;
    const double k = porosity_factor_;
    Doubles mu0e;
    Doubles mue;
    Doubles shadowing;

    if (rough_) {
        const double tan_t = tan_roughness_;
        const double e1_scale = -2 * inv_pi * cot_roughness_;
        const double e2_scale = -inv_pi * cot_roughness_ * cot_roughness_;
        // Several short loops: each vectorises, and none runs out of registers.
        Doubles ci;
        Doubles ce;
        Doubles cot_i;
        Doubles cot_e;
        Doubles cos_psi;
        Doubles psi_over_pi;
        Doubles f;
        for (int i = 0; i < packet_size; ++i) {
            // Grazing within 1e-5 is as good as grazing, and keeps every quotient finite.
            ci[i] = clamp(s.cos_in[i], 1e-5, 1);
            ce[i] = clamp(s.cos_out[i], 1e-5, 1);
            const double si = root(1 - ci[i] * ci[i]);
            const double se = root(1 - ce[i] * ce[i]);
            cot_i[i] = ci[i] / clamp(si, 1e-12, 1);
            cot_e[i] = ce[i] / clamp(se, 1e-12, 1);
            // Azimuth between the planes of incidence and emission, from the phase angle. With the Sun or the
            // viewer in the zenith there is none: the added tiny number makes it 0.
            const double sines = si * se;
            cos_psi[i] = clamp((s.cos_phase[i] - ci[i] * ce[i] + 1e-12) / (sines + 1e-12), -1, 1);
        }
        for (int i = 0; i < packet_size; ++i)
            psi_over_pi[i] = vector_acos(cos_psi[i]) * inv_pi;
        for (int i = 0; i < packet_size; ++i)
            f[i] = vector_exp(-2 * root((1 - cos_psi[i]) / (1 + cos_psi[i] + 1e-300)));
        Doubles e1_i;
        Doubles e1_e;
        Doubles e2_i;
        Doubles e2_e;
        for (int i = 0; i < packet_size; ++i)
            e1_i[i] = vector_exp(e1_scale * cot_i[i]);
        for (int i = 0; i < packet_size; ++i)
            e1_e[i] = vector_exp(e1_scale * cot_e[i]);
        for (int i = 0; i < packet_size; ++i)
            e2_i[i] = vector_exp(e2_scale * cot_i[i] * cot_i[i]);
        for (int i = 0; i < packet_size; ++i)
            e2_e[i] = vector_exp(e2_scale * cot_e[i] * cot_e[i]);
        for (int i = 0; i < packet_size; ++i) {
            const double si_tan = root(1 - ci[i] * ci[i]) * tan_t;
            const double se_tan = root(1 - ce[i] * ce[i]) * tan_t;
            const double eta_i = chi_ * (ci[i] + si_tan * e2_i[i] / (2 - e1_i[i]));
            const double eta_e = chi_ * (ce[i] + se_tan * e2_e[i] / (2 - e1_e[i]));
            const double sin2_half = 0.5 * (1 - cos_psi[i]);

            // The two cases i <= e and e <= i are one formula with the roles exchanged: "low" is the larger
            // angle.
            const bool i_first = ci[i] >= ce[i];
            const double e1_low = i_first ? e1_e[i] : e1_i[i];
            const double e2_low = i_first ? e2_e[i] : e2_i[i];
            const double e1_high = i_first ? e1_i[i] : e1_e[i];
            const double e2_high = i_first ? e2_i[i] : e2_e[i];
            const double inv = 1 / (2 - e1_low - psi_over_pi[i] * e1_high);
            const double near = (cos_psi[i] * e2_low + sin2_half * e2_high) * inv;
            const double far = (e2_low - sin2_half * e2_high) * inv;
            const double in_share = i_first ? near : far;
            const double out_share = i_first ? far : near;
            const double lit_i = ci[i] / eta_i;
            const double lit_e = ce[i] / eta_e;
            const double lit_high = i_first ? lit_i : lit_e;
            mu0e[i] = chi_ * (ci[i] + si_tan * in_share);
            mue[i] = chi_ * (ce[i] + se_tan * out_share);
            shadowing[i] = mue[i] / eta_e * lit_i * chi_ / (1 - f[i] + f[i] * chi_ * lit_high);
        }
    } else {
        for (int i = 0; i < packet_size; ++i) {
            mu0e[i] = s.cos_in[i] > 1e-12 ? s.cos_in[i] : 1e-12;
            mue[i] = s.cos_out[i] > 1e-12 ? s.cos_out[i] : 1e-12;
            shadowing[i] = 1;
        }
    }

    const double b = d_.phase_b;
    const double back = 0.5 * (1 + d_.phase_c) * (1 - b * b);
    const double forward = 0.5 * (1 - d_.phase_c) * (1 - b * b);
    const double scale = k * w * inv_pi / 4;
    for (int i = 0; i < packet_size; ++i) {
        double cos_g = s.cos_phase[i];
        cos_g = cos_g < -1 ? -1.0 : cos_g;
        cos_g = cos_g > 1 ? 1.0 : cos_g;
        const double tan_half_g = root((1 - cos_g) / (1 + cos_g + 1e-300));
        const double q_back = 1 - 2 * b * cos_g + b * b;
        const double q_forward = 1 + 2 * b * cos_g + b * b;
        const double p = back / (q_back * root(q_back)) + forward / (q_forward * root(q_forward));
        const double surge = 1 + d_.shadow_hiding_b0 / (1 + tan_half_g / d_.shadow_hiding_h);
        const double z = tan_half_g / d_.backscatter_h;
        // (1 - e^-z) / z by its series where the quotient would cancel.
        const double quotient = z > 1e-4 ? (1 - vector_exp(-z)) / (z > 1e-4 ? z : 1.0) : 1 - z / 2;
        const double coherent = 1 + d_.backscatter_b0 * (1 + quotient) / (2 * (1 + z) * (1 + z));

        const double x0 = mu0e[i] / k;
        const double x = mue[i] / k;
        const double h0 = 1 / (1 - w * x0 * (r0_ + 0.5 * (1 - 2 * r0_ * x0) * vector_log((1 + x0) / x0)));
        const double h = 1 / (1 - w * x * (r0_ + 0.5 * (1 - 2 * r0_ * x) * vector_log((1 + x) / x)));
        const double value =
            scale * mu0e[i] / (mu0e[i] + mue[i]) * (p * surge + h0 * h - 1) * coherent * shadowing[i];
        r[i] = s.cos_in[i] > 0 ? value : 0.0;
    }
}

} // namespace obscura::renderer
