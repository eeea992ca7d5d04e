// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/shape_march.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::models {
namespace {

constexpr double beyond_all = std::numeric_limits<double>::infinity();

// Lengths in radii of the bounding ball.
constexpr double start_rounding = 0x1p-46; ///< depth of origins that lie on the surface
constexpr double root_tolerance = 1e-14;   ///< of the distance of a hit
constexpr double smooth_step = 1e-9;       ///< no root is missed in it where the slope is smooth
constexpr double bent_step = 1e-12;        ///< and elsewhere; a surface as near as that is hit
constexpr double probe_step = 1e-7;        ///< steps as short as that try Newton's root
/// Largest second derivative with which smooth steps are as short as that, over the slope.
constexpr double max_smooth_bend = 1e6;
constexpr int max_root_steps = 100;

/// Progress of one ray. Distances are counted from the point nearest to the shape's origin, values are
/// positive on the side where the ray comes from.
class RayMarch {
public:
    void begin(const ShapeProgram& shape, Vec3 origin, Vec3 direction, double t_max, double origin_error_m);
    /// Goes to the next point where the value is wanted; false: the ray is at its end.
    [[nodiscard]] bool find_point();
    [[nodiscard]] Vec3 point() const { return closest_ + s_ * direction_; }
    void take(double value, Vec3 gradient);

    [[nodiscard]] double t() const { return hit_; }
    [[nodiscard]] bool is_doubtful() const { return doubtful_; }

private:
    void start(double value, double slope, double steepness);
    void walk(double value, double slope);
    void probe(double value);
    void narrow(double value, double slope);
    void begin_root(double from, double from_value, double to, double to_value);
    void check(double value);
    void step_from(double value, double slope);
    [[nodiscard]] double safe_step(double value, double slope, double fall) const;
    void hit_at(double s);
    void end() { done_ = true; }

    enum class Phase : std::uint8_t { start, walk, probe, root };

