// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/mesh_shape.hpp"

#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "renderer/shapes/own_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace obscura::renderer {
namespace {

/// 16 rays in the layout of Embree: two packets of eight or one of sixteen.
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

/// As enter(), where no origin lies outside the bounding sphere, as those of shadow rays; false, with `out`
/// undefined, where one does.
OBSCURA_VECTOR_CLONES
bool enter_inside(const RayPacket& rays, double radius, FloatRays& out) {
    const double radius2 = radius * radius;
    int outside = 0;
    for (int i = 0; i < packet_size; ++i) {
        const double ox = rays.origin.x[i];
        const double oy = rays.origin.y[i];
        const double oz = rays.origin.z[i];
        outside |= rays.active.on[i] & (ox * ox + oy * oy + oz * oz < radius2 ? 0 : -1);
        out.ox[i] = static_cast<float>(ox);
        out.oy[i] = static_cast<float>(oy);
        out.oz[i] = static_cast<float>(oz);
        out.dx[i] = static_cast<float>(rays.direction.x[i]);
        out.dy[i] = static_cast<float>(rays.direction.y[i]);
        out.dz[i] = static_cast<float>(rays.direction.z[i]);
        const double reach = 4 * radius;
        out.t_far[i] = static_cast<float>(rays.t_max[i] < reach ? rays.t_max[i] : reach);
        out.active.on[i] = rays.active.on[i];
    }
    return outside == 0;
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

/// Whether the directions of eight rays agree in sign along every axis.
bool one_octant(const FloatRays& rays, int first) {
    for (const float* d : {rays.dx, rays.dy, rays.dz}) {
        int negative = 0;
        for (int i = first; i < first + 8; ++i)
            negative += d[i] < 0 ? 1 : 0;
        if (negative != 0 && negative != 8) return false;
    }
    return true;
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

struct alignas(64) VertexFloats {
    float v[packet_size];
    float& operator[](int i) { return v[i]; }
};

/// Corners of the triangles that 16 rays hit.
struct Corners {
    struct Vectors {
        VertexFloats x, y, z;
    };
    Vectors point[3], normal[3];
};

/// Flat surface at the hits. Position: where the ray meets the facet's plane, in double precision, because
/// Embree's own error, a float of the body's size, would be pixels to a camera near a large body. Where the
/// ray grazes the facet, or comes from so far that doubles are no more precise, the barycentric coordinates
/// give it; it lies on the plane in any case. The facet normal faces the ray's origin. The shadow origin is
/// clear of the facet by some units in the last place of a float coordinate, which is enough at any scale.
OBSCURA_VECTOR_CLONES
void flat_surface(const Corners& c, const RayPacket& rays, const HitPacket& hits, SurfacePacket& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double ax = c.point[0].x.v[i];
        const double ay = c.point[0].y.v[i];
        const double az = c.point[0].z.v[i];
        const double bx = c.point[1].x.v[i] - ax;
        const double by = c.point[1].y.v[i] - ay;
        const double bz = c.point[1].z.v[i] - az;
        const double cx = c.point[2].x.v[i] - ax;
        const double cy = c.point[2].y.v[i] - ay;
        const double cz = c.point[2].z.v[i] - az;
        const double u = hits.u[i];
        const double v = hits.v[i];
        const double gx = ax + u * bx + v * cx;
        const double gy = ay + u * by + v * cy;
        const double gz = az + u * bz + v * cz;
        const double mx = by * cz - bz * cy;
        const double my = bz * cx - bx * cz;
        const double mz = bx * cy - by * cx;
        const double dx = rays.direction.x.v[i];
        const double dy = rays.direction.y.v[i];
        const double dz = rays.direction.z.v[i];
        const double facing = mx * dx + my * dy + mz * dz;
        const double m2 = mx * mx + my * my + mz * mz;
        const double scale = (facing > 0 ? -1.0 : 1.0) / std::sqrt(m2);
        const double nx = mx * scale;
        const double ny = my * scale;
        const double nz = mz * scale;
        const double lx = gx < 0 ? -gx : gx;
        const double ly = gy < 0 ? -gy : gy;
        const double lz = gz < 0 ? -gz : gz;
        const double lxy = lx > ly ? lx : ly;
        const double most = lxy > lz ? lxy : lz;
        const double lift = most * 0x1p-21;
        const double ox = rays.origin.x.v[i] - gx;
        const double oy = rays.origin.y.v[i] - gy;
        const double oz = rays.origin.z.v[i] - gz;
        const double along = -(ox * mx + oy * my + oz * mz) / facing;
        const double sx = ox + along * dx;
        const double sy = oy + along * dy;
        const double sz = oz + along * dz;
        const double off = (sx * mx + sy * my + sz * mz) / m2;
        const bool sharp = (facing * facing > 4e-4 * m2) & (along < 1e7 * most);
        const double px = gx + (sharp ? sx - off * mx : 0.0);
        const double py = gy + (sharp ? sy - off * my : 0.0);
        const double pz = gz + (sharp ? sz - off * mz : 0.0);
        out.position.x.v[i] = px;
        out.position.y.v[i] = py;
        out.position.z.v[i] = pz;
        out.normal.x.v[i] = out.facet_normal.x.v[i] = nx;
        out.normal.y.v[i] = out.facet_normal.y.v[i] = ny;
        out.normal.z.v[i] = out.facet_normal.z.v[i] = nz;
        out.outside.on[i] = facing > 0 ? 0 : -1;
        out.shadow_origin.x.v[i] = px + lift * nx;
        out.shadow_origin.y.v[i] = py + lift * ny;
        out.shadow_origin.z.v[i] = pz + lift * nz;
    }
}

/// Interpolates the normals, and raises the shadow origin onto the smooth surface that they describe where
/// that lies outside the facet. Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II (2021) ch. 4.
/// Expects flat_surface()'s result in `out`.
OBSCURA_VECTOR_CLONES
void smooth_surface(const Corners& c, const HitPacket& hits, SurfacePacket& out) {
    alignas(64) double facing[packet_size];
    Vec3s sum;
    Vec3s raised;
    for (int i = 0; i < packet_size; ++i) {
        // The facet's normal faces the viewer: find out whether it is the outer one.
        const double inner = c.normal[0].x.v[i] * out.normal.x.v[i] + c.normal[0].y.v[i] * out.normal.y.v[i] +
                             c.normal[0].z.v[i] * out.normal.z.v[i] + c.normal[1].x.v[i] * out.normal.x.v[i] +
                             c.normal[1].y.v[i] * out.normal.y.v[i] + c.normal[1].z.v[i] * out.normal.z.v[i] +
                             c.normal[2].x.v[i] * out.normal.x.v[i] + c.normal[2].y.v[i] * out.normal.y.v[i] +
                             c.normal[2].z.v[i] * out.normal.z.v[i];
        facing[i] = inner < 0 ? -1.0 : 1.0;
        sum.x.v[i] = sum.y.v[i] = sum.z.v[i] = 0;
        raised.x.v[i] = raised.y.v[i] = raised.z.v[i] = 0;
    }
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < packet_size; ++i) {
            const double u = hits.u[i];
            const double v = hits.v[i];
            const double w = k == 0 ? 1 - u - v : k == 1 ? u : v;
            const double nx = facing[i] * c.normal[k].x.v[i];
            const double ny = facing[i] * c.normal[k].y.v[i];
            const double nz = facing[i] * c.normal[k].z.v[i];
            const double below = (out.position.x.v[i] - c.point[k].x.v[i]) * nx +
                                 (out.position.y.v[i] - c.point[k].y.v[i]) * ny +
                                 (out.position.z.v[i] - c.point[k].z.v[i]) * nz;
            const double rise = w * (below < 0 ? -below : 0.0);
            sum.x.v[i] += w * nx;
            sum.y.v[i] += w * ny;
            sum.z.v[i] += w * nz;
            raised.x.v[i] += rise * nx;
            raised.y.v[i] += rise * ny;
            raised.z.v[i] += rise * nz;
        }
    for (int i = 0; i < packet_size; ++i) {
        const double norm2 = sum.x.v[i] * sum.x.v[i] + sum.y.v[i] * sum.y.v[i] + sum.z.v[i] * sum.z.v[i];
        const bool good = norm2 > 1e-12;
        const double scale = 1 / std::sqrt(good ? norm2 : 1.0);
        out.normal.x.v[i] = good ? sum.x.v[i] * scale : out.normal.x.v[i];
        out.normal.y.v[i] = good ? sum.y.v[i] * scale : out.normal.y.v[i];
        out.normal.z.v[i] = good ? sum.z.v[i] * scale : out.normal.z.v[i];
        out.shadow_origin.x.v[i] += raised.x.v[i];
        out.shadow_origin.y.v[i] += raised.y.v[i];
        out.shadow_origin.z.v[i] += raised.z.v[i];
    }
}

/// Values at the corners of a triangle: `of` is the mesh's vertices or normals.
TriangleCorners corners_of(const TriangleMesh& mesh, const std::vector<Vec3f>& of, std::size_t triangle) {
    const auto& t = mesh.triangles[triangle];
    return {to_double(of[t[0]]), to_double(of[t[1]]), to_double(of[t[2]])};
}

std::vector<TriangleCorners> corners_of(const TriangleMesh& mesh) {
    std::vector<TriangleCorners> corners;
    corners.reserve(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        corners.push_back(corners_of(mesh, mesh.vertices, i));
    return corners;
}

} // namespace

// Pass no thread count: Embree would impose it on all of TBB in the process. Its cache of tessellated
// surfaces, of which there are none, would take 128 MiB of address space.
EmbreeDevice::EmbreeDevice() : device_(rtcNewDevice("tessellation_cache_size=1")) {
    if (!device_) throw Error(exit_software, "Embree could not be started: no device");
    const auto count = [](void* counter, ssize_t bytes, bool /*after*/) {
        static_cast<std::atomic<std::int64_t>*>(counter)->fetch_add(bytes);
        return true;
    };
    rtcSetDeviceMemoryMonitorFunction(device_.get(), count, &bytes_);
    has_16_wide_ = rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
}

MeshShape::MeshShape(std::shared_ptr<const EmbreeDevice> device, TriangleMesh mesh, bool emits)
    : device_(std::move(device)), mesh_(std::move(mesh)), scene_(rtcNewScene(device_->get())) {
    for (const Vec3f& p : mesh_.vertices) {
        bounding_radius_m_ = std::max(bounding_radius_m_, length(to_double(p)));
        hull_.include(to_double(p));
    }
    bounding_radius_m_ *= 1 + 1e-6;
    // Embree reads vertices 16 bytes at a time: an element of padding keeps the last read inside. Release the
    // excess capacity of arrays that grew while they were read.
    mesh_.vertices.reserve(mesh_.vertices.size() + 1);
    mesh_.vertices.emplace_back();
    mesh_.vertices.shrink_to_fit();
    mesh_.normals.shrink_to_fit();
    mesh_.triangles.shrink_to_fit();
    mesh_.uvs.shrink_to_fit();
    mesh_.material_slots.shrink_to_fit();
    if (emits) sampler_ = AreaSampler(corners_of(mesh_));
    if (mesh_.triangles.size() <= TriangleList::most)
        triangle_list_.emplace(corners_of(mesh_));
    else
        build_tree();
    mesh_.vertices.pop_back();
    // Now, not when the mesh is small in a picture for the first time: that frame would be late.
    FacetSet::Corners normals;
    if (!mesh_.normals.empty())
        normals = [this](std::uint32_t i) { return corners_of(mesh_, mesh_.normals, i); };
    facets_ = std::make_unique<const FacetSet>(
        *this, static_cast<std::uint32_t>(mesh_.triangles.size()),
        [this](std::uint32_t i) { return corners_of(mesh_, mesh_.vertices, i); }, normals);
}

void MeshShape::build_tree() {
    // Measured while building: twice the finished hierarchy, which takes some 80 bytes a triangle.
    constexpr std::uint64_t bytes_per_triangle = 160;
    require_memory(bytes_per_triangle * mesh_.triangles.size(),
                   fmt::format("a mesh of {} triangles", mesh_.triangles.size()));
    RTCGeometry geometry = rtcNewGeometry(device_->get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh_.vertices.data(),
                               0, sizeof(Vec3f), mesh_.vertices.size() - 1);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh_.triangles.data(),
                               0, 3 * sizeof(std::uint32_t), mesh_.triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    // Robust mode: no ray slips between two triangles of a closed surface.
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_->get()) != RTC_ERROR_NONE)
        throw Error(exit_software, fmt::format("Embree could not build a mesh of {} triangles: out of memory",
                                               mesh_.triangles.size()));
}

