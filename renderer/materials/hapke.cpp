// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/hapke.hpp"

#include "core/math/vector_functions.hpp"
#include "core/units.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(HapkeParameters& p) {
    return {
        scene::image_or(config::key("single_scattering_albedo", &p.single_scattering_albedo)
                            .range(0, 0.9999)
                            .required()
                            .help("Single-scattering albedo of the particles, w")),
        scene::image_or(
            config::key("phase_b", &p.phase_b)
                .range(0, 0.95)
                .help("Asymmetry b of both lobes of the Henyey-Greenstein phase function; 0: isotropic")),
        scene::image_or(
            config::key("phase_c", &p.phase_c)
                .range(-1, 1)
                .help("Balance c of the two Henyey-Greenstein lobes; 1: all backwards, -1: all forwards")),
        scene::image_or(config::key("shadow_hiding_b0", &p.shadow_hiding_b0)
                            .range(0, 10)
                            .help("Amplitude of the shadow-hiding opposition surge, Bs0; 0: no surge")),
        scene::image_or(config::key("shadow_hiding_h", &p.shadow_hiding_h)
                            .range(1e-6, 10)
                            .help("Angular width of the shadow-hiding opposition surge, hs")),
        scene::image_or(config::key("backscatter_b0", &p.backscatter_b0)
                            .range(0, 10)
                            .help("Amplitude of the coherent-backscatter surge, Bc0; 0: no surge")),
        scene::image_or(config::key("backscatter_h", &p.backscatter_h)
                            .range(1e-6, 10)
                            .help("Angular width of the coherent-backscatter surge, hc")),
        scene::image_or(config::key("roughness_deg", config::Scaled{&p.roughness_rad, degree})
                            .unit("deg")
                            .range(0, 45)
                            .help("Mean slope angle of the macroscopic roughness, theta-bar; 0: smooth")),
        scene::image_or(
            config::key("filling_factor", &p.filling_factor)
                .range(0, 0.74) // densest packing of equal spheres
                .help("Fraction of the volume filled by particles, phi; 0: no porosity correction")),
    };
}

