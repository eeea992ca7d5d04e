// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_tracer.hpp"

#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace obscura::renderer {
namespace {

using terrain::component;
using terrain::cube_faces;
using terrain::CubeFace;
using terrain::pyramid_levels;
using terrain::tile_cells;

/// Added to the unit height below which a node can be met: far above the rounding of a bilinear height.
constexpr double margin = 1e-12;
/// Nodes that wait at once: each step down leaves at most two.
constexpr std::size_t deepest_stack = 96;
/// Places on a face are numbered with so many bits to find the node that holds two of them.
constexpr int place_bits = 31;

/// The part of a ray within a node.
struct Part {
    double from, to;
    SurfaceNode* tile;
    /// Of its pyramid: (i, j) of 2^level x 2^level cells; `unresolved`: quarter i of the tile, whose own tile
    /// is not looked up yet.
    std::int32_t level;
    std::uint32_t i, j;
};
constexpr std::int32_t unresolved = -1;

/// a + b x.
struct Line {
    double a, b;

    [[nodiscard]] double operator()(double x) const { return a + b * x; }
    [[nodiscard]] double root() const { return -a / b; }
};

/// Two lines' roots, if inside an interval, cut it into at most three.
struct Cuts {
    std::array<double, 4> at{};
    std::size_t count = 0;

    Cuts(double from, double to, double a, double b) {
        at[count++] = from;
        const double low = a < b ? a : b, high = a < b ? b : a;
        // A line parallel to a plane gives inf or NaN, which is not inside.
        if (low > from && low < to) at[count++] = low;
        if (high > from && high < to && high != low) at[count++] = high;
        at[count] = to;
    }
};

/// Bilinear patch of one cell in unit heights: H = h + s hs + r hr + s r hsr.
struct Patch {
    double h, hs, hr, hsr;
    double highest;

    [[nodiscard]] double at(double s, double r) const { return h + s * hs + r * (hr + s * hsr); }
};

Patch patch_of(const SurfaceNode& node, std::uint32_t i, std::uint32_t j, double per_m) {
    const float* const low = node.tile.vertex(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j));
    const float* const high = low + terrain::tile_edge;
    const double offset_m = node.tile.offset_m;
    const auto height = [&](float v) { return (offset_m + static_cast<double>(v)) * per_m; };
    const double a = height(low[0]), b = height(low[1]), c = height(high[0]), d = height(high[1]);
    return {a, b - a, c - a, (d - c) - (b - a), std::max(std::max(a, b), std::max(c, d))};
}

/// Components of a ray on a face: u and v are the quotients of their lines by that of w.
struct FaceLines {
    Line u, v, w;
};

} // namespace

/// Ray about its point of closest approach to the centre, where the parameter x is 0: nothing cancels.
struct TileTracer::SphereRay {
    Vec3 closest, direction;
    double miss2;  ///< squared distance of `closest`
    double speed2; ///< squared length of `direction`

    [[nodiscard]] Vec3 at(double x) const { return closest + x * direction; }
    /// Half of the chord inside the sphere of that radius; 0: none.
    [[nodiscard]] double half_chord(double radius) const {
        const double under = (radius * radius - miss2) / speed2;
        return under > 0 ? std::sqrt(under) : 0;
    }
    /// Height above the reference surface, and its derivative.
    struct Height {
        double value, slope;
    };
    [[nodiscard]] Height height(double x) const {
        const double radius = std::sqrt(miss2 + speed2 * (x * x));
        return {radius - 1, speed2 * x / radius};
    }
    /// Narrows an interval to where the ray is below a height; false: nowhere.
    [[nodiscard]] bool clip(double highest, double& from, double& to) const {
        const double half = half_chord(1 + highest + margin);
        from = std::max(from, -half);
        to = std::min(to, half);
        return from < to;
    }
    [[nodiscard]] FaceLines lines(std::size_t face) const {
        const CubeFace& f = cube_faces[face];
        return {{component(closest, f.u_axis), component(direction, f.u_axis)},
                {component(closest, f.v_axis), component(direction, f.v_axis)},
                {f.sign * component(closest, f.axis), f.sign * component(direction, f.axis)}};
    }
};

