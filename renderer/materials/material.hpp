// SPDX-License-Identifier: Apache-2.0
// BRDF interface: evaluation and sampling of a surface's scattering law.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"

#include <cstddef>

namespace obscura::renderer {

/// Largest number of parameters of one law that may vary over the surface.
constexpr std::size_t max_parameters = 9;

/// Largest number of rows of a law: of a law of a user's own, what it reads at the point that is hit follows
/// its parameters.
constexpr std::size_t max_rows = 48;

/// Textured parameters of a law, lane by lane, in the order in which the law declares them.
struct ParameterPacket {
    Doubles value[max_rows];
};

/// A parameter that is the same in all lanes, for a law's inner loop.
struct SameInAllLanes {
    double value;
    double operator[](int /*lane*/) const { return value; }
};

/// Cosines of the angles of incidence, emission and phase, lane by lane.
struct ScatterPacket {
    Doubles cos_in;    ///< mu0, cosine of the angle of incidence; <= 0: unlit
    Doubles cos_out;   ///< mu, cosine of the angle of emission; > 0
    Doubles cos_phase; ///< cosine of the angle between the directions to the light and to the viewer
    const ParameterPacket* varied = nullptr; ///< textured parameters; null: the law's own
};

/// Scattering law of a surface. Immutable; thread-safe.
class Material {
public:
    virtual ~Material() = default;

    /// Bidirectional reflectance r = f cos_in (Hapke's r; radiance per collimated irradiance normal to the
    /// beam), per steradian. 0 where cos_in <= 0.
    virtual void reflectance(const ScatterPacket& s, Doubles& r) const = 0;
    /// Whether the reflectance differs between spectral bands other than by factors: then reflectance() is
    /// that of the first one.
    [[nodiscard]] virtual bool spectral() const { return false; }
    /// Reflectance in each band of a spectral() law.
    virtual void reflectances(const ScatterPacket& /*s*/, Channels& /*r*/) const {}

    /// Samples a direction of incidence (unit, local frame: z along the normal) for the viewer's direction
    /// `out` by pdf(); a direction below the surface carries no light. u, v in [0,1). Default:
    /// cosine-weighted.
    [[nodiscard]] virtual Vec3 sample(Vec3 out, double u, double v) const;
    /// pdf of sample() at `in`, 1/sr.
    [[nodiscard]] virtual double pdf(Vec3 out, Vec3 in) const;
    /// Whether sample() is cosine-weighted, whatever the parameters.
    [[nodiscard]] virtual bool cosine_weighted() const { return true; }
    /// As sample() and pdf(), with the textured parameters of one lane.
    [[nodiscard]] virtual Vec3 sample_varied(const ParameterPacket& /*varied*/, int /*lane*/, Vec3 out,
                                             double u, double v) const {
        return sample(out, u, v);
    }
    [[nodiscard]] virtual double pdf_varied(const ParameterPacket& /*varied*/, int /*lane*/, Vec3 out,
                                            Vec3 in) const {
        return pdf(out, in);
    }
    /// Reflectance of a perfect mirror, whose BRDF is a delta distribution that reflectance() cannot return;
    /// -1: not a mirror.
    [[nodiscard]] virtual double mirror_reflectance() const { return -1; }
};

} // namespace obscura::renderer
