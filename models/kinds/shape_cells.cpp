// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/shape_cells.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::models {
namespace {

/// Beyond, a slope counts as infinite, for functions in metres or in any other unit that is sane.
constexpr double max_sane_slope = 1e100;
/// Cells are bounded a little beyond their faces: rays are found on either side of them.
constexpr double cell_overlap = 1e-9;

bool is_bounded(const SlopeBounds& b) {
    return b.max_slope() < max_sane_slope;
}

/// Whether smaller cells would let rays go farther in a step.
bool is_loose(const SlopeBounds& b) {
    if (b.bends_up || b.bends_down || !(b.max_bend() < max_sane_slope)) return true;
    return b.gradient[0].has(0) && b.gradient[1].has(0) && b.gradient[2].has(0);
}

ShapeCell cell_of(const SlopeBounds& b) {
    ShapeCell cell;
    cell.state = b.value.lo > 0   ? ShapeCell::State::outside
                 : b.value.hi < 0 ? ShapeCell::State::inside
                                  : ShapeCell::State::surface;
    cell.bends_up = b.bends_up;
    cell.bends_down = b.bends_down;
    cell.max_slope = b.max_slope();
    cell.max_bend = b.max_bend();
    if (!(cell.max_bend < max_sane_slope)) cell.bends_up = cell.bends_down = true;
    cell.gradient = b.gradient;
    return cell;
}

double axis_of(Vec3 v, int k) {
    return k == 0 ? v.x : k == 1 ? v.y : v.z;
}

/// Where a ray leaves the range from `low` to `high` of one coordinate.
double leaves_at(double origin, double direction, double low, double high) {
    if (direction == 0) return std::numeric_limits<double>::infinity();
    return ((direction > 0 ? high : low) - origin) / direction;
}

} // namespace

ShapeCells::ShapeCells(const ShapeCell& everywhere) : cells_{everywhere} {
    cells_[0].state = ShapeCell::State::surface;
}

ShapeCells::ShapeCells(double radius_m,
                       const std::function<SlopeBounds(const std::array<Interval, 3>&, Vec3)>& bound_over)
    : half_edge_(radius_m * (1 + 1e-6)) {
    slots_.resize(static_cast<std::size_t>(side) * side * side);
    const double edge = 2 * half_edge_ / side;
    std::size_t slot = 0;
    for (std::int32_t z = 0; z < side; ++z)
        for (std::int32_t y = 0; y < side; ++y)
            for (std::int32_t x = 0; x < side; ++x, ++slot) {
                const Vec3 low{x * edge - half_edge_, y * edge - half_edge_, z * edge - half_edge_};
                const Vec3 nearest{std::clamp(0.0, low.x, low.x + edge), std::clamp(0.0, low.y, low.y + edge),
                                   std::clamp(0.0, low.z, low.z + edge)};
                if (length(nearest) > half_edge_) { // rays never come here
                    slots_[slot] = static_cast<std::int32_t>(cells_.size());
                    cells_.emplace_back();
                    continue;
                }
                divide(slot, low, edge, 0, bound_over);
            }
}

void ShapeCells::divide(std::size_t slot, Vec3 low, double edge, int divisions,
                        const std::function<SlopeBounds(const std::array<Interval, 3>&, Vec3)>& bound_over) {
    const double more = cell_overlap * half_edge_;
    const std::array<Interval, 3> box{Interval{low.x - more, low.x + edge + more},
                                      Interval{low.y - more, low.y + edge + more},
                                      Interval{low.z - more, low.z + edge + more}};
    const Vec3 middle = low + Vec3{edge / 2, edge / 2, edge / 2};
    const SlopeBounds bounds = bound_over(box, middle);
    ++boxes_;
    const ShapeCell cell = cell_of(bounds);
    const bool surface = cell.state == ShapeCell::State::surface;
    const bool bounded = is_bounded(bounds);
    const int limit = bounded ? max_divisions : max_divisions_without_bound;
    if (surface && divisions < limit && boxes_ < max_boxes && (!bounded || is_loose(bounds))) {
        const std::size_t first = slots_.size();
        slots_.resize(first + 8);
        slots_[slot] = ~static_cast<std::int32_t>(first);
        const double half = edge / 2;
        for (std::size_t k = 0; k < 8; ++k)
            divide(first + k,
                   low + Vec3{(k & 1) != 0 ? half : 0, (k & 2) != 0 ? half : 0, (k & 4) != 0 ? half : 0},
                   half, divisions + 1, bound_over);
        return;
    }
    if (surface && !bounded && !unbounded_) {
        unbounded_ = true;
        unbounded_at_ = middle;
    }
    slots_[slot] = static_cast<std::int32_t>(cells_.size());
    cells_.push_back(cell);
}

ShapeCells::Found ShapeCells::find(Vec3 origin, Vec3 direction, double s) const noexcept {
    if (half_edge_ == 0) return {cells_.data(), std::numeric_limits<double>::infinity()};
    const Vec3 p = origin + s * direction;
    double edge = 2 * half_edge_ / side;
    std::array<double, 3> low{};
    std::size_t slot = 0;
    for (int k = 2; k >= 0; --k) {
        const double at = std::floor((axis_of(p, k) + half_edge_) / edge);
        const auto index = static_cast<std::size_t>(std::clamp(at, 0.0, side - 1.0));
        low[static_cast<std::size_t>(k)] = static_cast<double>(index) * edge - half_edge_;
        slot = slot * side + index;
    }
    while (slots_[slot] < 0) {
        edge /= 2;
        std::size_t child = 0;
        for (int k = 0; k < 3; ++k) {
            double& from = low[static_cast<std::size_t>(k)];
            if (axis_of(p, k) < from + edge) continue;
            from += edge;
            child |= std::size_t{1} << k;
        }
        slot = static_cast<std::size_t>(~slots_[slot]) + child;
    }
    // A little beyond the faces, where the bounds hold as well: a ray along a face leaves it all the same.
    const double beyond = cell_overlap / 2 * half_edge_;
    double end = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        const double from = low[static_cast<std::size_t>(k)];
        end = std::min(
            end, leaves_at(axis_of(origin, k), axis_of(direction, k), from - beyond, from + edge + beyond));
    }
    return {&cells_[static_cast<std::size_t>(slots_[slot])], end};
}

std::size_t ShapeCells::surface_cells() const noexcept {
    return static_cast<std::size_t>(std::count_if(cells_.begin(), cells_.end(), [](const ShapeCell& cell) {
        return cell.state == ShapeCell::State::surface;
    }));
}

} // namespace obscura::models