/// Ray over the plane z = 0 about the point where it comes near it, where the parameter x is 0.
struct TileTracer::PlaneRay {
    Vec3 begin, direction;

    using Height = SphereRay::Height;
    [[nodiscard]] Vec3 at(double x) const { return begin + x * direction; }
    [[nodiscard]] Height height(double x) const { return {begin.z + direction.z * x, direction.z}; }
    [[nodiscard]] bool clip(double highest, double& from, double& to) const {
        const double above = begin.z - (highest + margin);
        const double x = -above / direction.z;
        if (direction.z < 0)
            from = std::max(from, x);
        else if (direction.z > 0)
            to = std::min(to, x);
        else if (above > 0)
            return false;
        return from < to;
    }
    [[nodiscard]] FaceLines lines(std::size_t /*face*/) const {
        return {{begin.x, direction.x}, {begin.y, direction.y}, {1, 0}};
    }
};

namespace {

/// Height of a ray above a patch, as a function of the ray's parameter.
template<typename Ray>
class Clearance {
public:
    struct Value {
        double height, slope;
    };

    /// (i, j): the cell's number on the whole face.
    Clearance(const Ray& ray, const Patch& patch, const FaceLines& lines, double half_cells, double i,
              double j)
        : ray_(ray),
          patch_(patch),
          lines_(lines),
          half_cells_(half_cells),
          i_(half_cells - i),
          j_(half_cells - j) {}

    [[nodiscard]] double s(double x) const { return lines_.u(x) / lines_.w(x) * half_cells_ + i_; }
    [[nodiscard]] double r(double x) const { return lines_.v(x) / lines_.w(x) * half_cells_ + j_; }

    [[nodiscard]] Value operator()(double x) const {
        const double inverse = 1 / lines_.w(x);
        const double u = lines_.u(x) * inverse, v = lines_.v(x) * inverse;
        const double s = u * half_cells_ + i_, r = v * half_cells_ + j_;
        const double s_slope = (lines_.u.b - u * lines_.w.b) * (inverse * half_cells_);
        const double r_slope = (lines_.v.b - v * lines_.w.b) * (inverse * half_cells_);
        const auto height = ray_.height(x);
        return {height.value - patch_.at(s, r), height.slope - s_slope * (patch_.hs + r * patch_.hsr) -
                                                    r_slope * (patch_.hr + s * patch_.hsr)};
    }

    /// The first place in [from, to] where the ray is not above the patch (times `side`: not below it);
    /// no_hit: none. Within a cell the height is a parabola but for the curvature of the body and the
    /// perspective of the face, so that it has at most one minimum.
    [[nodiscard]] double first_root(double from, double to, double side) const {
        const Value low = (*this)(from), high = (*this)(to);
        if (side * low.height <= 0) return from;
        if (side * high.height <= 0) return root(from, to, side);
        if (!(side * low.slope < 0 && side * high.slope > 0)) return no_hit;
        double a = from, b = to, a_slope = side * low.slope, b_slope = side * high.slope;
        for (int step = 0; step < 8; ++step) {
            const double x = a - a_slope * ((b - a) / (b_slope - a_slope));
            if (!(x > a && x < b)) break;
            const Value middle = (*this)(x);
            if (side * middle.height <= 0) return root(from, x, side);
            const double slope = side * middle.slope;
            // The height's lower bound by its tangents at both ends.
            if (std::abs(slope) * (b - a) < side * middle.height) break;
            (slope < 0 ? a : b) = x;
            (slope < 0 ? a_slope : b_slope) = slope;
        }
        return no_hit;
    }

private:
    /// Newton's method, kept within the interval by bisection; side * height is above 0 at `from` and not
    /// above 0 at `to`.
    [[nodiscard]] double root(double from, double to, double side) const {
        double x = (from + to) / 2;
        for (int step = 0; step < 100; ++step) {
            const Value value = (*this)(x);
            (side * value.height > 0 ? from : to) = x;
            double next = x - value.height / value.slope;
            if (!(next > from && next < to)) next = (from + to) / 2;
            if (std::abs(next - x) <= 1e-15 * (std::abs(x) + std::abs(next)) || next == from || next == to)
                return next;
            x = next;
        }
        return to;
    }

