// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_tracer.hpp"

#include "renderer/planets/tile_rays.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::renderer {

using namespace tile_rays;

namespace {

Vec3 axis(int k) {
    return {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
}

/// Derivatives of the height at a vertex: differences across two cells, m.
struct Slopes {
    double u, v;
};

class SlopesAt {
public:
    SlopesAt(const terrain::SurfaceDomain& domain, const SurfaceNode& node)
        : domain_(domain), node_(node), last_(static_cast<double>(tile_cells) * std::ldexp(1.0, level())) {}

    [[nodiscard]] Slopes operator()(std::int32_t i, std::int32_t j) const {
        const double number_i = static_cast<double>(node_.tile.key.i) * tile_cells + i;
        const double number_j = static_cast<double>(node_.tile.key.j) * tile_cells + j;
        const bool edge_u = number_i == 0 || number_i == last_, edge_v = number_j == 0 || number_j == last_;
        if ((edge_u || edge_v) && !domain_.is_plane())
            return at_edge(i, j, edge_u ? (number_i == 0 ? 1 : -1) : 0,
                           edge_v ? (number_j == 0 ? 1 : -1) : 0);
        return {height(i + 1, j) - height(i - 1, j), height(i, j + 1) - height(i, j - 1)};
    }

private:
    [[nodiscard]] int level() const { return node_.tile.key.level; }
    [[nodiscard]] double height(std::int32_t i, std::int32_t j) const {
        return static_cast<double>(*node_.tile.vertex(i, j));
    }
    /// Unit direction of a vertex in scaled space.
    [[nodiscard]] Vec3 direction(std::int32_t i, std::int32_t j) const {
        const terrain::TileKey key = node_.tile.key;
        const Vec3 p = domain_.point(key.face, terrain::SurfaceDomain::coordinate(level(), key.i, i),
                                     terrain::SurfaceDomain::coordinate(level(), key.j, j));
        const Vec3 radii = domain_.radii_m();
        return {p.x / radii.x, p.y / radii.y, p.z / radii.z};
    }
    /// At an edge of the face, from the gradient on the sphere that the same four vertices (at a corner:
    /// three) give on all faces. `into_u`, `into_v`: step from the edge into the face; 0: not at that edge.
    [[nodiscard]] Slopes at_edge(std::int32_t i, std::int32_t j, std::int32_t into_u,
                                 std::int32_t into_v) const {
        // At a corner, the vertices outside of both edges are one, on the edge of the two other faces.
        const std::int32_t iu = into_u != 0 ? into_u : 1, jv = into_v != 0 ? into_v : 1;
        const Vec3 n = direction(i, j);
        const Vec3 a = direction(i + iu, j) - direction(i - iu, j);
        const Vec3 b = direction(i, j + jv) - direction(i, j - jv);
        const double da = height(i + iu, j) - height(i - iu, j), db = height(i, j + jv) - height(i, j - jv);
        const Vec3 b_n = cross(b, n);
        const Vec3 gradient = (da * b_n + db * cross(n, a)) / dot(a, b_n);
        const CubeFace& face = cube_faces[node_.tile.key.face];
        const double w = face.sign * component(n, face.axis); // 1 over the length of the point at w = 1
        const double scale = 2 / node_.half_cells * w;
        const auto along = [&](int k) { return scale * dot(gradient, axis(k) - component(n, k) * n); };
        return {along(face.u_axis), along(face.v_axis)};
    }

    const terrain::SurfaceDomain& domain_;
    const SurfaceNode& node_;
    double last_;
};

/// Where the ray first crosses the surface of a tile within a part, from below.
template<typename Ray>
bool cross_tile(const Ray& ray, const FaceLines& lines, double side, double per_m, const Part& whole,
                TileCrossing& found) {
    std::array<Part, 2 * pyramid_levels + 4> stack;
    std::size_t waiting = 0;
    stack[waiting++] = whole;
    const SurfaceNode& node = *whole.tile;
    while (waiting > 0) {
        Part part = stack[--waiting];
        Patch cell{};
        if (part.level == 0) cell = patch_of(node, part.i, part.j, per_m);
        if (side > 0) { // the part of the ray that is under the node's highest point
            const double highest =
                part.level == 0 ? cell.highest : node.tile.maximum_m(part.level, part.i, part.j) * per_m;
            if (!ray.clip(highest, part.from, part.to)) continue;
        }
        if (part.level == 0) {
            const Clearance<Ray> clearance(ray, cell, lines, node.half_cells,
                                           static_cast<double>(node.tile.key.i) * tile_cells + part.i,
                                           static_cast<double>(node.tile.key.j) * tile_cells + part.j);
            const double x = clearance.first_root(part.from, part.to, side);
            if (x == no_hit) continue;
            found = {x, &node, part.j * tile_cells + part.i, std::clamp(clearance.s(x), 0.0, 1.0),
                     std::clamp(clearance.r(x), 0.0, 1.0)};
            return true;
        }
        const typename TileWalk<Ray>::Middle middle(node, part, lines);
        const Cuts cuts(part.from, part.to, middle.u.root(), middle.v.root());
        for (std::size_t k = cuts.count; k-- > 0;) { // the first one last, to be next
            const double at = (cuts.at[k] + cuts.at[k + 1]) / 2;
            stack[waiting++] = {cuts.at[k],
                                cuts.at[k + 1],
                                part.tile,
                                part.level - 1,
                                2 * part.i + (middle.u(at) >= 0 ? 1u : 0u),
                                2 * part.j + (middle.v(at) >= 0 ? 1u : 0u)};
        }
    }
    return false;
}

} // namespace

template<typename Ray>
bool TileTracer::cross_face(const Ray& ray, std::size_t face, double from, double to, bool inside,
                            TileCrossing& found) const {
    const FaceLines lines = ray.lines(face);
    const double per_m = 1 / tiles_.domain().unit_m();
    const auto child_of = [&](SurfaceNode& node, unsigned quarter) {
        return child(tiles_, levels_, node, quarter);
    };
    TileWalk<Ray> walk;
    walk.start(ray, lines, tiles_.root(face), from, to, inside, levels_, child_of);
    Part part;
    while (walk.next(ray, lines, inside, per_m, levels_, child_of, part))
        if (cross_tile(ray, lines, inside ? -1 : 1, per_m, part, found)) return true;
    return false;
}

bool TileTracer::cross_shell(const SphereRay& ray, double from, double to, bool inside,
                             TileCrossing& found) const {
    if (!(from < to)) return false;
    const FaceCuts cuts(ray, from, to);
    for (std::size_t k = 0; k < cuts.count; ++k) {
        const std::size_t face = terrain::cube_face_of(ray.at((cuts.at[k] + cuts.at[k + 1]) / 2));
        if (cross_face(ray, face, cuts.at[k], cuts.at[k + 1], inside, found)) return true;
    }
    return false;
}

TileCrossing TileTracer::below(Vec3 p, double height) const {
    const bool plane = tiles_.domain().is_plane();
    const std::size_t face = plane ? 0 : terrain::cube_face_of(p);
    const CubeFace& f = cube_faces[face];
    const double w = plane ? 1 : f.sign * component(p, f.axis);
    const double u = (plane ? p.x : component(p, f.u_axis)) / w,
                 v = (plane ? p.y : component(p, f.v_axis)) / w;
    const std::uint32_t i = place_of(u), j = place_of(v);
    SurfaceNode* tile = tiles_.root(face);
    while (levels_.splits(*tile)) {
        const int bit = place_bits - 1 - tile->tile.key.level;
        const unsigned quarter = (i >> bit & 1u) | (j >> bit & 1u) << 1;
        const bool waits = levels_.view == nullptr || levels_.view->wait;
        const bool clear = height > tile->child_highest[quarter];
        if (clear && waits) return {height, tile, 0, 0, 0};
        SurfaceNode* const next = child(tiles_, levels_, *tile, quarter);
        if (next == nullptr) break;
        if (clear) return {height, tile, 0, 0, 0};
        tile = next;
    }
    const double x = (u + 1) * tile->half_cells - static_cast<double>(tile->tile.key.i) * tile_cells;
    const double y = (v + 1) * tile->half_cells - static_cast<double>(tile->tile.key.j) * tile_cells;
    const double ci = std::clamp(std::floor(x), 0.0, tile_cells - 1.0),
                 cj = std::clamp(std::floor(y), 0.0, tile_cells - 1.0);
    const Patch patch = patch_of(*tile, static_cast<std::uint32_t>(ci), static_cast<std::uint32_t>(cj),
                                 1 / tiles_.domain().unit_m());
    return {patch.at(x - ci, y - cj), tile, static_cast<std::uint32_t>(cj * tile_cells + ci), x - ci, y - cj};
}

TileCrossing TileTracer::first_crossing(Vec3 origin, Vec3 direction, double t_max) const {
    if (tiles_.domain().is_plane()) return crossing_with_plane(origin, direction, t_max);
    SphereRay ray{{}, direction, 0, length_squared(direction)};
    const double along = -dot(origin, direction) / ray.speed2;
    ray.closest = origin + along * direction;
    ray.miss2 = length_squared(ray.closest);
    const double outer = ray.half_chord(1 + tiles_.largest() + margin),
                 inner = ray.half_chord(1 + tiles_.least() - margin);
    const double begin = std::max(-outer, -along);
    const double end = std::min(outer, t_max - along);
    if (!(begin < end)) return {};
    bool inside = std::abs(begin) < inner;
    if (!inside && begin > -outer) // the origin is in the shell of heights
        inside = ray.height(begin).value < below(ray.at(begin)).t;

    // Nothing is met within the inner sphere, and its centre has no direction.
    const bool through = inner > 0 && begin < inner;
    TileCrossing found;
    bool met = cross_shell(ray, begin, through ? std::min(end, -inner) : end, inside, found);
    if (!met && through && inside) met = cross_shell(ray, inner, end, inside, found);
    if (!met) return {};
    found.t += along;
    if (!(found.t > 0 && found.t < t_max)) return {};
    return found;
}

TileCrossing TileTracer::crossing_with_plane(Vec3 origin, Vec3 direction, double t_max) const {
    double begin = 0, end = t_max;
    if (!PlaneRay::clip_to_box(origin, direction, tiles_.least(), tiles_.largest(), begin, end)) return {};
    const PlaneRay ray{origin + begin * direction, direction};
    // Its sides are walls down to the box's bottom: a ray that comes from outside meets them.
    const bool inside = begin == 0 && ray.height(0).value < below(ray.begin).t;
    TileCrossing found;
    if (!cross_face(ray, 0, 0, end - begin, inside, found)) return {};
    found.t += begin;
    if (!(found.t > 0 && found.t < t_max)) return {};
    return found;
}

TileGradients TileTracer::gradients(const terrain::SurfaceDomain& domain, const SurfaceNode& node,
                                    std::uint32_t cell, double s, double r) {
    const auto i = static_cast<std::int32_t>(cell % tile_cells),
               j = static_cast<std::int32_t>(cell / tile_cells);
    const double per_m = 1 / domain.unit_m();
    const double half_cells = node.half_cells;
    const Patch here = patch_of(node, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), per_m);
    const SlopesAt slopes_at(domain, node);
    const Slopes a = slopes_at(i, j), b = slopes_at(i + 1, j), c = slopes_at(i, j + 1),
                 d = slopes_at(i + 1, j + 1);
    const double along_u = ((1 - r) * ((1 - s) * a.u + s * b.u) + r * ((1 - s) * c.u + s * d.u)) * per_m;
    const double along_v = ((1 - r) * ((1 - s) * a.v + s * b.v) + r * ((1 - s) * c.v + s * d.v)) * per_m;
    const double facet_u = here.hs + r * here.hsr, facet_v = here.hr + s * here.hsr;
    if (domain.is_plane())
        return {{-half_cells * facet_u, -half_cells * facet_v, 1},
                {-half_cells / 2 * along_u, -half_cells / 2 * along_v, 1},
                here.at(s, r)};
    // p on the face's plane at w = 1; gradients of u and v there, for the point at distance 1 from the
    // centre.
    const CubeFace& face = cube_faces[node.tile.key.face];
    const Vec3 q = terrain::cube_point(
        face, (static_cast<double>(node.tile.key.i) * tile_cells + i + s) / half_cells - 1,
        (static_cast<double>(node.tile.key.j) * tile_cells + j + r) / half_cells - 1);
    const double q_length = length(q);
    const double w = (1 + here.at(s, r)) / q_length;
    const Vec3 outwards = face.sign * axis(face.axis);
    const Vec3 u_gradient = (axis(face.u_axis) - component(q, face.u_axis) * outwards) / w;
    const Vec3 v_gradient = (axis(face.v_axis) - component(q, face.v_axis) * outwards) / w;
    const Vec3 up = q / q_length;
    return {up - half_cells * (facet_u * u_gradient + facet_v * v_gradient),
            up - half_cells / 2 * (along_u * u_gradient + along_v * v_gradient), here.at(s, r)};
}

} // namespace obscura::renderer
