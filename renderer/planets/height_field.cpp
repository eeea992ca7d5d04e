// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/height_field.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Added to the radius below which a node can be met: far above the rounding of a bilinear height.
constexpr double margin = 1e-12;
/// Nodes that wait at once: every level leaves at most two.
constexpr std::size_t deepest_stack = 64;

/// The part of a ray within a node of the quadtree: cells of 2^level edges, number (i, j) from -1, -1.
struct Node {
    double from, to;
    std::uint32_t i, j;
    int level;
};

/// Smaller and larger root of two lines, if inside an interval, cut it into at most three.
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

/// a + b x.
struct Line {
    double a, b;

    [[nodiscard]] double operator()(double x) const { return a + b * x; }
    [[nodiscard]] double root() const { return -a / b; }
};

} // namespace

/// Ray about its point of closest approach to the centre, where the parameter x is 0: nothing cancels.
struct HeightField::Ray {
    Vec3 closest, direction;
    double miss2;  ///< squared distance of `closest`
    double speed2; ///< squared length of `direction`

    [[nodiscard]] Vec3 at(double x) const { return closest + x * direction; }
    [[nodiscard]] double radius(double x) const { return std::sqrt(miss2 + speed2 * (x * x)); }
    /// Half of the chord inside the sphere of that radius; 0: none.
    [[nodiscard]] double half_chord(double radius) const {
        const double under = (radius * radius - miss2) / speed2;
        return under > 0 ? std::sqrt(under) : 0;
    }
};

/// Bilinear patch of one cell: H = h + s hs + r hr + s r hsr.
struct HeightField::Patch {
    double h, hs, hr, hsr;
    double highest;

    [[nodiscard]] double at(double s, double r) const { return h + s * hs + r * (hr + s * hsr); }
};

HeightField::HeightField(std::uint32_t cells_per_edge, const std::function<double(Vec3)>& height)
    : cells_(cells_per_edge), levels_(std::bit_width(cells_per_edge) - 1), stride_(cells_per_edge + 3) {
    if (!std::has_single_bit(cells_) || cells_ < 2 || cells_ > most_cells_per_edge)
        throw ConfigError(fmt::format("cells_per_edge {}: allowed is a power of two from 2 to {}", cells_,
                                      most_cells_per_edge));
    heights_.resize(terrain::cube_face_count * stride_ * stride_);
    const double width = 2.0 / cells_;
    tbb::parallel_for(std::size_t{0}, terrain::cube_face_count * stride_, [&](std::size_t row) {
        const terrain::CubeFace& face = terrain::cube_faces[row / stride_];
        float* const line = heights_.data() + row * stride_;
        const double v = -1 + (static_cast<double>(row % stride_) - 1) * width;
        for (std::size_t i = 0; i < stride_; ++i)
            line[i] = static_cast<float>(
                height(normalized(terrain::cube_point(face, -1 + (static_cast<double>(i) - 1) * width, v))));
    });
    make_maxima();
}

std::uint64_t HeightField::bytes(std::uint32_t cells_per_edge) {
    const std::uint64_t edge = cells_per_edge + 3ull;
    return terrain::cube_face_count * (edge * edge + edge * edge / 3) * sizeof(float);
}

void HeightField::make_maxima() {
    level_offset_.assign(static_cast<std::size_t>(levels_) + 1, 0);
    for (int level = 1; level <= levels_; ++level) {
        level_offset_[static_cast<std::size_t>(level)] = maxima_per_face_;
        maxima_per_face_ += std::size_t{cells_ >> level} * (cells_ >> level);
    }
    maxima_.resize(terrain::cube_face_count * maxima_per_face_);
    tbb::parallel_for(std::size_t{0}, terrain::cube_face_count, [&](std::size_t face) {
        float* const out = maxima_.data() + face * maxima_per_face_;
        const std::uint32_t pairs = cells_ / 2;
        for (std::uint32_t j = 0; j < pairs; ++j)
            for (std::uint32_t i = 0; i < pairs; ++i) {
                float most = *vertex(face, 2 * i, 2 * j);
                for (std::uint32_t k = 0; k < 9; ++k)
                    most = std::max(most, *vertex(face, 2 * i + k % 3, 2 * j + k / 3));
                out[std::size_t{j} * pairs + i] = most;
            }
        for (int level = 2; level <= levels_; ++level) {
            const float* const finer = out + level_offset_[static_cast<std::size_t>(level) - 1];
            float* const here = out + level_offset_[static_cast<std::size_t>(level)];
            const std::size_t edge = cells_ >> level;
            for (std::size_t j = 0; j < edge; ++j)
                for (std::size_t i = 0; i < edge; ++i) {
                    const float* const four = finer + 4 * edge * j + 2 * i;
                    here[edge * j + i] =
                        std::max(std::max(four[0], four[1]), std::max(four[2 * edge], four[2 * edge + 1]));
                }
        }
    });
    float least = heights_[0], largest = least;
    for (std::size_t face = 0; face < terrain::cube_face_count; ++face)
        for (std::uint32_t j = 0; j <= cells_; ++j) {
            const float* const line = vertex(face, 0, j);
            const auto [low, high] = std::minmax_element(line, line + cells_ + 1);
            least = std::min(least, *low);
            largest = std::max(largest, *high);
        }
    least_ = least;
    largest_ = largest;
    if (!(least_ > -0.9 && largest_ < 10))
        throw InputError(
            fmt::format("heights from {:.3g} to {:.3g} radii: allowed is -0.9 to 10", least_, largest_));
}

