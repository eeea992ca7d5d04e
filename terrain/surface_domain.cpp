// SPDX-License-Identifier: Apache-2.0
#include "terrain/surface_domain.hpp"

#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::terrain {

SurfaceDomain SurfaceDomain::ellipsoid(Vec3 radii_m) {
    SurfaceDomain domain;
    domain.radii_m_ = radii_m;
    return domain;
}

SurfaceDomain SurfaceDomain::plane(double half_edge_m) {
    SurfaceDomain domain;
    domain.half_edge_m_ = half_edge_m;
    return domain;
}

Vec3 SurfaceDomain::point(std::uint8_t face, double u, double v) const {
    if (is_plane()) return {u * half_edge_m_, v * half_edge_m_, 0};
    const CubeFace& cube = cube_faces[face];
    // Beyond an edge, the face goes on as its neighbour does from there.
    const double over_u = std::max(std::abs(u) - 1, 0.0), over_v = std::max(std::abs(v) - 1, 0.0);
    const double depth = over_u > 0 ? 1 - over_u : 1 - over_v;
    const double across = over_u > 0 ? std::copysign(1, u) : u, along = over_v > 0 ? std::copysign(1, v) : v;
    const auto at = [&](int axis) {
        return axis == cube.axis ? cube.sign * depth : axis == cube.u_axis ? across : along;
    };
    const Vec3 p{at(0), at(1), at(2)};
    // The sum of squares in one order, whatever the face.
    const double scale = 1 / std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    return {p.x * scale * radii_m_.x, p.y * scale * radii_m_.y, p.z * scale * radii_m_.z};
}

SurfaceDomain::Place SurfaceDomain::place_of(Vec3 position_m) const {
    if (is_plane()) return {0, position_m.x / half_edge_m_, position_m.y / half_edge_m_};
    const Vec3 p{position_m.x / radii_m_.x, position_m.y / radii_m_.y, position_m.z / radii_m_.z};
    const auto face = static_cast<std::uint8_t>(cube_face_of(p));
    const CubeFace& side = cube_faces[face];
    const double w = side.sign * component(p, side.axis);
    return {face, component(p, side.u_axis) / w, component(p, side.v_axis) / w};
}

TileKey SurfaceDomain::tile_at(const Place& place, int level) {
    const double count = std::ldexp(1.0, level);
    const auto index = [&](double x) {
        return static_cast<std::uint32_t>(std::clamp(std::floor((x + 1) / 2 * count), 0.0, count - 1));
    };
    return {place.face, static_cast<std::uint8_t>(level), index(place.u), index(place.v)};
}

double SurfaceDomain::coordinate(int level, std::uint32_t index, int vertex) {
    const double number = static_cast<double>(index) * tile_cells + vertex;
    return std::ldexp(number * (2.0 / tile_cells), -level) - 1;
}

double SurfaceDomain::unit_m() const {
    return is_plane() ? half_edge_m_ : std::max({radii_m_.x, radii_m_.y, radii_m_.z});
}

double SurfaceDomain::spacing_m(int level) const {
    return std::ldexp(2 * unit_m() / tile_cells, -level);
}

} // namespace obscura::terrain
