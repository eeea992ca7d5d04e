// SPDX-License-Identifier: Apache-2.0
// Rays in the scaled space of a terrain: their parts in tiles and their heights above bilinear patches.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace obscura::renderer::tile_rays {

using terrain::component;
using terrain::cube_faces;
using terrain::CubeFace;
using terrain::pyramid_levels;
using terrain::tile_cells;

/// Added to the unit height below which a node can be met: far above the rounding of a bilinear height.
inline constexpr double margin = 1e-12;
/// Places on a face are numbered with so many bits to find the node that holds two of them.
inline constexpr int place_bits = 31;

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

inline Patch patch_of(const SurfaceNode& node, std::uint32_t i, std::uint32_t j, double per_m) {
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

/// Ray about its point of closest approach to the centre, where the parameter x is 0: nothing cancels.
struct SphereRay {
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
struct PlaneRay {
    Vec3 begin, direction;

    using Height = SphereRay::Height;
    /// Narrows [begin, end] to where a ray is in the box of heights over the square; false: nowhere.
    [[nodiscard]] static bool clip_to_box(Vec3 origin, Vec3 direction, double least, double largest,
                                          double& begin, double& end) {
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
        slab(origin.z, direction.z, least - margin, largest + margin);
        return begin < end;
    }
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

/// Number of a coordinate, -1 to 1, among 2^place_bits.
inline std::uint32_t place_of(double coordinate) {
    constexpr double half = double{1u << (place_bits - 1)};
    return static_cast<std::uint32_t>(std::clamp((coordinate + 1) * half, 0.0, 2 * half - 1));
}

/// The part of a ray within a node of a tile's pyramid: (i, j) of 2^level x 2^level cells.
struct Part {
    double from, to;
    SurfaceNode* tile;
    std::int32_t level;
    std::uint32_t i, j;
};

/// The parts of a ray in the tiles that it takes on one face, from front to back. `Child(node, quarter)`: the
/// made child, or null.
template<typename Ray>
class TileWalk {
public:
    /// From `from` to `to` on the face with the root `root`; `inside`: the ray is below the surface, and no
    /// tile is too low for it.
    template<typename Child>
    void start(const Ray& ray, const FaceLines& lines, SurfaceNode* root, double from, double to, bool inside,
               const LevelChoice& levels, const Child& child) {
        waiting_ = 0;
        // u and v grow or fall along the whole ray: begin at the smallest node with both ends.
        const double w0 = 1 / lines.w(from), w1 = 1 / lines.w(to);
        const std::uint32_t i = place_of(lines.u(from) * w0), j = place_of(lines.v(from) * w0);
        const int same = place_bits - static_cast<int>(std::bit_width((i ^ place_of(lines.u(to) * w1)) |
                                                                      (j ^ place_of(lines.v(to) * w1))));
        SurfaceNode* tile = root;
        for (;;) {
            const int depth = tile->tile.key.level;
            const bool splits = levels.splits(*tile);
            if (splits && depth >= same) {
                stack_[waiting_++] = {from, to, tile, pyramid_levels, 0, 0};
                return;
            }
            if (splits) {
                const int bit = place_bits - 1 - depth;
                const unsigned quarter = (i >> bit & 1u) | (j >> bit & 1u) << 1;
                if (!inside && !ray.clip(tile->child_highest[quarter], from, to)) return;
                if (SurfaceNode* const next = child(*tile, quarter); next != nullptr) {
                    tile = next;
                    continue;
                }
            }
            const int within = std::min(same - depth, pyramid_levels);
            const int shift = place_bits - depth - within;
            const std::uint32_t mask = (1u << within) - 1;
            stack_[waiting_++] = {
                from, to, tile, pyramid_levels - within, i >> shift & mask, j >> shift & mask};
            return;
        }
    }

    /// The next part, which is under the highest vertex of its node unless `inside`; false: no more.
    template<typename Child>
    bool next(const Ray& ray, const FaceLines& lines, bool inside, double per_m, const LevelChoice& levels,
              const Child& child, Part& part) {
        while (waiting_ > 0) {
            part = stack_[--waiting_];
            if (part.level == unresolved) {
                const unsigned quarter = part.i;
                if (!inside && !ray.clip(part.tile->child_highest[quarter], part.from, part.to)) continue;
                if (SurfaceNode* const made = child(*part.tile, quarter); made != nullptr)
                    part = {part.from, part.to, made, pyramid_levels, 0, 0};
                else
                    part = {part.from, part.to, part.tile, pyramid_levels - 1, quarter & 1u, quarter >> 1};
            }
            const SurfaceNode& node = *part.tile;
            if (part.level == pyramid_levels && levels.splits(node)) {
                const Middle middle(node, part, lines);
                const Cuts cuts(part.from, part.to, middle.u.root(), middle.v.root());
                for (std::size_t k = cuts.count; k-- > 0;) { // the first one last, to be next
                    const double at = (cuts.at[k] + cuts.at[k + 1]) / 2;
                    const std::uint32_t quarter =
                        (middle.u(at) >= 0 ? 1u : 0u) | (middle.v(at) >= 0 ? 2u : 0u);
                    stack_[waiting_++] = {cuts.at[k], cuts.at[k + 1], part.tile, unresolved, quarter, 0};
                }
                continue;
            }
            if (inside || part.level == 0 ||
                ray.clip(node.tile.maximum_m(part.level, part.i, part.j) * per_m, part.from, part.to))
                return true;
        }
        return false;
    }

    /// Lines that are 0 on the middle planes of a node.
    struct Middle {
        Line u, v;

        Middle(const SurfaceNode& node, const Part& part, const FaceLines& lines) {
            const double half_width = static_cast<double>(1u << (part.level - 1));
            const double first_i = static_cast<double>(node.tile.key.i) * tile_cells,
                         first_j = static_cast<double>(node.tile.key.j) * tile_cells;
            const double u_middle = (first_i + (2 * part.i + 1) * half_width) / node.half_cells - 1;
            const double v_middle = (first_j + (2 * part.j + 1) * half_width) / node.half_cells - 1;
            u = {lines.u.a - u_middle * lines.w.a, lines.u.b - u_middle * lines.w.b};
            v = {lines.v.a - v_middle * lines.w.a, lines.v.b - v_middle * lines.w.b};
        }
    };

private:
    /// Level of a part that is quarter i of a tile, whose own tile is not looked up yet.
    static constexpr std::int32_t unresolved = -1;

    std::array<Part, 2 * terrain::deepest_level + 6> stack_; ///< each step down leaves at most two
    std::size_t waiting_ = 0;
};

/// Planes between the faces cut the ray from `from` to `to` into at most seven parts.
struct FaceCuts {
    std::array<double, 8> at{};
    std::size_t count = 0;

    FaceCuts() = default;
    FaceCuts(const SphereRay& ray, double from, double to) {
        const Vec3 c = ray.closest, d = ray.direction;
        at[count++] = from;
        for (const Line plane :
             {Line{c.x - c.y, d.x - d.y}, Line{c.x + c.y, d.x + d.y}, Line{c.y - c.z, d.y - d.z},
              Line{c.y + c.z, d.y + d.z}, Line{c.z - c.x, d.z - d.x}, Line{c.z + c.x, d.z + d.x}}) {
            const double x = plane.root();
            if (!(x > from && x < to)) continue;
            std::size_t k = count++;
            for (; at[k - 1] > x; --k)
                at[k] = at[k - 1];
            at[k] = x;
        }
        at[count] = to;
    }
};

} // namespace obscura::renderer::tile_rays