std::int64_t MeshShape::bytes() const {
    const auto size = [](const auto& list) { return list.capacity() * sizeof list[0]; };
    return static_cast<std::int64_t>(sizeof *this + size(mesh_.vertices) + size(mesh_.normals) +
                                     size(mesh_.triangles) + size(mesh_.uvs) + size(mesh_.material_slots) +
                                     sampler_.bytes() + facets_->bytes());
}

void MeshShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    const HitPacket before = hits;
    intersect_all(rays, body, hits);
    const HitRounding rounding =
        triangle_list_ ? double_rounding(bounding_radius_m_) : float_rounding(bounding_radius_m_);
    leave_own_surface(*this, rays, body, rounding, before, hits,
                      [&](const RayPacket& rest, HitPacket& next) { intersect_all(rest, body, next); });
}

void MeshShape::intersect_all(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    Doubles limit;
    for (int i = 0; i < packet_size; ++i)
        limit[i] = rays.t_max[i] < hits.t[i] ? rays.t_max[i] : hits.t[i];
    if (triangle_list_) {
        triangle_list_->intersect(rays, limit, body, hits);
        return;
    }
    FloatRays f;
    enter(rays, limit, bounding_radius_m_, f);
    if (!f.active.any()) return;
    if (device_->has_16_wide()) {
        RTCRayHit16 p;
        load<16>(f, 0, p.ray);
        begin_hits<16>(p.hit);
        embree::intersect16(f.active.on, scene_.get(), p, rays.coherent);
        take_hits<16>(f, 0, p, body, hits);
    } else {
        for (const int first : {0, 8}) {
            RTCRayHit8 p;
            load<8>(f, first, p.ray);
            begin_hits<8>(p.hit);
            embree::intersect8(f.active.on + first, scene_.get(), p, rays.coherent);
            take_hits<8>(f, first, p, body, hits);
        }
    }
}

