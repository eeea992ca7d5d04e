#include "renderer/materials/mirror.hpp"

namespace obscura::renderer {

void Mirror::reflectance(const ScatterPacket& /*s*/, Doubles& r) const {
    for (int i = 0; i < packet_size; ++i)
        r[i] = 0;
}

} // namespace obscura::renderer
