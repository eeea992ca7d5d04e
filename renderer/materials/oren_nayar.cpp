// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/oren_nayar.hpp"

#include "core/units.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(OrenNayarParameters& p) {
    return {
        config::key("albedo", &p.albedo)
            .range(0, 1)
            .required()
            .help("Albedo of the facets; the normal albedo is less, by the slopes"),
        scene::image_or(config::key("slope_deg", config::Scaled{&p.slope_rad, degree})
                            .unit("deg")
                            .range(0, 57.3) // 1 rad, as far as the fit was made for
                            .help("Standard deviation of the slope angle of the facets; 0: Lambert's law")),
    };
}

namespace {

double scale_a(double s2) {
    return 1 - 0.5 * s2 / (s2 + 0.33);
}
double scale_b(double s2) {
    return 0.45 * s2 / (s2 + 0.09);
}

template<typename Parameter>
[[gnu::always_inline]] inline void oren_nayar_loop(const ScatterPacket& s, double scale, const Parameter& a,
                                                   const Parameter& b, Doubles& r) {
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i];
        const double mu = s.cos_out[i];
        // sin(i) sin(e) cos(phi) needs no azimuth; sin(alpha) tan(beta) is sin(i) sin(e) over the larger
        // cosine.
        const double in_plane = s.cos_phase[i] - mu0 * mu;
        const double larger = mu0 > mu ? mu0 : mu;
        const double lobe = in_plane > 0 && larger > 0 ? in_plane / larger : 0.0;
        const double value = scale * mu0 * (a[i] + b[i] * lobe);
        r[i] = mu0 > 0 ? value : 0.0;
    }
}

} // namespace

OrenNayar::OrenNayar(const OrenNayarParameters& d) : scale_(d.albedo * std::numbers::inv_pi) {
    const double s2 = d.slope_rad * d.slope_rad;
    a_ = scale_a(s2);
    b_ = scale_b(s2);
}

void OrenNayar::reflectance(const ScatterPacket& s, Doubles& r) const {
    s.varied != nullptr ? evaluate_varied(s, r) : evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void OrenNayar::evaluate(const ScatterPacket& s, Doubles& r) const {
    oren_nayar_loop(s, scale_, SameInAllLanes{a_}, SameInAllLanes{b_}, r);
}

OBSCURA_VECTOR_CLONES void OrenNayar::evaluate_varied(const ScatterPacket& s, Doubles& r) const {
    const Doubles& slope = s.varied->value[0];
    Doubles a;
    Doubles b;
    for (int i = 0; i < packet_size; ++i) {
        const double s2 = slope[i] * slope[i];
        a[i] = scale_a(s2);
        b[i] = scale_b(s2);
    }
    oren_nayar_loop(s, scale_, a, b, r);
}

} // namespace obscura::renderer
