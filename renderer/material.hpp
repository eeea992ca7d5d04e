// The one interface of everything that scatters light.
#pragma once

#include "core/scene.hpp"
#include "renderer/packet.hpp"

#include <memory>

namespace obscura::renderer {

/// Light falling on a surface and leaving it, lane by lane.
struct ScatterPacket {
    Doubles cos_in;    ///< mu0, cosine of the angle of incidence; <= 0: unlit
    Doubles cos_out;   ///< mu, cosine of the angle of emission; > 0
    Doubles cos_phase; ///< cosine of the angle between the directions to the light and to the viewer
};

/// A scattering law. Immutable; any thread may call any member.
class Material {
public:
    virtual ~Material() = default;

    /// Bidirectional reflectance r = f cos_in (Hapke's r; radiance per collimated irradiance normal to the
    /// beam), per steradian. 0 where cos_in <= 0.
    virtual void reflectance(const ScatterPacket& s, Doubles& r) const = 0;
};

/// The registry: one line per scattering law. Throws ConfigError naming `place`.
[[nodiscard]] std::unique_ptr<Material> make_material(const scene::Material& description,
                                                      const std::string& place);

} // namespace obscura::renderer
