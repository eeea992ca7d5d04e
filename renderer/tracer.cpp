#include "renderer/tracer.hpp"

#include "renderer/sunlight.hpp"

#include <bit>

namespace obscura::renderer {
namespace {

OBSCURA_VECTOR_CLONES
void transform(const Mat3& m, const Vec3s& in, Vec3 offset, Vec3s& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = in.x.v[i];
        const double y = in.y.v[i];
        const double z = in.z.v[i];
        out.x.v[i] = m.m[0][0] * x + m.m[0][1] * y + m.m[0][2] * z + offset.x;
        out.y.v[i] = m.m[1][0] * x + m.m[1][1] * y + m.m[1][2] * z + offset.y;
        out.z.v[i] = m.m[2][0] * x + m.m[2][1] * y + m.m[2][2] * z + offset.z;
    }
}

void set_all(Vec3s& packet, Vec3 value) {
    for (int i = 0; i < packet_size; ++i) {
        packet.x.v[i] = value.x;
        packet.y.v[i] = value.y;
        packet.z.v[i] = value.z;
    }
}

OBSCURA_VECTOR_CLONES
void angles(const SurfacePacket& surface, const Vec3s& view, const Vec3s& light, ScatterPacket& s) {
    for (int i = 0; i < packet_size; ++i) {
        const double nx = surface.normal.x.v[i];
        const double ny = surface.normal.y.v[i];
        const double nz = surface.normal.z.v[i];
        const double out = -(nx * view.x.v[i] + ny * view.y.v[i] + nz * view.z.v[i]);
        s.cos_in.v[i] = nx * light.x.v[i] + ny * light.y.v[i] + nz * light.z.v[i];
        // Interpolated normals may turn away from the viewer at the limb.
        s.cos_out.v[i] = out > 1e-6 ? out : 1e-6;
        s.cos_phase.v[i] =
            -(view.x.v[i] * light.x.v[i] + view.y.v[i] * light.y.v[i] + view.z.v[i] * light.z.v[i]);
    }
}

Mat3 relative(const BodyState& from, const BodyState& to) {
    const Mat3 inverse = transposed(to.to_inertial);
    Mat3 m;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            m.m[r][c] = inverse.m[r][0] * from.to_inertial.m[0][c] +
                        inverse.m[r][1] * from.to_inertial.m[1][c] +
                        inverse.m[r][2] * from.to_inertial.m[2][c];
    return m;
}

} // namespace

Tracer::Tracer(const RowState& row, double sun_radius_m, RayCounts& counts)
    : row_(row),
      sun_radius_m_(sun_radius_m),
      sun_radiance_(sun_radiance_per_irradiance(sun_radius_m)),
      counts_(counts) {}

void Tracer::intersect(const Vec3s& direction, const Lanes& active, std::span<const std::int32_t> candidates,
                       HitPacket& hits) {
    hits.clear();
    counts_.rays += static_cast<std::uint64_t>(active.count());
    RayPacket rays;
    rays.active = active;
    for (double& t : rays.t_max.v)
        t = no_hit;
    for (const std::int32_t index : candidates) {
        const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
        transform(body.from_camera, direction, {}, rays.direction);
        set_all(rays.origin, body.camera_m);
        body.shape->intersect(rays, index, hits);
    }
}

void Tracer::radiance(const Vec3s& direction, const HitPacket& hits, const Doubles& u, const Doubles& v,
                      Doubles& radiance) {
    for (double& r : radiance.v)
        r = 0;
    // One pass for each body that was met; nearly always there is one.
    Lanes left;
    for (int i = 0; i < packet_size; ++i)
        left.on[i] = hits.body[i] >= 0 ? -1 : 0;
    for (int i = 0; i < packet_size; ++i) {
        if (left.on[i] == 0) continue;
        const std::int32_t body = hits.body[i];
        reflect(body, direction, hits, u, v, radiance);
        for (int k = i; k < packet_size; ++k)
            left.on[k] = hits.body[k] == body ? 0 : left.on[k];
    }
}

void Tracer::reflect(std::int32_t index, const Vec3s& direction, const HitPacket& hits, const Doubles& u,
                     const Doubles& v, Doubles& radiance) {
    const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
    if (body.material == nullptr) {
        for (int i = 0; i < packet_size; ++i)
            if (hits.body[i] == index) radiance.v[i] = sun_radiance_;
        return;
    }
    RayPacket view;
    transform(body.from_camera, direction, {}, view.direction);
    set_all(view.origin, body.camera_m);
    SurfacePacket surface;
    body.shape->surface(view, hits, index, surface);

    RayPacket shadow;
    Doubles solid_angle;
    sample_sun(surface.position, body.sun_m, sun_radius_m_, u, v, shadow.direction, solid_angle);
    ScatterPacket scatter;
    angles(surface, view.direction, shadow.direction, scatter);
    Doubles r;
    body.material->reflectance(scatter, r);

    for (int i = 0; i < packet_size; ++i) {
        shadow.active.on[i] = hits.body[i] == index && r.v[i] > 0 ? -1 : 0;
        // Nothing that casts a shadow lies beyond the Sun.
        shadow.t_max.v[i] = no_hit;
    }
    if (body.shape->shadows_itself() && shadow.active.any()) {
        counts_.rays += static_cast<std::uint64_t>(shadow.active.count());
        shadow.origin = surface.shadow_origin;
        body.shape->occlude(shadow);
    }
    for (const std::int32_t other : body.occluders) {
        if (!shadow.active.any()) break;
        counts_.rays += static_cast<std::uint64_t>(shadow.active.count());
        const BodyState& occluder = row_.bodies[static_cast<std::size_t>(other)];
        const Mat3 turn = relative(body, occluder);
        const Vec3 shift = transposed(occluder.to_inertial) * (body.position_m - occluder.position_m);
        RayPacket moved;
        transform(turn, surface.shadow_origin, shift, moved.origin);
        transform(turn, shadow.direction, {}, moved.direction);
        moved.t_max = shadow.t_max;
        moved.active = shadow.active;
        occluder.shape->occlude(moved);
        shadow.active = moved.active;
    }
    for (int i = 0; i < packet_size; ++i)
        if (shadow.active.on[i] != 0) radiance.v[i] = r.v[i] * sun_radiance_ * solid_angle.v[i];
}

} // namespace obscura::renderer