namespace {

/// Below this the surface counts as smooth; the cotangent would overflow.
constexpr double min_roughness_rad = 1e-4;

inline double clamp(double x, double least, double most) {
    x = x < least ? least : x;
    return x > most ? most : x;
}

/// sqrt that vectorises to one instruction (std::sqrt may set errno).
inline double root(double x) {
    return __builtin_sqrt(x > 0 ? x : 0.0);
}

/// Terms of the law; Value is a number that is the same in all lanes, or one for each.
template<typename Value>
struct Terms {
    Value w, phase_b, phase_c, shadow_hiding_b0, shadow_hiding_h, backscatter_b0, backscatter_h;
    Value tan_roughness, cot_roughness, chi;
    Value porosity_factor, r0;
};

double porosity_factor(double filling_factor) {
    const double filling = 1.209 * std::cbrt(filling_factor * filling_factor);
    return filling > 1e-9 ? -std::log1p(-filling) / filling : 1.0;
}
double diffusive_reflectance(double w) {
    const double gamma = std::sqrt(1 - w);
    return (1 - gamma) / (1 + gamma);
}

template<typename Value>
[[gnu::always_inline]] inline void loops(const ScatterPacket& s, const Terms<Value>& p, bool rough,
                                         Doubles& r) {
    constexpr double inv_pi = std::numbers::inv_pi;
    // Divisions cost most here: keep numerators and denominators apart, divide once at the end.
    Doubles mu0e;
    Doubles mue;
    Doubles over; // mu0e / (mu0e + mue) times the shadowing function, as a quotient
    Doubles under;

    if (rough) {
        // Several short loops: each vectorises without running out of registers.
        Doubles ci;
        Doubles ce;
        Doubles si_tan;
        Doubles se_tan;
        Doubles cot_i;
        Doubles cot_e;
        Doubles cos_psi;
        Doubles psi_over_pi;
        Doubles f;
        for (int i = 0; i < packet_size; ++i) {
            // Clamp at 1e-5, which looks the same as grazing and keeps every quotient finite.
            ci[i] = clamp(s.cos_in[i], 1e-5, 1);
            ce[i] = clamp(s.cos_out[i], 1e-5, 1);
            const double si = root(1 - ci[i] * ci[i]);
            const double se = root(1 - ce[i] * ce[i]);
            si_tan[i] = si * p.tan_roughness[i];
            se_tan[i] = se * p.tan_roughness[i];
            // Azimuth between the planes of incidence and emission, from the phase angle. It is undefined
            // with the Sun or the viewer in the zenith, and does not matter: sines that are not 0 keep the
            // cotangents right.
            const double sine_i = si > 1e-6 ? si : 1e-6, sine_e = se > 1e-6 ? se : 1e-6;
            const double inverse = 1 / (sine_i * sine_e);
            cot_i[i] = clamp(ci[i] * sine_e * inverse, si > 1e-5 ? 0 : 1e5, 1e12);
            cot_e[i] = clamp(ce[i] * sine_i * inverse, se > 1e-5 ? 0 : 1e5, 1e12);
            cos_psi[i] = clamp((s.cos_phase[i] - ci[i] * ce[i] + 1e-12) * inverse, -1, 1);
        }
        for (int i = 0; i < packet_size; ++i)
            psi_over_pi[i] = quick_acos(cos_psi[i]) * inv_pi;
        for (int i = 0; i < packet_size; ++i)
            f[i] = quick_exp(-2 * root((1 - cos_psi[i]) / (1 + cos_psi[i] + 1e-300)));
        Doubles e1_i;
        Doubles e1_e;
        Doubles e2_i;
        Doubles e2_e;
        for (int i = 0; i < packet_size; ++i)
            e1_i[i] = quick_exp(-2 * inv_pi * p.cot_roughness[i] * cot_i[i]);
        for (int i = 0; i < packet_size; ++i)
            e1_e[i] = quick_exp(-2 * inv_pi * p.cot_roughness[i] * cot_e[i]);
        for (int i = 0; i < packet_size; ++i)
            e2_i[i] = quick_exp(-inv_pi * p.cot_roughness[i] * p.cot_roughness[i] * cot_i[i] * cot_i[i]);
        for (int i = 0; i < packet_size; ++i)
            e2_e[i] = quick_exp(-inv_pi * p.cot_roughness[i] * p.cot_roughness[i] * cot_e[i] * cot_e[i]);
        for (int i = 0; i < packet_size; ++i) {
            const double sin2_half = 0.5 * (1 - cos_psi[i]);
            // The two cases i <= e and e <= i are one formula with the roles exchanged: "low" is the larger
            // angle.
            const bool i_first = ci[i] >= ce[i];
            const double e1_low = i_first ? e1_e[i] : e1_i[i];
            const double e2_low = i_first ? e2_e[i] : e2_i[i];
            const double e1_high = i_first ? e1_i[i] : e1_e[i];
            const double e2_high = i_first ? e2_i[i] : e2_e[i];
            const double n = 2 - e1_low - psi_over_pi[i] * e1_high;
            const double near = cos_psi[i] * e2_low + sin2_half * e2_high;
            const double far = e2_low - sin2_half * e2_high;
            // Effective cosines times n / chi.
            const double m_i = ci[i] * n + si_tan[i] * (i_first ? near : far);
            const double m_e = ce[i] * n + se_tan[i] * (i_first ? far : near);
            // cos / eta is a / (chi b).
            const double a_i = ci[i] * (2 - e1_i[i]);
            const double a_e = ce[i] * (2 - e1_e[i]);
            const double b_i = a_i + si_tan[i] * e2_i[i];
            const double b_e = a_e + se_tan[i] * e2_e[i];
            const double a_high = i_first ? a_i : a_e;
            const double b_high = i_first ? b_i : b_e;
            const double b_low = i_first ? b_e : b_i;
            const double scale = p.chi[i] / n;
            mu0e[i] = m_i * scale;
            mue[i] = m_e * scale;
            over[i] = m_i * m_e * (2 - e1_e[i]) * a_i;
            under[i] = (m_i + m_e) * n * b_low * (b_high - f[i] * (b_high - a_high));
        }
    } else {
        for (int i = 0; i < packet_size; ++i) {
            mu0e[i] = s.cos_in[i] > 1e-12 ? s.cos_in[i] : 1e-12;
            mue[i] = s.cos_out[i] > 1e-12 ? s.cos_out[i] : 1e-12;
            over[i] = mu0e[i];
            under[i] = mu0e[i] + mue[i];
        }
    }

    Doubles tan_half_g;
    Doubles exp_z;
    for (int i = 0; i < packet_size; ++i) {
        const double cos_g = clamp(s.cos_phase[i], -1, 1);
        // Beyond 1e6 the surges are negligible, and products would overflow.
        tan_half_g[i] = clamp(root((1 - cos_g) / (1 + cos_g + 1e-300)), 0, 1e6);
    }
    for (int i = 0; i < packet_size; ++i)
        exp_z[i] = quick_exp(-tan_half_g[i] * (1 / p.backscatter_h[i]));
    Doubles d0;
    Doubles d;
    for (int i = 0; i < packet_size; ++i) {
        const double x = mu0e[i] * (1 / p.porosity_factor[i]);
        d0[i] = 1 - p.w[i] * x * (p.r0[i] + 0.5 * (1 - 2 * p.r0[i] * x) * quick_log_1_plus_inverse(x));
    }
    for (int i = 0; i < packet_size; ++i) {
        const double x = mue[i] * (1 / p.porosity_factor[i]);
        d[i] = 1 - p.w[i] * x * (p.r0[i] + 0.5 * (1 - 2 * p.r0[i] * x) * quick_log_1_plus_inverse(x));
    }
    for (int i = 0; i < packet_size; ++i) {
        const double b = p.phase_b[i];
        const double back = 0.5 * (1 + p.phase_c[i]) * (1 - b * b);
        const double forward = 0.5 * (1 - p.phase_c[i]) * (1 - b * b);
        const double scale = p.porosity_factor[i] * p.w[i] * inv_pi / 4;
        const double hiding_h = p.shadow_hiding_h[i];
        const double hiding_sum = hiding_h * (1 + p.shadow_hiding_b0[i]);
        const double back_b0 = p.backscatter_b0[i];
        const double cos_g = clamp(s.cos_phase[i], -1, 1);
        const double q_back = 1 - 2 * b * cos_g + b * b;
        const double q_forward = 1 + 2 * b * cos_g + b * b;
        const double back3 = q_back * root(q_back);
        const double forward3 = q_forward * root(q_forward);
        // Phase function with the shadow-hiding surge: (1 + B0 h / (h + tan)) p.
        const double p_over = (back * forward3 + forward * back3) * (hiding_sum + tan_half_g[i]);
        const double p_under = back3 * forward3 * (hiding_h + tan_half_g[i]);
        // Coherent backscatter 1 + B0 [1 + (1 - e^-z)/z] / 2 (1 + z)^2; the series of (1 - e^-z)/z where the
        // quotient would cancel.
        const double z = tan_half_g[i] * (1 / p.backscatter_h[i]);
        const bool small = z < 1e-3;
        const double c_over = back_b0 * (small ? 2 - z / 2 + z * z / 6 : z + 1 - exp_z[i]);
        const double c_under = 2 * (1 + z) * (1 + z) * (small ? 1 : z);
        const double h_under = d0[i] * d[i];
        const double multiple = p_over * h_under + p_under * (1 - h_under); // p S + H H - 1, over p_under h
        const double value =
            scale * over[i] * multiple * (c_under + c_over) / (under[i] * p_under * h_under * c_under);
        r[i] = s.cos_in[i] > 0 ? value : 0.0;
    }
}

} // namespace