    const ShapeProgram* shape_ = nullptr;
    Vec3 closest_{}, direction_{};
    double radius_m_ = 0, along_ = 0, origin_error_m_ = 0;
    double s_ = 0, end_ = 0, hit_ = beyond_all;
    double side_ = 1; ///< -1: the ray starts inside
    ShapeCells::Found in_{};
    // The point before, and how much the value may change with the way from there.
    double before_ = 0, value_before_ = 0, max_rate_ = beyond_all;
    double slope_before_ = 0;
    // Bracket of a root: positive at low_, negative at high_.
    double low_ = 0, high_ = 0, low_value_ = 0, high_value_ = 0, width_ = 0;
    Phase phase_ = Phase::start;
    int steps_ = 0, root_steps_ = 0;
    bool done_ = true, doubtful_ = false, has_before_ = false;
};

void RayMarch::begin(const ShapeProgram& shape, Vec3 origin, Vec3 direction, double t_max,
                     double origin_error_m) {
    shape_ = &shape;
    direction_ = direction;
    radius_m_ = shape.bounding_radius_m();
    origin_error_m_ = origin_error_m;
    along_ = -dot(origin, direction);
    closest_ = origin + along_ * direction;
    const double rest = radius_m_ * radius_m_ - length_squared(closest_);
    if (!(rest > 0) || !(t_max > 0)) return;
    const double half = std::sqrt(rest);
    s_ = std::max(-half, -along_);
    end_ = std::min(half, t_max - along_);
    done_ = !(s_ < end_);
    // A ray that comes from outside of the ball starts outside of the body.
    if (s_ > -along_) phase_ = Phase::walk;
}

bool RayMarch::find_point() {
    if (done_) return false;
    if (phase_ == Phase::probe || phase_ == Phase::root) return true;
    for (;;) {
        if (!(s_ < end_)) {
            end();
            return false;
        }
        in_ = shape_->cells().find(closest_, direction_, s_);
        if (phase_ == Phase::start || in_.cell->state == ShapeCell::State::surface) break;
        // Nothing in the cell; one of the other side cannot come next unless the value jumps.
        const bool other = (in_.cell->state == ShapeCell::State::inside) == (side_ > 0);
        if (other) break;
        s_ = in_.end;
        has_before_ = false;
    }
    if (++steps_ <= max_shape_steps) return true;
    // Out of steps: near the surface it counts as one.
    doubtful_ = true;
    if (has_before_ && value_before_ < 1e-6 * radius_m_ * in_.cell->max_slope)
        hit_at(s_);
    else
        end();
    return false;
}

void RayMarch::hit_at(double s) {
    const double t = along_ + s;
    if (s <= end_) hit_ = std::max(t, std::numeric_limits<double>::min());
    end();
}

void RayMarch::take(double value, Vec3 gradient) {
    const double slope = dot(gradient, direction_);
    if (!std::isfinite(value)) { // nothing is known: go on behind the cell
        doubtful_ = true;
        if (phase_ == Phase::root) return hit_at(low_);
        s_ = std::min(in_.end, s_ + 0.01 * radius_m_);
        has_before_ = false;
        phase_ = Phase::walk;
        return;
    }
    // Steps were no longer than a smaller slope allows: what they have passed is not known.
    if (length(gradient) > in_.cell->max_slope * (1 + 1e-6)) doubtful_ = true;
    const double rate = std::isfinite(slope) ? slope : 0;
    switch (phase_) {
    case Phase::start:
        return start(value, rate, length(gradient));
    case Phase::walk:
        return walk(side_ * value, side_ * rate);
    case Phase::probe:
        return probe(side_ * value);
    case Phase::root:
        return narrow(side_ * value, side_ * rate);
    }
}

void RayMarch::start(double value, double slope, double steepness) {
    phase_ = Phase::walk;
    const double depth =
        (start_rounding * radius_m_ + origin_error_m_) * (std::isfinite(steepness) ? steepness : 0);
    if (!(std::abs(value) <= depth)) {
        side_ = value > 0 ? 1 : -1;
        return step_from(side_ * value, side_ * slope);
    }
    if (slope <= 0 && value <= 0) return hit_at(s_);
    // On the surface, and on the way out.
    step_from(std::max(value, 0.0), slope);
}

/// The value may not change by more than the bounds of the cell allow.
void RayMarch::check(double value) {
    if (!has_before_) return;
    const double way = s_ - before_;
    const double allowed =
        max_rate_ * way * (1 + 1e-6) + 1e-12 * (std::abs(value_before_) + max_rate_ * radius_m_);
    if (std::abs(value - value_before_) > allowed) doubtful_ = true;
}

void RayMarch::walk(double value, double slope) {
    check(value);
    if (value <= 0) {
        if (!has_before_ || value == 0) return hit_at(s_);
        return begin_root(before_, value_before_, s_, value);
    }
    step_from(value, slope);
}

double RayMarch::safe_step(double value, double slope, double fall) const {
    const double by_slope = fall > 0 ? value / fall : beyond_all;
    const ShapeCell& cell = *in_.cell;
    if (side_ > 0 ? cell.bends_down : cell.bends_up) return by_slope;
    const double bend = cell.max_bend;
    const double root = std::sqrt(slope * slope + 2 * bend * value);
    double by_bend = beyond_all;
    if (slope < 0)
        by_bend = 2 * value / (root - slope);
    else if (bend > 0)
        by_bend = (slope + root) / bend;
    return std::max(by_slope, by_bend);
}

void RayMarch::step_from(double value, double slope) {
    const ShapeCell& cell = *in_.cell;
    Interval rate{};
    const std::array<double, 3> d{direction_.x, direction_.y, direction_.z};
    if (shape_->claimed_slope() > 0) {
        rate = {-cell.max_slope, cell.max_slope};
    } else {
        for (std::size_t k = 0; k < 3; ++k)
            rate = rate + Interval::at(side_ * d[k]) * cell.gradient[k];
    }
    max_rate_ = rate.magnitude();
    before_ = s_;
    value_before_ = value;
    slope_before_ = slope;
    has_before_ = true;
    double step = safe_step(value, slope, -rate.lo);
    const bool rough = side_ > 0 ? cell.bends_down : cell.bends_up;
    const bool smooth = !cell.bends_up && !cell.bends_down;
    if (smooth && slope < 0) {
        // Newton's root is exact once the second order is nothing.
        const double newton = value / -slope;
        if (newton * (cell.max_bend * value / (slope * slope)) < root_tolerance * radius_m_ &&
            s_ + newton <= in_.end)
            return hit_at(s_ + newton);
    }
    if (rough || !smooth) {
        if (slope < 0 && step < bent_step * radius_m_) return hit_at(s_ + std::min(step, value / -slope));
        if (slope < 0 && step < probe_step * radius_m_) {
            phase_ = Phase::probe;
            s_ = before_ + std::min(2 * value / -slope, 10 * probe_step * radius_m_);
            return;
        }
    }
    const bool gentle = !rough && cell.max_bend * radius_m_ < max_smooth_bend * cell.max_slope;
    step = std::max(step, (gentle || slope >= 0 ? smooth_step : bent_step) * radius_m_);
    s_ = std::min(s_ + step, in_.end);
}

/// Whether the root is as near as the slope says.
void RayMarch::probe(double value) {
    if (value <= 0) return begin_root(before_, value_before_, s_, value);
    phase_ = Phase::walk;
    const double step = safe_step(value_before_, slope_before_, max_rate_);
    s_ = before_ + std::max(step, bent_step * radius_m_);
}

void RayMarch::begin_root(double from, double from_value, double to, double to_value) {
    low_ = from;
    low_value_ = from_value;
    high_ = to;
    high_value_ = to_value;
    width_ = high_ - low_;
    root_steps_ = 0;
    phase_ = Phase::root;
    s_ = low_ + width_ * (low_value_ / (low_value_ - high_value_));
}

/// Newton's steps within a bracket, which is halved where they are slow.
void RayMarch::narrow(double value, double slope) {
    const double here = s_;
    (value > 0 ? low_ : high_) = here;
    (value > 0 ? low_value_ : high_value_) = value;
    const double width = high_ - low_;
    const double tolerance = root_tolerance * radius_m_;
    if (value == 0 || width <= tolerance || ++root_steps_ > max_root_steps) return hit_at(here);
    double next = slope < 0 ? here - value / slope : beyond_all;
    if (next > low_ && next < high_ && std::abs(next - here) < tolerance) return hit_at(next);
    const bool slow = root_steps_ % 3 == 0 && width > width_ / 2;
    if (root_steps_ % 3 == 0) width_ = width;
    if (slow || !(next > low_ && next < high_)) next = low_ + width / 2;
    s_ = next;
}

} // namespace