float HeightField::maximum(std::size_t face, int level, std::uint32_t i, std::uint32_t j) const {
    return maxima_[face * maxima_per_face_ + level_offset_[static_cast<std::size_t>(level)] +
                   std::size_t{j} * (cells_ >> level) + i];
}

HeightField::Patch HeightField::patch(std::size_t face, std::uint32_t i, std::uint32_t j) const {
    const float* const low = vertex(face, i, j);
    const float* const high = low + stride_;
    const double a = low[0], b = low[1], c = high[0], d = high[1];
    return {a, b - a, c - a, (d - c) - (b - a), std::max(std::max(a, b), std::max(c, d))};
}

HeightField::Crossing HeightField::first_crossing(Vec3 origin, Vec3 direction, double t_max) const {
    Ray ray{{}, direction, 0, length_squared(direction)};
    const double along = -dot(origin, direction) / ray.speed2;
    ray.closest = origin + along * direction;
    ray.miss2 = length_squared(ray.closest);
    const double outer = ray.half_chord(1 + largest_ + margin), inner = ray.half_chord(1 + least_ - margin);
    const double begin = std::max(-outer, -along);
    const double end = std::min(outer, t_max - along);
    if (!(begin < end)) return {};
    bool inside = std::abs(begin) < inner;
    if (!inside && begin > -outer) // the origin is in the shell of heights
        inside = ray.radius(begin) < 1 + height(ray.at(begin));

    // Nothing is met within the inner sphere, and its centre has no direction.
    const bool through = inner > 0 && begin < inner;
    Crossing found;
    bool met = cross_shell(ray, begin, through ? std::min(end, -inner) : end, inside, found);
    if (!met && through && inside) met = cross_shell(ray, inner, end, inside, found);
    if (!met) return {};
    found.t += along;
    if (!(found.t > 0 && found.t < t_max)) return {};
    return found;
}