Hapke::Hapke(const HapkeParameters& d) : d_(d) {
    porosity_factor_ = porosity_factor(d.filling_factor);
    r0_ = diffusive_reflectance(d.single_scattering_albedo);
    rough_ = d.roughness_rad > min_roughness_rad;
    tan_roughness_ = rough_ ? std::tan(d.roughness_rad) : 0.0;
    cot_roughness_ = rough_ ? 1 / tan_roughness_ : 0.0;
    chi_ = 1 / std::sqrt(1 + std::numbers::pi * tan_roughness_ * tan_roughness_);
}

void Hapke::reflectance(const ScatterPacket& s, Doubles& r) const {
    s.varied != nullptr ? evaluate_varied(s, r) : evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void Hapke::evaluate(const ScatterPacket& s, Doubles& r) const {
    const Terms<SameInAllLanes> terms{{d_.single_scattering_albedo},
                                      {d_.phase_b},
                                      {d_.phase_c},
                                      {d_.shadow_hiding_b0},
                                      {d_.shadow_hiding_h},
                                      {d_.backscatter_b0},
                                      {d_.backscatter_h},
                                      {tan_roughness_},
                                      {cot_roughness_},
                                      {chi_},
                                      {porosity_factor_},
                                      {r0_}};
    loops(s, terms, rough_, r);
}

OBSCURA_VECTOR_CLONES void Hapke::evaluate_varied(const ScatterPacket& s, Doubles& r) const {
    const Doubles* const v = s.varied->value;
    Terms<Doubles> terms{v[0], v[1], v[2], v[3], v[4], v[5], v[6], {}, {}, {}, {}, {}};
    bool rough = false;
    for (int i = 0; i < packet_size; ++i) {
        // Smooth lanes beside rough ones get the least roughness, which looks smooth.
        const double slope = v[7][i] > min_roughness_rad ? v[7][i] : min_roughness_rad;
        rough = rough || v[7][i] > min_roughness_rad;
        terms.tan_roughness[i] = slope == d_.roughness_rad && rough_ ? tan_roughness_ : std::tan(slope);
        terms.cot_roughness[i] = 1 / terms.tan_roughness[i];
        terms.chi[i] = 1 / root(1 + std::numbers::pi * terms.tan_roughness[i] * terms.tan_roughness[i]);
        terms.r0[i] = diffusive_reflectance(v[0][i]);
        terms.porosity_factor[i] = v[8][i] == d_.filling_factor ? porosity_factor_ : porosity_factor(v[8][i]);
    }
    loops(s, terms, rough, r);
}

} // namespace obscura::renderer