    const Ray& ray_;
    const Patch& patch_;
    const FaceLines& lines_;
    double half_cells_, i_, j_;
};

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

/// Number of a coordinate, -1 to 1, among 2^place_bits.
std::uint32_t place_of(double coordinate) {
    constexpr double half = double{1u << (place_bits - 1)};
    return static_cast<std::uint32_t>(std::clamp((coordinate + 1) * half, 0.0, 2 * half - 1));
}

} // namespace

template<typename Ray>
bool TileTracer::cross_face(const Ray& ray, std::size_t face, double from, double to, bool inside,
                            TileCrossing& found) const {
    const FaceLines lines = ray.lines(face);
    const double side = inside ? -1 : 1;
    const double per_m = 1 / tiles_.domain().unit_m();

    // u and v grow or fall along the whole ray: begin at the smallest node with both ends.
    SurfaceNode* tile = tiles_.root(face);
    const double w0 = 1 / lines.w(from), w1 = 1 / lines.w(to);
    const std::uint32_t i = place_of(lines.u(from) * w0), j = place_of(lines.v(from) * w0);
    const int same = place_bits - static_cast<int>(std::bit_width((i ^ place_of(lines.u(to) * w1)) |
                                                                  (j ^ place_of(lines.v(to) * w1))));
    Part start{from, to, tile, pyramid_levels, 0, 0};
    for (;;) {
        const int depth = tile->tile.key.level;
        const bool splits = levels_.splits(*tile);
        if (splits && depth < same) {
            const int bit = place_bits - 1 - depth;
            const unsigned quarter = (i >> bit & 1u) | (j >> bit & 1u) << 1;
            if (!inside && !ray.clip(tile->child_highest[quarter], start.from, start.to)) return false;
            if (SurfaceNode* const next = child(*tile, quarter); next != nullptr) {
                tile = start.tile = next;
                continue;
            }
        }
        // Within this tile, at most as deep as a quarter that is missing.
        if (splits && depth >= same) break;
        const int within = std::min(same - depth, pyramid_levels);
        start.level = pyramid_levels - within;
        const int shift = place_bits - depth - within;
        const std::uint32_t mask = (1u << within) - 1;
        start.i = i >> shift & mask;
        start.j = j >> shift & mask;
        break;
    }

    std::array<Part, deepest_stack> stack;
    std::size_t waiting = 0;
    stack[waiting++] = start;
    while (waiting > 0) {
        Part part = stack[--waiting];
        if (part.level == unresolved) {
            const unsigned quarter = part.i;
            if (!inside && !ray.clip(part.tile->child_highest[quarter], part.from, part.to)) continue;
            if (SurfaceNode* const next = child(*part.tile, quarter); next != nullptr)
                part = {part.from, part.to, next, pyramid_levels, 0, 0};
            else
                part = {part.from, part.to, part.tile, pyramid_levels - 1, quarter & 1u, quarter >> 1};
        }
        const SurfaceNode& node = *part.tile;
        const bool splits = part.level == pyramid_levels && levels_.splits(node);
        Patch cell{};
        if (part.level == 0) cell = patch_of(node, part.i, part.j, per_m);
        if (!inside && !splits) { // the part of the ray that is under the node's highest point
            const double highest =
                part.level == 0 ? cell.highest : node.tile.maximum_m(part.level, part.i, part.j) * per_m;
            if (!ray.clip(highest, part.from, part.to)) continue;
        }
        const double first_i = static_cast<double>(node.tile.key.i) * tile_cells,
                     first_j = static_cast<double>(node.tile.key.j) * tile_cells;
        if (part.level == 0) {
            const Clearance<Ray> clearance(ray, cell, lines, node.half_cells, first_i + part.i,
                                           first_j + part.j);
            const double x = clearance.first_root(part.from, part.to, side);
            if (x == no_hit) continue;
            found = {x, &node, part.j * tile_cells + part.i, std::clamp(clearance.s(x), 0.0, 1.0),
                     std::clamp(clearance.r(x), 0.0, 1.0)};
            return true;
        }
        // The middle planes of the node.
        const double half_width = static_cast<double>(1u << (part.level - 1));
        const double u_middle = (first_i + (2 * part.i + 1) * half_width) / node.half_cells - 1;
        const double v_middle = (first_j + (2 * part.j + 1) * half_width) / node.half_cells - 1;
        const Line in_u{lines.u.a - u_middle * lines.w.a, lines.u.b - u_middle * lines.w.b};
        const Line in_v{lines.v.a - v_middle * lines.w.a, lines.v.b - v_middle * lines.w.b};
        const Cuts cuts(part.from, part.to, in_u.root(), in_v.root());
        for (std::size_t k = cuts.count; k-- > 0;) { // the first one last, to be next
            const double middle = (cuts.at[k] + cuts.at[k + 1]) / 2;
            const std::uint32_t high_u = in_u(middle) >= 0 ? 1 : 0, high_v = in_v(middle) >= 0 ? 1 : 0;
            if (splits)
                stack[waiting++] = {cuts.at[k], cuts.at[k + 1],       part.tile,
                                    unresolved, high_u | high_v << 1, 0};
            else
                stack[waiting++] = {cuts.at[k],     cuts.at[k + 1],      part.tile,
                                    part.level - 1, 2 * part.i + high_u, 2 * part.j + high_v};
        }
    }
    return false;
}

