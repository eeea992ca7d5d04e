// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/triangle_list.hpp"

#include <cmath>

namespace obscura::renderer {
namespace {

constexpr double edge_slack = 1e-12;

/// Intersection of 16 rays with the plane of a triangle: distance and barycentric coordinates, all times
/// `scale`, the absolute cosine between ray and normal (times the length of the normal).
struct Crossing {
    Doubles scale, distance, first, second;
};

/// Sets `met` to the active rays that meet the triangle at 0 < t < limit; true if any does.
OBSCURA_VECTOR_CLONES
bool cross_triangle(const TriangleList::Triangle& triangle, const RayPacket& rays, const Doubles& limit,
                    Crossing& out, Lanes& met) {
    const TriangleList::Plane f = triangle.face;
    const TriangleList::Plane a = triangle.first;
    const TriangleList::Plane b = triangle.second;
    for (int i = 0; i < packet_size; ++i) {
        const double ox = rays.origin.x.v[i];
        const double oy = rays.origin.y.v[i];
        const double oz = rays.origin.z.v[i];
        const double dx = rays.direction.x.v[i];
        const double dy = rays.direction.y.v[i];
        const double dz = rays.direction.z.v[i];
        const double facing = f.x * dx + f.y * dy + f.z * dz;
        const double away = f.d - (f.x * ox + f.y * oy + f.z * oz);
        const double sign = facing < 0 ? -1.0 : 1.0;
        const double scale = facing * sign;
        const double distance = away * sign;
        const double px = scale * ox + distance * dx;
        const double py = scale * oy + distance * dy;
        const double pz = scale * oz + distance * dz;
        const double first = a.x * px + a.y * py + a.z * pz + a.d * scale;
        const double second = b.x * px + b.y * py + b.z * pz + b.d * scale;
        const double slack = -edge_slack * scale;
        out.scale.v[i] = scale;
        out.distance.v[i] = distance;
        out.first.v[i] = first;
        out.second.v[i] = second;
        // An infinite limit times a scale of 0 is NaN, which lets no ray pass.
        const bool inside = (first >= slack) & (second >= slack) & (scale - first - second >= slack);
        const bool near = (distance > 0) & (distance < limit.v[i] * scale);
        met.on[i] = (inside & near) ? rays.active.on[i] : 0;
    }
    return met.any();
}

/// Whether any active ray meets a sphere.
OBSCURA_VECTOR_CLONES
bool any_near(const RayPacket& rays, Vec3 centre, double radius2) {
    Lanes near;
    for (int i = 0; i < packet_size; ++i) {
        const double x = centre.x - rays.origin.x.v[i];
        const double y = centre.y - rays.origin.y.v[i];
        const double z = centre.z - rays.origin.z.v[i];
        const double dx = rays.direction.x.v[i];
        const double dy = rays.direction.y.v[i];
        const double dz = rays.direction.z.v[i];
        const double along = x * dx + y * dy + z * dz;
        const double lx = x - along * dx;
        const double ly = y - along * dy;
        const double lz = z - along * dz;
        const bool passes = lx * lx + ly * ly + lz * lz <= radius2;
        const bool ahead = (along > 0) | (x * x + y * y + z * z <= radius2);
        near.on[i] = (passes & ahead) ? rays.active.on[i] : 0;
    }
    return near.any();
}

TriangleList::Plane plane(Vec3 normal, double d) {
    return {normal.x, normal.y, normal.z, d};
}

} // namespace

TriangleList::TriangleList(std::span<const TriangleCorners> triangles, std::size_t first_primitive)
    : first_primitive_(first_primitive) {
    const Bounds bounds = bounds_of(triangles);
    centre_ = bounds.centre();
    // Slightly more than the diagonal of the bounding box, for edge_slack and rounding.
    radius2_ = length_squared(bounds.largest - centre_) * (1 + 1e-6);
    for (const auto& [a, b, c] : triangles) {
        const Vec3 ab = b - a;
        const Vec3 ac = c - a;
        const Vec3 n = cross(ab, ac);
        const double n2 = length_squared(n);
        const Vec3 first = cross(ac, n) / n2;
        const Vec3 second = cross(n, ab) / n2;
        triangles_.push_back(
            {plane(n, dot(n, a)), plane(first, -dot(first, a)), plane(second, -dot(second, a))});
    }
}

bool TriangleList::reached(const RayPacket& rays) const {
    // Testing the sphere does not pay for a few triangles.
    return triangles_.size() <= 4 || any_near(rays, centre_, radius2_);
}

void TriangleList::intersect(const RayPacket& rays, Doubles& limit, std::int32_t body,
                             HitPacket& hits) const {
    if (!reached(rays)) return;
    Crossing crossing;
    Lanes met;
    for (std::size_t k = 0; k < triangles_.size(); ++k) {
        if (!cross_triangle(triangles_[k], rays, limit, crossing, met)) continue;
        for (int i = 0; i < packet_size; ++i) {
            if (met.on[i] == 0) continue;
            const double inverse = 1 / crossing.scale[i];
            limit[i] = hits.t[i] = crossing.distance[i] * inverse;
            hits.body[i] = body;
            hits.primitive[i] = static_cast<std::uint32_t>(first_primitive_ + k);
            hits.u[i] = static_cast<float>(crossing.first[i] * inverse);
            hits.v[i] = static_cast<float>(crossing.second[i] * inverse);
        }
    }
}

void TriangleList::occlude(RayPacket& rays) const {
    if (!reached(rays)) return;
    Crossing crossing;
    Lanes met;
    for (const Triangle& triangle : triangles_) {
        if (!cross_triangle(triangle, rays, rays.t_max, crossing, met)) continue;
        for (int i = 0; i < packet_size; ++i)
            rays.active.on[i] &= ~met.on[i];
        if (!rays.active.any()) return;
    }
}

} // namespace obscura::renderer
