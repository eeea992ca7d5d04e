// SPDX-License-Identifier: Apache-2.0
// Crossings of rays with a terrain by marching over all of its cells in long double.
#pragma once

#include "terrain/cube_sphere.hpp"
#include "terrain_function.hpp"

#include <algorithm>
#include <vector>

namespace obscura::test {

/// Rough relief on a body of radius 1 km, waves down to some cells of level 0.
inline double waves_m(Vec3 p) {
    p = p / 1000;
    return 50 * std::sin(7 * p.x) * std::cos(5 * p.y + 2 * p.z) + 20 * std::sin(31 * p.z + 9 * p.x) +
           3 * std::sin(170 * p.y - 40 * p.x);
}
constexpr double waves_most_m = 73;

/// Waves at every scale, bounded.
inline double rough_m(Vec3 p) {
    double sum = 0, amplitude = 40, scale = 7e-3;
    for (int k = 0; k < 14; ++k) {
        sum += amplitude * std::sin(scale * (p.x + 0.3 * p.y) + k) * std::cos(scale * (p.z - 0.7 * p.y));
        amplitude /= 2;
        scale *= 2.1;
    }
    return sum;
}

/// The truth about fixed levels: bilinear heights of the shape's own tiles, in long double, at all crossings
/// of a ray with the planes of cells.
class March {
public:
    using Real = long double;
    March(const TerrainShape& shape, int level)
        : shape_(shape), cells_(terrain::tile_cells << level), level_(level) {}

    /// |p| - 1 - H, unit heights.
    Real above(const Real (&p)[3]) const {
        const Real radius = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        const std::size_t number = terrain::cube_face_of(
            {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
        const terrain::CubeFace& face = terrain::cube_faces[number];
        const Real w = static_cast<Real>(face.sign) * p[face.axis];
        const Real x = (p[face.u_axis] / w + 1) * cells_ / 2, y = (p[face.v_axis] / w + 1) * cells_ / 2;
        const Real i = std::clamp(std::floor(x), Real{0}, Real{cells_ - 1.0L}),
                   j = std::clamp(std::floor(y), Real{0}, Real{cells_ - 1.0L});
        const Real s = x - i, r = y - j;
        const auto h = [&](int di, int dj) {
            return height(number, static_cast<int>(i) + di, static_cast<int>(j) + dj);
        };
        return radius - 1 -
               ((1 - r) * ((1 - s) * h(0, 0) + s * h(1, 0)) + r * ((1 - s) * h(0, 1) + s * h(1, 1)));
    }

    /// First crossing in [from, to]; no_hit: none.
    double first(Vec3 o, Vec3 d, double from, double to) const {
        const Real origin[3] = {o.x, o.y, o.z}, direction[3] = {d.x, d.y, d.z};
        std::vector<Real> at{from, to};
        for (std::size_t face = 0; face < 6; face += 2) {
            const terrain::CubeFace& f = terrain::cube_faces[face];
            for (const int axis : {f.u_axis, f.v_axis})
                for (int k = 0; k <= 2 * cells_; ++k) { // both signs of u, as w may have both
                    const Real u = static_cast<Real>(k % (cells_ + 1)) * 2 / cells_ - 1;
                    const Real t =
                        (u * origin[f.axis] - origin[axis]) / (direction[axis] - u * direction[f.axis]);
                    if (t > from && t < to) at.push_back(t);
                }
        }
        std::sort(at.begin(), at.end());
        const auto height_at = [&](Real t) {
            const Real p[3] = {origin[0] + t * direction[0], origin[1] + t * direction[1],
                               origin[2] + t * direction[2]};
            return above(p);
        };
        for (std::size_t k = 0; k + 1 < at.size(); ++k) {
            constexpr int steps = 24;
            for (int i = 0; i < steps; ++i) {
                Real low = at[k] + (at[k + 1] - at[k]) * i / steps,
                     high = at[k] + (at[k + 1] - at[k]) * (i + 1) / steps;
                if (height_at(high) > 0) continue;
                if (height_at(low) <= 0) return static_cast<double>(low);
                for (int bisection = 0; bisection < 70; ++bisection) {
                    const Real middle = (low + high) / 2;
                    (height_at(middle) > 0 ? low : high) = middle;
                }
                return static_cast<double>(high);
            }
        }
        return no_hit;
    }

private:
    Real height(std::size_t face, int i, int j) const {
        SurfaceNode* node = shape_.tiles()->root(face);
        const auto in_tile = [&](int k) { return std::min(k / terrain::tile_cells, (1 << level_) - 1); };
        const int ti = in_tile(i), tj = in_tile(j);
        for (int bit = level_ - 1; bit >= 0; --bit)
            node = shape_.tiles()->make_child(*node,
                                              static_cast<unsigned>((ti >> bit & 1) | (tj >> bit & 1) << 1));
        return static_cast<Real>(
                   node->tile.height_m(i - ti * terrain::tile_cells, j - tj * terrain::tile_cells)) /
               shape_.tiles()->domain().unit_m();
    }

    const TerrainShape& shape_;
    int cells_, level_;
};

} // namespace obscura::test
