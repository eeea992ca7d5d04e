// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/polygon_shape.hpp"

#include "renderer/shapes/own_surface.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace obscura::renderer {
namespace {

void shift(Vec3 by, RayPacket& rays) {
    for (int i = 0; i < packet_size; ++i) {
        rays.origin.x[i] -= by.x;
        rays.origin.y[i] -= by.y;
        rays.origin.z[i] -= by.z;
    }
}

bool is_origin(Vec3 a) {
    return a == Vec3{0, 0, 0};
}

/// Distances to hits, and the triangles there: a corner and the edges from it.
struct HitTriangles {
    Doubles distance;
    Vec3s corner, first, second;
};

/// Surface at the hits: where the ray meets the face's plane. The normal faces the ray's origin.
OBSCURA_VECTOR_CLONES
void polygon_surface(const HitTriangles& c, const RayPacket& rays, const HitPacket& hits, double radius_m,
                     double extent_m, SurfacePacket& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double bx = c.first.x.v[i];
        const double by = c.first.y.v[i];
        const double bz = c.first.z.v[i];
        const double cx = c.second.x.v[i];
        const double cy = c.second.y.v[i];
        const double cz = c.second.z.v[i];
        const double mx = by * cz - bz * cy;
        const double my = bz * cx - bx * cz;
        const double mz = bx * cy - by * cx;
        const double dx = rays.direction.x.v[i];
        const double dy = rays.direction.y.v[i];
        const double dz = rays.direction.z.v[i];
        const double facing = mx * dx + my * dy + mz * dz;
        const double scale = (facing > 0 ? -1.0 : 1.0) / std::sqrt(mx * mx + my * my + mz * mz);
        const double nx = mx * scale;
        const double ny = my * scale;
        const double nz = mz * scale;
        // Relative to a corner, then onto the plane: the rounding of a long ray does not leave the plane.
        const double t = c.distance.v[i];
        const double sx = rays.origin.x.v[i] - c.corner.x.v[i] + t * dx;
        const double sy = rays.origin.y.v[i] - c.corner.y.v[i] + t * dy;
        const double sz = rays.origin.z.v[i] - c.corner.z.v[i] + t * dz;
        const double off = sx * nx + sy * ny + sz * nz;
        // From so far that doubles along the ray are coarser, the barycentric coordinates give the place.
        const bool far = t > 1e8 * extent_m;
        const double u = hits.u[i];
        const double v = hits.v[i];
        const double px = c.corner.x.v[i] + (far ? u * bx + v * cx : sx - off * nx);
        const double py = c.corner.y.v[i] + (far ? u * by + v * cy : sy - off * ny);
        const double pz = c.corner.z.v[i] + (far ? u * bz + v * cz : sz - off * nz);
        // Secondary rays start clear of the surface by some units in the last place.
        const double lift = 1e-13 * (radius_m + t);
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

} // namespace

PolygonShape::PolygonShape(std::vector<TriangleCorners> triangles, bool emit)
    : triangles_(std::move(triangles)) {
    for (const TriangleCorners& t : triangles_)
        for (const Vec3 p : t) {
            bounding_radius_m_ = std::max(bounding_radius_m_, length(p));
            hull_.include(p);
        }
    bounding_radius_m_ *= 1 + 1e-12;
    const Bounds bounds = bounds_of(triangles_);
    extent_m_ = bounds.diagonal();
    if (length(bounds.centre()) > extent_m_) centre_ = bounds.centre();
    std::vector<TriangleCorners> moved = triangles_;
    for (TriangleCorners& t : moved)
        for (Vec3& p : t)
            p = p - centre_;
    for (std::size_t first = 0; first < moved.size(); first += TriangleList::most)
        lists_.emplace_back(
            std::span(moved).subspan(first, std::min(TriangleList::most, moved.size() - first)), first);
    if (emit) sampler_ = AreaSampler(triangles_);
    facets_ = std::make_unique<const FacetSet>(
        *this, static_cast<std::uint32_t>(triangles_.size()),
        [this](std::uint32_t i) { return triangles_[i]; }, nullptr);
}

void PolygonShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    const HitPacket before = hits;
    intersect_all(rays, body, hits);
    leave_own_surface(*this, rays, body, double_rounding(bounding_radius_m_), before, hits,
                      [&](const RayPacket& rest, HitPacket& next) { intersect_all(rest, body, next); });
}

void PolygonShape::intersect_all(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    Doubles limit;
    for (int i = 0; i < packet_size; ++i)
        limit[i] = rays.t_max[i] < hits.t[i] ? rays.t_max[i] : hits.t[i];
    const auto test = [&](const RayPacket& near) {
        for (const TriangleList& list : lists_)
            list.intersect(near, limit, body, hits);
    };
    if (is_origin(centre_)) {
        test(rays);
        return;
    }
    RayPacket moved = rays;
    shift(centre_, moved);
    test(moved);
}

void PolygonShape::occlude(RayPacket& rays) const {
    const auto test = [&](RayPacket& near) {
        for (const TriangleList& list : lists_)
            if (near.active.any()) list.occlude(near);
    };
    if (is_origin(centre_)) {
        test(rays);
        return;
    }
    RayPacket moved = rays;
    shift(centre_, moved);
    test(moved);
    rays.active = moved.active;
}

void PolygonShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                           SurfacePacket& out) const {
    HitTriangles c;
    for (int i = 0; i < packet_size; ++i) {
        // Lanes without a hit read triangle 0.
        const bool hit = hits.body[i] == body;
        const TriangleCorners& t = triangles_[hit ? hits.primitive[i] : 0];
        c.distance[i] = hit ? hits.t[i] : 0.0;
        c.corner.set(i, t[0]);
        c.first.set(i, t[1] - t[0]);
        c.second.set(i, t[2] - t[0]);
    }
    polygon_surface(c, rays, hits, bounding_radius_m_, extent_m_, out);
}

} // namespace obscura::renderer