bool HeightField::cross_shell(const Ray& ray, double from, double to, bool inside, Crossing& found) const {
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

namespace {

/// Height of a ray above a patch, as a function of the ray's parameter.
template<typename Ray, typename Patch>
class Clearance {
public:
    struct Value {
        double height, slope;
    };

    Clearance(const Ray& ray, const Patch& patch, const terrain::CubeFace& face, double half_cells, double i,
              double j)
        : ray_(ray),
          patch_(patch),
          w_{face.sign * terrain::component(ray.closest, face.axis),
             face.sign * terrain::component(ray.direction, face.axis)},
          u_{terrain::component(ray.closest, face.u_axis), terrain::component(ray.direction, face.u_axis)},
          v_{terrain::component(ray.closest, face.v_axis), terrain::component(ray.direction, face.v_axis)},
          half_cells_(half_cells),
          i_(half_cells - i),
          j_(half_cells - j) {}

    [[nodiscard]] double s(double x) const { return u_(x) / w_(x) * half_cells_ + i_; }
    [[nodiscard]] double r(double x) const { return v_(x) / w_(x) * half_cells_ + j_; }

    [[nodiscard]] Value operator()(double x) const {
        const double inverse = 1 / w_(x);
        const double u = u_(x) * inverse, v = v_(x) * inverse;
        const double s = u * half_cells_ + i_, r = v * half_cells_ + j_;
        const double s_slope = (u_.b - u * w_.b) * (inverse * half_cells_);
        const double r_slope = (v_.b - v * w_.b) * (inverse * half_cells_);
        const double radius = ray_.radius(x);
        return {radius - 1 - patch_.at(s, r), ray_.speed2 * x / radius -
                                                  s_slope * (patch_.hs + r * patch_.hsr) -
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
    Line w_, u_, v_;
    double half_cells_, i_, j_;
};

} // namespace

bool HeightField::cross_face(const Ray& ray, std::size_t face_number, double from, double to, bool inside,
                             Crossing& found) const {
    const terrain::CubeFace& face = terrain::cube_faces[face_number];
    const Line w{face.sign * terrain::component(ray.closest, face.axis),
                 face.sign * terrain::component(ray.direction, face.axis)};
    const Line u{terrain::component(ray.closest, face.u_axis),
                 terrain::component(ray.direction, face.u_axis)};
    const Line v{terrain::component(ray.closest, face.v_axis),
                 terrain::component(ray.direction, face.v_axis)};
    const double side = inside ? -1 : 1;

    std::array<Node, deepest_stack> stack;
    std::size_t waiting = 0;
    // u and v grow or fall along the whole ray: begin at the smallest node with both ends.
    const auto number = [&](const Line& along, double x) {
        const double cell = (along(x) / w(x) + 1) * (cells_ / 2.0);
        return static_cast<std::uint32_t>(std::clamp(cell, 0.0, cells_ - 1.0));
    };
    const std::uint32_t i = number(u, from), j = number(v, from);
    const int level = std::bit_width((i ^ number(u, to)) | (j ^ number(v, to)));
    stack[waiting++] = {from, to, i >> level, j >> level, level};
    while (waiting > 0) {
        Node node = stack[--waiting];
        Patch cell{};
        double highest = 0;
        if (node.level == 0) {
            cell = patch(face_number, node.i, node.j);
            highest = cell.highest;
        } else {
            highest = static_cast<double>(maximum(face_number, node.level, node.i, node.j));
        }
        if (!inside) { // the part of the ray that is under the node's highest point
            const double half = ray.half_chord(1 + highest + margin);
            node.from = std::max(node.from, -half);
            node.to = std::min(node.to, half);
            if (!(node.from < node.to)) continue;
        }
        if (node.level == 0) {
            const Clearance clearance(ray, cell, face, cells_ / 2.0, node.i, node.j);
            const double x = clearance.first_root(node.from, node.to, side);
            if (x == no_hit) continue;
            found = {x, static_cast<std::uint32_t>((face_number * cells_ + node.j) * cells_ + node.i),
                     std::clamp(clearance.s(x), 0.0, 1.0), std::clamp(clearance.r(x), 0.0, 1.0)};
            return true;
        }
        const double width = 2.0 / (cells_ >> (node.level - 1));
        const double u_middle = -1 + (2.0 * node.i + 1) * width, v_middle = -1 + (2.0 * node.j + 1) * width;
        const Line in_u{u.a - u_middle * w.a, u.b - u_middle * w.b};
        const Line in_v{v.a - v_middle * w.a, v.b - v_middle * w.b};
        const Cuts cuts(node.from, node.to, in_u.root(), in_v.root());
        for (std::size_t k = cuts.count; k-- > 0;) { // the first one last, to be next
            const double middle = (cuts.at[k] + cuts.at[k + 1]) / 2;
            stack[waiting++] = {cuts.at[k], cuts.at[k + 1], 2 * node.i + (in_u(middle) >= 0 ? 1u : 0u),
                                2 * node.j + (in_v(middle) >= 0 ? 1u : 0u), node.level - 1};
        }
    }
    return false;
}

double HeightField::height(Vec3 p) const {
    const std::size_t number = terrain::cube_face_of(p);
    const terrain::CubeFace& face = terrain::cube_faces[number];
    const double w = face.sign * terrain::component(p, face.axis);
    const double x = (terrain::component(p, face.u_axis) / w + 1) * (cells_ / 2.0);
    const double y = (terrain::component(p, face.v_axis) / w + 1) * (cells_ / 2.0);
    const double i = std::clamp(std::floor(x), 0.0, cells_ - 1.0),
                 j = std::clamp(std::floor(y), 0.0, cells_ - 1.0);
    return patch(number, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)).at(x - i, y - j);
}

HeightField::Gradients HeightField::gradients(std::uint32_t cell, double s, double r) const {
    const std::uint32_t i = cell % cells_, j = cell / cells_ % cells_;
    const std::size_t number = cell / cells_ / cells_;
    const terrain::CubeFace& face = terrain::cube_faces[number];
    const double half_cells = cells_ / 2.0;
    const Patch here = patch(number, i, j);
    const float* const v = vertex(number, i, j);
    const auto n = static_cast<std::ptrdiff_t>(stride_);
    // Differences across two cells, at the four vertices.
    const auto along_u = [&](const float* at) { return static_cast<double>(at[1] - at[-1]); };
    const auto along_v = [&](const float* at) { return static_cast<double>(at[n] - at[-n]); };
    const auto between = [&](const auto& of) {
        return (1 - r) * ((1 - s) * of(v) + s * of(v + 1)) + r * ((1 - s) * of(v + n) + s * of(v + n + 1));
    };
    // p on the face's plane at w = 1; gradients of u and v there, for the point at distance 1 from the
    // centre.
    const Vec3 q = terrain::cube_point(face, (i + s) / half_cells - 1, (j + r) / half_cells - 1);
    const double q_length = length(q);
    const double radius = 1 + here.at(s, r);
    const auto axis = [](int k) { return Vec3{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; };
    const Vec3 outwards = face.sign * axis(face.axis);
    const double w = radius / q_length;
    const Vec3 u_gradient = (axis(face.u_axis) - terrain::component(q, face.u_axis) * outwards) / w;
    const Vec3 v_gradient = (axis(face.v_axis) - terrain::component(q, face.v_axis) * outwards) / w;
    const Vec3 up = q / q_length;
    return {up - half_cells * ((here.hs + r * here.hsr) * u_gradient + (here.hr + s * here.hsr) * v_gradient),
            up - half_cells / 2 * (between(along_u) * u_gradient + between(along_v) * v_gradient)};
}

} // namespace obscura::renderer