bool TileTracer::cross_shell(const SphereRay& ray, double from, double to, bool inside,
                             TileCrossing& found) const {
    if (!(from < to)) return false;
    // The planes between the faces.
    std::array<double, 8> cuts{};
    std::size_t count = 0;
    const Vec3 c = ray.closest, d = ray.direction;
    cuts[count++] = from;
    for (const Line plane :
         {Line{c.x - c.y, d.x - d.y}, Line{c.x + c.y, d.x + d.y}, Line{c.y - c.z, d.y - d.z},
          Line{c.y + c.z, d.y + d.z}, Line{c.z - c.x, d.z - d.x}, Line{c.z + c.x, d.z + d.x}}) {
        const double x = plane.root();
        if (!(x > from && x < to)) continue;
        std::size_t k = count++;
        for (; cuts[k - 1] > x; --k)
            cuts[k] = cuts[k - 1];
        cuts[k] = x;
    }
    cuts[count] = to;
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t face = terrain::cube_face_of(ray.at((cuts[k] + cuts[k + 1]) / 2));
        if (cross_face(ray, face, cuts[k], cuts[k + 1], inside, found)) return true;
    }
    return false;
}

TileCrossing TileTracer::below(Vec3 p) const {
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
        SurfaceNode* const next = child(*tile, (i >> bit & 1u) | (j >> bit & 1u) << 1);
        if (next == nullptr) break;
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
    // The part of the ray in the box of heights over the square.
    double begin = 0, end = t_max;
    const auto slab = [&](double at, double step, double low, double high) {
        if (step == 0) {
            if (at < low || at > high) end = -1;
            return;
        }
        const double a = (low - at) / step, b = (high - at) / step;
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    };
    slab(origin.x, direction.x, -1, 1);
    slab(origin.y, direction.y, -1, 1);
    slab(origin.z, direction.z, tiles_.least() - margin, tiles_.largest() + margin);
    if (!(begin < end)) return {};
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
