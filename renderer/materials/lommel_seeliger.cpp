#include "renderer/materials/lommel_seeliger.hpp"

#include <numbers>

namespace obscura::renderer {

void LommelSeeliger::reflectance(const ScatterPacket& s, Doubles& r) const {
    const double scale = albedo_ * std::numbers::inv_pi / 4;
    for (int i = 0; i < packet_size; ++i)
        r[i] = s.cos_in[i] > 0 ? scale * s.cos_in[i] / (s.cos_in[i] + s.cos_out[i]) : 0.0;
}

} // namespace obscura::renderer
