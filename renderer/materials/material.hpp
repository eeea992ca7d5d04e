// SPDX-License-Identifier: Apache-2.0
// The one interface of everything that scatters light.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"

#include <cstddef>

namespace obscura::renderer {

/// How many parameters of a law may differ from place to place.
constexpr std::size_t most_parameters = 9;

/// The parameters of a law that images give, lane by lane, in the order in which the law declares them.
struct ParameterPacket {
    Doubles value[most_parameters];
};

/// For a law's inner loop: a parameter that is the same in all lanes.
struct SameInAllLanes {
    double value;
    double operator[](int /*lane*/) const { return value; }
};

/// Light falling on a surface and leaving it, lane by lane.
struct ScatterPacket {
    Doubles cos_in;    ///< mu0, cosine of the angle of incidence; <= 0: unlit
    Doubles cos_out;   ///< mu, cosine of the angle of emission; > 0
    Doubles cos_phase; ///< cosine of the angle between the directions to the light and to the viewer
    const ParameterPacket* varied = nullptr; ///< instead of the law's own parameters
};

/// A scattering law. Immutable; any thread may call any member.
class Material {
public:
    virtual ~Material() = default;

    /// Bidirectional reflectance r = f cos_in (Hapke's r; radiance per collimated irradiance normal to the
    /// beam), per steradian. 0 where cos_in <= 0.
    virtual void reflectance(const ScatterPacket& s, Doubles& r) const = 0;

    /// A direction of incidence (unit, local frame: z along the normal) for the viewer's direction `out`,
    /// drawn with density pdf(); it may point below the surface, which then counts as no light. u, v in
    /// [0,1). Cosine-weighted unless the law knows better.
    [[nodiscard]] virtual Vec3 sample(Vec3 out, double u, double v) const;
    /// Density of sample() at `in`, per steradian.
    [[nodiscard]] virtual double pdf(Vec3 out, Vec3 in) const;
    /// The same where the parameters are those of a lane.
    [[nodiscard]] virtual Vec3 sample_varied(const ParameterPacket& /*varied*/, int /*lane*/, Vec3 out,
                                             double u, double v) const {
        return sample(out, u, v);
    }
    [[nodiscard]] virtual double pdf_varied(const ParameterPacket& /*varied*/, int /*lane*/, Vec3 out,
                                            Vec3 in) const {
        return pdf(out, in);
    }
    /// The share that a perfect mirror sends back, for the one law whose reflectance() is no function; -1 for
    /// all others.
    [[nodiscard]] virtual double mirror_reflectance() const { return -1; }
};

} // namespace obscura::renderer
