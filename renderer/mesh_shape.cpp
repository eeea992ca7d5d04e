#include "renderer/mesh_shape.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace obscura::renderer {
namespace {

/// 16 rays as Embree wants them, in two halves of eight or one of sixteen.
struct FloatRays {
    alignas(64) float ox[packet_size], oy[packet_size], oz[packet_size];
    alignas(64) float dx[packet_size], dy[packet_size], dz[packet_size];
    alignas(64) float t_far[packet_size];
    Doubles entry; ///< distance by which the origin was moved
    Lanes active;
};

/// Moves the origins to the bounding sphere and narrows to float; rays that miss the sphere are switched off.
OBSCURA_VECTOR_CLONES
void enter(const RayPacket& rays, const Doubles& limit, double radius, FloatRays& out) {
    const double radius2 = radius * radius;
    for (int i = 0; i < packet_size; ++i) {
        const double ox = rays.origin.x[i];
        const double oy = rays.origin.y[i];
        const double oz = rays.origin.z[i];
        const double dx = rays.direction.x[i];
        const double dy = rays.direction.y[i];
        const double dz = rays.direction.z[i];
        const double along = -(ox * dx + oy * dy + oz * dz);
        // Closest approach to the centre: no cancellation however far the origin is.
        const double lx = ox + along * dx;
        const double ly = oy + along * dy;
        const double lz = oz + along * dz;
        const double room = radius2 - (lx * lx + ly * ly + lz * lz);
        const double half_chord = std::sqrt(room > 0 ? room : 0.0);
        const double start = along - half_chord;
        const double entry = start > 0 ? start : 0.0;
        const bool hit = (room > 0) & (along + half_chord > 0) & (entry < limit[i]);
        out.active.on[i] = hit ? rays.active.on[i] : 0;
        out.entry[i] = entry;
        out.ox[i] = static_cast<float>(ox + entry * dx);
        out.oy[i] = static_cast<float>(oy + entry * dy);
        out.oz[i] = static_cast<float>(oz + entry * dz);
        out.dx[i] = static_cast<float>(dx);
        out.dy[i] = static_cast<float>(dy);
        out.dz[i] = static_cast<float>(dz);
        const double reach = 4 * radius;
        const double left = limit[i] - entry;
        out.t_far[i] = static_cast<float>(left < reach ? left : reach);
    }
}

template<int width, class Packet>
void load(const FloatRays& rays, int first, Packet& p) {
    constexpr auto bytes = sizeof(float) * width;
    std::memcpy(p.org_x, rays.ox + first, bytes);
    std::memcpy(p.org_y, rays.oy + first, bytes);
    std::memcpy(p.org_z, rays.oz + first, bytes);
    std::memcpy(p.dir_x, rays.dx + first, bytes);
    std::memcpy(p.dir_y, rays.dy + first, bytes);
    std::memcpy(p.dir_z, rays.dz + first, bytes);
    std::memcpy(p.tfar, rays.t_far + first, bytes);
    for (int i = 0; i < width; ++i) {
        p.tnear[i] = 0;
        p.time[i] = 0;
        p.mask[i] = ~0u;
        p.id[i] = 0;
        p.flags[i] = 0;
    }
}

template<int width, class Packet>
void begin_hits(Packet& p) {
    for (int i = 0; i < width; ++i) {
        p.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        p.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
}

template<int width, class Packet>
void take_hits(const FloatRays& rays, int first, const Packet& p, std::int32_t body, HitPacket& hits) {
    for (int i = 0; i < width; ++i) {
        const int lane = first + i;
        if (rays.active.on[lane] == 0 || p.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
        const double t = rays.entry[lane] + static_cast<double>(p.ray.tfar[i]);
        if (!(t < hits.t[lane])) continue;
        hits.t[lane] = t;
        hits.body[lane] = body;
        hits.primitive[lane] = p.hit.primID[i];
        hits.u[lane] = p.hit.u[i];
        hits.v[lane] = p.hit.v[i];
    }
}

Vec3 widen(Vec3f a) {
    return {a.x, a.y, a.z};
}

} // namespace

// No thread count: Embree would impose it on all of TBB in the process.
EmbreeDevice::EmbreeDevice() : device_(rtcNewDevice(nullptr)) {
    if (!device_) throw Error(exit_software, "Embree could not be started: no device");
    has_16_wide_ = rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
}

MeshShape::MeshShape(std::shared_ptr<const EmbreeDevice> device, TriangleMesh mesh)
    : device_(std::move(device)), mesh_(std::move(mesh)), scene_(rtcNewScene(device_->get())) {
    const std::size_t vertices = mesh_.vertices.size();
    for (const Vec3f& p : mesh_.vertices)
        bounding_radius_m_ = std::max(bounding_radius_m_, length(widen(p)));
    bounding_radius_m_ *= 1 + 1e-6;
    // Embree reads vertices 16 bytes at a time: one more than there are keeps the last read inside.
    mesh_.vertices.emplace_back();
    RTCGeometry geometry = rtcNewGeometry(device_->get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh_.vertices.data(),
                               0, sizeof(Vec3f), vertices);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh_.triangles.data(),
                               0, 3 * sizeof(std::uint32_t), mesh_.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    // Robust: no ray slips between two triangles of a closed surface.
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_->get()) != RTC_ERROR_NONE)
        throw Error(exit_software, fmt::format("Embree could not build a mesh of {} triangles: out of memory",
                                               mesh_.triangles.size()));
    mesh_.vertices.pop_back();
}

void MeshShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    Doubles limit;
    for (int i = 0; i < packet_size; ++i)
        limit[i] = rays.t_max[i] < hits.t[i] ? rays.t_max[i] : hits.t[i];
    FloatRays f;
    enter(rays, limit, bounding_radius_m_, f);
    if (!f.active.any()) return;
    if (device_->has_16_wide()) {
        RTCRayHit16 p;
        load<16>(f, 0, p.ray);
        begin_hits<16>(p.hit);
        embree::intersect16(f.active.on, scene_.get(), p, true);
        take_hits<16>(f, 0, p, body, hits);
    } else {
        for (const int first : {0, 8}) {
            RTCRayHit8 p;
            load<8>(f, first, p.ray);
            begin_hits<8>(p.hit);
            embree::intersect8(f.active.on + first, scene_.get(), p, true);
            take_hits<8>(f, first, p, body, hits);
        }
    }
}

void MeshShape::occlude(RayPacket& rays) const {
    FloatRays f;
    enter(rays, rays.t_max, bounding_radius_m_, f);
    if (!f.active.any()) return;
    if (device_->has_16_wide()) {
        RTCRay16 p;
        load<16>(f, 0, p);
        embree::occluded16(f.active.on, scene_.get(), p, true);
        for (int i = 0; i < packet_size; ++i)
            if (f.active.on[i] != 0 && p.tfar[i] < 0) rays.active.on[i] = 0;
    } else {
        for (const int first : {0, 8}) {
            RTCRay8 p;
            load<8>(f, first, p);
            embree::occluded8(f.active.on + first, scene_.get(), p, true);
            for (int i = 0; i < 8; ++i)
                if (f.active.on[first + i] != 0 && p.tfar[i] < 0) rays.active.on[first + i] = 0;
        }
    }
}

void MeshShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                        SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        if (hits.body[i] != body) {
            out.position.set(i, {});
            out.shadow_origin.set(i, {});
            out.normal.set(i, {0, 0, 1});
            continue;
        }
        const auto& corner = mesh_.triangles[hits.primitive[i]];
        const Vec3 a = widen(mesh_.vertices[corner[0]]);
        const Vec3 b = widen(mesh_.vertices[corner[1]]);
        const Vec3 c = widen(mesh_.vertices[corner[2]]);
        const double u = hits.u[i];
        const double v = hits.v[i];
        const double w = 1 - u - v;
        const Vec3 p = w * a + u * b + v * c;
        const Vec3 facet = normalized(cross(b - a, c - a));
        const double side = dot(facet, rays.direction.lane(i)) > 0 ? -1.0 : 1.0;
        Vec3 normal = side * facet;
        Vec3 origin = p;
        if (!mesh_.normals.empty()) {
            const Vec3 na = side * widen(mesh_.normals[corner[0]]);
            const Vec3 nb = side * widen(mesh_.normals[corner[1]]);
            const Vec3 nc = side * widen(mesh_.normals[corner[2]]);
            const Vec3 mean = w * na + u * nb + v * nc;
            const double norm = length(mean);
            if (norm > 0) normal = mean / norm;
            // Shadow rays start on the smooth surface that the normals tell of, where it lies outside the
            // facet. Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II (2021) ch. 4.
            const auto onto_plane = [&p](Vec3 vertex, Vec3 n) {
                return p - std::min(0.0, dot(p - vertex, n)) * n;
            };
            origin = w * onto_plane(a, na) + u * onto_plane(b, nb) + v * onto_plane(c, nc);
        }
        // Clear of the facet by some units in the last place of a float coordinate: enough at any scale.
        const double largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        out.position.set(i, p);
        out.shadow_origin.set(i, origin + side * largest * 0x1p-21 * facet);
        out.normal.set(i, normal);
    }
}

} // namespace obscura::renderer
