// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/rough_ground.hpp"

#include "core/math/vector_functions.hpp"
#include "renderer/integrators/tracer.hpp"

namespace obscura::renderer {
namespace {

/// sqrt that vectorises to one instruction (std::sqrt may set errno).
inline double root_of(double x) {
    return __builtin_sqrt(x > 0 ? x : 0.0);
}

/// Cosines and slopes of the level surface.
struct Level {
    Vec3s along, across; ///< unit tangents, `along` towards the light
    Doubles cos_in, cos_out, cos_phase;
    Doubles slope; ///< standard deviation along a direction
};

OBSCURA_VECTOR_CLONES
void set_level(const SurfacePacket& surface, const ScatterPacket& s, const Vec3s& light,
               const Doubles& unresolved, Level& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double nx = surface.normal.x.v[i], ny = surface.normal.y.v[i], nz = surface.normal.z.v[i];
        const double mu0 = s.cos_in.v[i];
        double x = light.x.v[i] - mu0 * nx, y = light.y.v[i] - mu0 * ny, z = light.z.v[i] - mu0 * nz;
        const double square = x * x + y * y + z * z;
        // Any tangent does where the light is in the zenith: orthonormal_basis() of the normal.
        const double sign = __builtin_copysign(1.0, nz), a = -1.0 / (sign + nz);
        const bool zenith = !(square > 1e-20);
        const double per = 1 / root_of(zenith ? 1.0 : square);
        x = zenith ? 1 + sign * nx * nx * a : x * per;
        y = zenith ? sign * nx * ny * a : y * per;
        z = zenith ? -sign * nx : z * per;
        out.along.x.v[i] = x;
        out.along.y.v[i] = y;
        out.along.z.v[i] = z;
        out.across.x.v[i] = ny * z - nz * y;
        out.across.y.v[i] = nz * x - nx * z;
        out.across.z.v[i] = nx * y - ny * x;
        out.slope.v[i] = root_of(0.5 * unresolved.v[i]);
    }
    out.cos_in = s.cos_in;
    out.cos_out = s.cos_out;
    out.cos_phase = s.cos_phase;
}

/// Angles on a facet of slopes `u` and `v` standard deviations, and its area as the viewer sees it.
OBSCURA_VECTOR_CLONES
void set_facet(const SurfacePacket& surface, const Level& level, const Vec3s& view, const Vec3s& light,
               double u, double v, ScatterPacket& s, Doubles& seen) {
    for (int i = 0; i < packet_size; ++i) {
        const double a = u * level.slope.v[i], b = v * level.slope.v[i];
        const double x = surface.normal.x.v[i] - a * level.along.x.v[i] - b * level.across.x.v[i];
        const double y = surface.normal.y.v[i] - a * level.along.y.v[i] - b * level.across.y.v[i];
        const double z = surface.normal.z.v[i] - a * level.along.z.v[i] - b * level.across.z.v[i];
        const double out = -(x * view.x.v[i] + y * view.y.v[i] + z * view.z.v[i]);
        const double in = x * light.x.v[i] + y * light.y.v[i] + z * light.z.v[i];
        const double per = 1 / root_of(1 + a * a + b * b);
        const double mu = out * per;
        s.cos_in.v[i] = in * per;
        s.cos_out.v[i] = mu > 1e-6 ? mu : 1e-6;
        seen.v[i] = out > 0 ? out : 0;
    }
}

OBSCURA_VECTOR_CLONES
void add_facet(const Doubles& seen, const Doubles& own, double weight, Doubles& sum, Doubles& area) {
    for (int i = 0; i < packet_size; ++i) {
        sum.v[i] += weight * seen.v[i] * own.v[i];
        area.v[i] += weight * seen.v[i];
    }
}

/// Smith's function: what hides of a facet that is turned towards a direction of that cosine, over what does
/// not.
inline double smith(double cosine, double slope) {
    const double sine = root_of(1 - cosine * cosine);
    const double a = cosine / (1.4142135623730951 * slope * sine + 1e-12);
    const double part = (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a);
    return a < 1.6 ? part : 0.0;
}

/// Share of the seen facets turned to the light that is lit, times their mean.
OBSCURA_VECTOR_CLONES
void shade(const Level& level, const Doubles& sum, const Doubles& area, Doubles& r) {
    for (int i = 0; i < packet_size; ++i) {
        const double lowest = 1e-3;
        const double mu0 = level.cos_in.v[i] > lowest ? level.cos_in.v[i] : lowest;
        const double mu = level.cos_out.v[i] > lowest ? level.cos_out.v[i] : lowest;
        const double in = smith(mu0, level.slope.v[i]), out = smith(mu, level.slope.v[i]);
        const double sines = root_of((1 - mu0 * mu0) * (1 - mu * mu));
        double cosine = (level.cos_phase.v[i] - mu0 * mu) / (sines + 1e-12);
        cosine = cosine < -1 ? -1 : cosine > 1 ? 1 : cosine;
        const double apart = 4.41 * quick_acos(cosine);
        const double more = in > out ? in : out, less = in > out ? out : in;
        const double lit = (1 + out) / (1 + more + apart / (1 + apart) * less);
        r.v[i] = area.v[i] > 0 ? lit * sum.v[i] / area.v[i] : 0.0;
    }
}

/// Mean over facets of what `evaluate(angles, bands)` gives in each of `count` bands.
template<typename Evaluate>
void mean_over_facets(const SurfacePacket& surface, const Vec3s& view, const Vec3s& light,
                      const Doubles& unresolved, ScatterPacket& angles, std::size_t count,
                      const Evaluate& evaluate, Doubles* own, Doubles* sum, Doubles* r) {
    Level level;
    set_level(surface, angles, light, unresolved, level);
    Doubles area{};
    constexpr double root3 = 1.7320508075688772;
    constexpr double nodes[3] = {-root3, 0, root3}, weights[3] = {1.0 / 6, 2.0 / 3, 1.0 / 6};
    for (std::size_t c = 0; c < count; ++c)
        sum[c] = {};
    for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) {
            Doubles seen;
            set_facet(surface, level, view, light, nodes[k], nodes[l], angles, seen);
            evaluate(angles);
            for (std::size_t c = 0; c < count; ++c) {
                Doubles again = area;
                add_facet(seen, own[c], weights[k] * weights[l], sum[c], c + 1 < count ? again : area);
            }
        }
    for (std::size_t c = 0; c < count; ++c)
        shade(level, sum[c], area, r[c]);
}

} // namespace

void ground_reflectance(const Material& material, const SurfacePacket& surface, const Vec3s& view,
                        const Vec3s& light, const ParameterPacket* varied, const Doubles* unresolved,
                        Doubles& r) {
    ScatterPacket angles;
    scatter_angles(surface, view, light, angles);
    angles.varied = varied;
    if (unresolved == nullptr) return material.reflectance(angles, r);
    Doubles own, sum;
    mean_over_facets(
        surface, view, light, *unresolved, angles, 1,
        [&](const ScatterPacket& s) { material.reflectance(s, own); }, &own, &sum, &r);
}

void ground_reflectances(const Material& material, const SurfacePacket& surface, const Vec3s& view,
                         const Vec3s& light, const ParameterPacket* varied, const Doubles* unresolved,
                         std::size_t bands, Channels& r) {
    ScatterPacket angles;
    scatter_angles(surface, view, light, angles);
    angles.varied = varied;
    if (unresolved == nullptr) return material.reflectances(angles, r);
    Channels own, sum;
    mean_over_facets(
        surface, view, light, *unresolved, angles, bands,
        [&](const ScatterPacket& s) { material.reflectances(s, own); }, own.v, sum.v, r.v);
}

} // namespace obscura::renderer
