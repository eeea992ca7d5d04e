// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/stars/sky_cells.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace obscura::ephemeris {

FacePoint face_point(Vec3 direction) noexcept {
    const std::array d{direction.x, direction.y, direction.z};
    std::uint32_t axis = 0;
    for (std::uint32_t i = 1; i < 3; ++i)
        if (std::abs(d[i]) > std::abs(d[axis])) axis = i;
    const double size = std::abs(d[axis]);
    if (!(size > 0)) return {};
    return {axis + (d[axis] < 0 ? 3 : 0), d[(axis + 1) % 3] / size, d[(axis + 2) % 3] / size};
}

Vec3 direction_of(FacePoint at) noexcept {
    const double norm = 1 / std::sqrt(1 + at.u * at.u + at.v * at.v);
    const double w = at.face >= 3 ? -norm : norm;
    const double u = at.u * norm;
    const double v = at.v * norm;
    switch (at.face % 3) {
    case 0:
        return {w, u, v};
    case 1:
        return {v, w, u};
    default:
        return {u, v, w};
    }
}

SkyCells::SkyCells(std::uint32_t edge) : edge_(edge) {
    assert(edge >= min_edge && edge <= max_edge && edge % group_edge == 0);
    const std::uint32_t groups = edge / group_edge;
    groups_.resize(std::size_t{6} * groups * groups);
    cells_.resize(count());
    const double width = 2.0 / edge;
    for (std::uint32_t face = 0; face < 6; ++face)
        for (std::uint32_t j = 0; j < edge; ++j)
            for (std::uint32_t i = 0; i < edge; ++i) {
                const double u = (i + 0.5) * width - 1;
                const double v = (j + 0.5) * width - 1;
                cells_[cell_of({face, u, v})] = circle(face, u, v, width);
            }
    for (std::uint32_t face = 0; face < 6; ++face)
        for (std::uint32_t j = 0; j < groups; ++j)
            for (std::uint32_t i = 0; i < groups; ++i)
                groups_[(std::size_t{face} * groups + j) * groups + i] =
                    circle(face, (i + 0.5) * width * group_edge - 1, (j + 0.5) * width * group_edge - 1,
                           width * group_edge);
}

std::uint32_t SkyCells::cell_of(FacePoint at) const noexcept {
    const auto column = [&](double x) {
        return static_cast<std::uint32_t>(std::clamp((x + 1) / 2 * edge_, 0.0, edge_ - 1.0));
    };
    const std::uint32_t i = column(at.u);
    const std::uint32_t j = column(at.v);
    const std::uint32_t groups = edge_ / group_edge;
    const std::uint32_t group = (at.face * groups + j / group_edge) * groups + i / group_edge;
    return (group * group_edge + j % group_edge) * group_edge + i % group_edge;
}

SkyCells::Circle SkyCells::circle(std::uint32_t face, double u, double v, double width) {
    // The sides of a square are great circles: what holds its corners holds all of it.
    const Vec3 centre = direction_of(FacePoint{face, u, v});
    double cosine = 1;
    for (const double du : {-width / 2, width / 2})
        for (const double dv : {-width / 2, width / 2})
            cosine = std::min(cosine, dot(centre, direction_of(FacePoint{face, u + du, v + dv})));
    return {static_cast<float>(centre.x), static_cast<float>(centre.y), static_cast<float>(centre.z),
            static_cast<float>(cosine), static_cast<float>(std::sqrt(1 - cosine * cosine))};
}

SkyCells::Reach::Reach(const Cone& cone) noexcept : axis_(cone.axis) {
    const double half = std::clamp(cone.half_angle_rad, 0.0, std::numbers::pi);
    cosine_ = std::cos(half);
    sine_ = std::sin(half);
}

} // namespace obscura::ephemeris