void trace(const ShapeProgram& shape, const ShapeRays& rays, ShapeHits& hits) noexcept {
    std::array<RayMarch, shape_lanes> march{};
    for (std::size_t i = 0; i < shape_lanes; ++i)
        march[i].begin(shape, rays.origin[i], rays.direction[i], rays.t_max[i], rays.origin_error_m);
    std::array<std::array<double, shape_lanes>, 3> place{};
    std::array<std::array<double, shape_lanes>, 4> rows;
    hits.evaluations = 0;
    for (;;) {
        std::array<bool, shape_lanes> wanted{};
        bool any = false;
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            wanted[i] = march[i].find_point();
            if (!wanted[i]) continue;
            any = true;
            const Vec3 p = march[i].point();
            place[0][i] = p.x;
            place[1][i] = p.y;
            place[2][i] = p.z;
        }
        if (!any) break;
        shape.run({place[0].data(), place[1].data(), place[2].data()},
                  {rows[0].data(), rows[1].data(), rows[2].data(), rows[3].data()}, shape_lanes);
        ++hits.evaluations;
        for (std::size_t i = 0; i < shape_lanes; ++i)
            if (wanted[i]) march[i].take(rows[0][i], {rows[1][i], rows[2][i], rows[3][i]});
    }
    for (std::size_t i = 0; i < shape_lanes; ++i) {
        hits.t[i] = march[i].t();
        hits.doubtful[i] = march[i].is_doubtful();
    }
}

} // namespace obscura::models