// Shadow rays start where the camera rays ended and are less coherent: with packets of 16 Embree's incoherent
// traversal is the faster one. With packets of 8 (measured on AVX2) the coherent traversal saves 10 % of
// whole frames, but costs 20 % where the Sun's disc lies across an axis of the body, so that the rays'
// directions differ in sign.
void MeshShape::occlude(RayPacket& rays) const {
    if (triangle_list_) {
        triangle_list_->occlude(rays);
        return;
    }
    FloatRays f;
    if (!enter_inside(rays, bounding_radius_m_, f)) enter(rays, rays.t_max, bounding_radius_m_, f);
    if (!f.active.any()) return;
    if (device_->has_16_wide()) {
        RTCRay16 p;
        load<16>(f, 0, p);
        embree::occluded16(f.active.on, scene_.get(), p, false);
        for (int i = 0; i < packet_size; ++i)
            if (f.active.on[i] != 0 && p.tfar[i] < 0) rays.active.on[i] = 0;
    } else {
        for (const int first : {0, 8}) {
            RTCRay8 p;
            load<8>(f, first, p);
            embree::occluded8(f.active.on + first, scene_.get(), p, rays.coherent && one_octant(f, first));
            for (int i = 0; i < 8; ++i)
                if (f.active.on[first + i] != 0 && p.tfar[i] < 0) rays.active.on[first + i] = 0;
        }
    }
}

void MeshShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                        SurfacePacket& out) const {
    Corners corners;
    const bool smooth = !mesh_.normals.empty();
    for (int i = 0; i < packet_size; ++i) {
        // Lanes without a hit read triangle 0: cheaper than a branch.
        const auto& triangle = mesh_.triangles[hits.body[i] == body ? hits.primitive[i] : 0];
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f p = mesh_.vertices[triangle[k]];
            corners.point[k].x[i] = p.x;
            corners.point[k].y[i] = p.y;
            corners.point[k].z[i] = p.z;
            if (!smooth) continue;
            const Vec3f n = mesh_.normals[triangle[k]];
            corners.normal[k].x[i] = n.x;
            corners.normal[k].y[i] = n.y;
            corners.normal[k].z[i] = n.z;
        }
    }
    flat_surface(corners, rays, hits, out);
    if (smooth) smooth_surface(corners, hits, out);
}

bool MeshShape::texture_coordinates(const HitPacket& hits, std::int32_t body,
                                    const SurfacePacket& /*surface*/, UvPacket& out) const {
    if (mesh_.uvs.empty()) return false;
    for (int i = 0; i < packet_size; ++i) {
        out.u[i] = out.v[i] = 0;
        out.grad_u.set(i, {});
        out.grad_v.set(i, {});
        if (hits.body[i] != body) continue;
        const auto& t = mesh_.triangles[hits.primitive[i]];
        const Vec3 a = to_double(mesh_.vertices[t[0]]);
        const Vec3 ab = to_double(mesh_.vertices[t[1]]) - a;
        const Vec3 ac = to_double(mesh_.vertices[t[2]]) - a;
        const auto uv = [&](std::size_t k, std::size_t axis) {
            return static_cast<double>(mesh_.uvs[t[k]][axis]);
        };
        const double u = hits.u[i];
        const double v = hits.v[i];
        const double du1 = uv(1, 0) - uv(0, 0);
        const double du2 = uv(2, 0) - uv(0, 0);
        const double dv1 = uv(1, 1) - uv(0, 1);
        const double dv2 = uv(2, 1) - uv(0, 1);
        out.u[i] = uv(0, 0) + u * du1 + v * du2;
        out.v[i] = uv(0, 1) + u * dv1 + v * dv2;
        // Gradients of the barycentric coordinates.
        const Vec3 n = cross(ab, ac);
        const double n2 = length_squared(n);
        const Vec3 grad_1 = cross(ac, n) / n2;
        const Vec3 grad_2 = cross(n, ab) / n2;
        out.grad_u.set(i, du1 * grad_1 + du2 * grad_2);
        out.grad_v.set(i, dv1 * grad_1 + dv2 * grad_2);
    }
    return true;
}

} // namespace obscura::renderer
