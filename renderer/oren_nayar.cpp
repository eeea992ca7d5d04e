#include "renderer/oren_nayar.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {

OrenNayar::OrenNayar(const scene::OrenNayar& d) : scale_(d.albedo * std::numbers::inv_pi) {
    const double s2 = d.slope_rad * d.slope_rad;
    a_ = 1 - 0.5 * s2 / (s2 + 0.33);
    b_ = 0.45 * s2 / (s2 + 0.09);
}

void OrenNayar::reflectance(const ScatterPacket& s, Doubles& r) const {
    evaluate(s, r);
}

OBSCURA_VECTOR_CLONES void OrenNayar::evaluate(const ScatterPacket& s, Doubles& r) const {
    for (int i = 0; i < packet_size; ++i) {
        const double mu0 = s.cos_in[i];
        const double mu = s.cos_out[i];
        // sin(i) sin(e) cos(phi) needs no azimuth; sin(alpha) tan(beta) is sin(i) sin(e) over the larger
        // cosine.
        const double in_plane = s.cos_phase[i] - mu0 * mu;
        const double larger = mu0 > mu ? mu0 : mu;
        const double lobe = in_plane > 0 && larger > 0 ? in_plane / larger : 0.0;
        const double value = scale_ * mu0 * (a_ + b_ * lobe);
        r[i] = mu0 > 0 ? value : 0.0;
    }
}

} // namespace obscura::renderer
