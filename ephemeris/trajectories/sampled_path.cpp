// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/sampled_path.hpp"

#include "core/pose_range.hpp"
#include "ephemeris/segments/interpolation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace obscura::ephemeris {
namespace {

using Method = Interpolation::Method;

/// Samples of an interpolation: times relative to the instant that is asked for.
struct Window {
    std::size_t first = 0, count = 0;
    std::array<double, max_samples> time_s{};

    [[nodiscard]] std::span<const double> times() const { return std::span(time_s).first(count); }
};

/// `a` - `b`, s. Instants may be further apart than nanoseconds can be counted.
double seconds_between(Epoch a, Epoch b) noexcept {
    return static_cast<double>((static_cast<long double>(a.tai_ns) - static_cast<long double>(b.tai_ns)) *
                               1e-9L);
}

/// The `count` samples nearest to both sides of `at`, or all if there are fewer.
Window window_at(const PathSegment& segment, Epoch at, double fraction_s, std::size_t count) noexcept {
    const auto& epochs = segment.epochs;
    Window window;
    window.count = std::min({count, epochs.size(), max_samples});
    const auto after =
        static_cast<std::size_t>(std::upper_bound(epochs.begin(), epochs.end(), at) - epochs.begin());
    // As many before as after; of an odd number the one more on the nearer side.
    std::size_t before = window.count / 2;
    if (window.count % 2 != 0 && after > 0 &&
        (after == epochs.size() ||
         seconds_between(at, epochs[after - 1]) < seconds_between(epochs[after], at)))
        ++before;
    window.first = std::min(after - std::min(after, before), epochs.size() - window.count);
    for (std::size_t i = 0; i < window.count; ++i)
        window.time_s[i] = seconds_between(epochs[window.first + i], at) - fraction_s;
    return window;
}

/// Samples that a polynomial of `interpolation` goes through.
std::size_t samples_of(const Interpolation& interpolation) noexcept {
    const std::size_t degree = interpolation.degree;
    switch (interpolation.method) {
    case Method::linear:
        return 2;
    case Method::lagrange:
        return degree + 1;
    case Method::hermite:
        break;
    }
    return std::max<std::size_t>((degree + 1) / 2, 2);
}

/// Weight of the later of two samples at the instant that is asked for.
double weight_of_later(const Window& two) noexcept {
    return -two.time_s[0] / (two.time_s[1] - two.time_s[0]);
}

Vec3 between(const std::vector<Vec3>& values, const Window& two) noexcept {
    if (two.count < 2) return values[two.first];
    const double later = weight_of_later(two);
    return values[two.first] * (1 - later) + values[two.first + 1] * later;
}

/// Copies one coordinate of the window's samples.
void coordinate(const std::vector<Vec3>& values, const Window& window, double Vec3::*axis,
                std::array<double, max_samples>& out) noexcept {
    for (std::size_t i = 0; i < window.count; ++i)
        out[i] = values[window.first + i].*axis;
}

/// Slope between two samples.
Vec3 slope(const std::vector<Vec3>& values, const Window& two) noexcept {
    if (two.count < 2) return {};
    return (values[two.first + 1] - values[two.first]) * (1 / (two.time_s[1] - two.time_s[0]));
}

/// Position and its derivative.
struct Motion {
    Vec3 position_m, velocity_m_s;
};

Motion interpolated_motion(const PathSegment& segment, Epoch at, double fraction_s) noexcept {
    const Window window = window_at(segment, at, fraction_s, samples_of(segment.interpolation));
    if (window.count < 2 || segment.interpolation.method == Method::linear)
        return {between(segment.position_m, window), slope(segment.position_m, window)};
    Motion result;
    std::array<double, max_samples> values{}, rates{};
    const auto used = [&](const std::array<double, max_samples>& all) {
        return std::span<const double>(all).first(window.count);
    };
    const auto set = [&](double Vec3::*axis, ValueAndRate found) {
        result.position_m.*axis = found.value;
        result.velocity_m_s.*axis = found.rate;
    };
    for (const auto axis : {&Vec3::x, &Vec3::y, &Vec3::z}) {
        coordinate(segment.position_m, window, axis, values);
        if (segment.interpolation.method == Method::lagrange) {
            set(axis, lagrange(window.times(), used(values)));
        } else {
            coordinate(segment.velocity_m_s, window, axis, rates);
            set(axis, hermite(window.times(), used(values), used(rates)));
        }
    }
    // Polynomials through samples at very uneven distances go far, or overflow.
    if (is_in_range(result.position_m) && is_finite(result.velocity_m_s)) return result;
    const Window two = window_at(segment, at, fraction_s, 2);
    return {between(segment.position_m, two), slope(segment.position_m, two)};
}

Quat interpolated_orientation(const PathSegment& segment, Epoch at, double fraction_s) noexcept {
    const Window window = window_at(segment, at, fraction_s, samples_of(segment.interpolation));
    const Quat* const q = &segment.orientation[window.first];
    if (window.count < 2)
        return segment.spin_rad.empty() ? q[0] : q[0] * axis_angle({0, 0, 1}, segment.spin_rad[0]);
    if (segment.interpolation.method == Method::linear) {
        const double later = std::clamp(weight_of_later(window), 0.0, 1.0);
        const Quat axes = normalized(slerp(q[0], q[1], later));
        if (segment.spin_rad.empty()) return axes;
        const double* const spin = &segment.spin_rad[window.first];
        return axes * axis_angle({0, 0, 1}, spin[0] + later * (spin[1] - spin[0]));
    }
    Quat result;
    std::array<double, max_samples> values{}, rates{};
    const bool hermites = segment.interpolation.method == Method::hermite && !segment.rate_rad_s.empty();
    for (const auto part : {&Quat::w, &Quat::x, &Quat::y, &Quat::z}) {
        for (std::size_t i = 0; i < window.count; ++i) {
            values[i] = q[i].*part;
            if (!hermites) continue;
            // The rate is that of the object in its own axes: dq/dt = q w / 2.
            const Vec3 w = segment.rate_rad_s[window.first + i];
            rates[i] = (q[i] * Quat{0, w.x, w.y, w.z}).*part / 2;
        }
        const auto used = std::span<const double>(values).first(window.count);
        result.*part =
            (hermites ? hermite(window.times(), used, std::span<const double>(rates).first(window.count))
                      : lagrange(window.times(), used))
                .value;
    }
    // A polynomial of high degree may swing through zero between samples that are far apart.
    const double length = norm(result);
    return length > 0.5 && length < 2
               ? Quat{result.w / length, result.x / length, result.y / length, result.z / length}
               : q[window.count / 2];
}

/// Velocity at an end of the segment, by which the path goes on.
Vec3 velocity_at(const PathSegment& segment, Epoch at) noexcept {
    const Window two = window_at(segment, at, 0, 2);
    return segment.velocity_m_s.empty() ? slope(segment.position_m, two) : between(segment.velocity_m_s, two);
}

/// Rotation rate at an end of the segment, object's axes, rad/s.
Vec3 rate_at(const PathSegment& segment, Epoch at) noexcept {
    const Window two = window_at(segment, at, 0, 2);
    if (!segment.rate_rad_s.empty()) return between(segment.rate_rad_s, two);
    if (two.count < 2) return {};
    Quat turn = conjugate(segment.orientation[two.first]) * segment.orientation[two.first + 1];
    if (turn.w < 0) turn = {-turn.w, -turn.x, -turn.y, -turn.z};
    const Vec3 axis{turn.x, turn.y, turn.z};
    const double sine = length(axis);
    if (!(sine > 0)) return {};
    return axis * (2 * std::atan2(sine, turn.w) / sine / (two.time_s[1] - two.time_s[0]));
}

} // namespace

SampledPath::SampledPath(PathFile file, Epoch zero, double max_extrapolation_s)
    : frames_(std::move(file.frames)),
      segments_(std::move(file.segments)),
      zero_(zero),
      max_extrapolation_s_(max_extrapolation_s) {}

SampledPath::Place SampledPath::find(double time_s) const noexcept {
    // Whole nanoseconds and the rest: doubles hold a time since `zero` to some nanoseconds only.
    constexpr double max_s = 9e9;
    time_s = std::clamp(time_s, -max_s, max_s);
    const std::int64_t ns = std::llround(time_s * 1e9);
    const double fraction_s = time_s - static_cast<double>(ns) * 1e-9;
    Epoch at;
    if (__builtin_add_overflow(zero_.tai_ns, ns, &at.tai_ns))
        at.tai_ns =
            ns < 0 ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();

    const auto next = std::upper_bound(segments_.begin(), segments_.end(), at,
                                       [](Epoch t, const PathSegment& s) { return t < s.start; });
    if (next == segments_.begin()) {
        const PathSegment& first = segments_.front();
        return {&first, first.start, 0, seconds_between(at, first.start) + fraction_s};
    }
    const PathSegment& segment = *(next - 1);
    if (at <= segment.stop) return {&segment, at, fraction_s, 0};
    return {&segment, segment.stop, 0, seconds_between(at, segment.stop) + fraction_s};
}

Vec3 SampledPath::position_m(double time_s) const noexcept {
    const Place place = find(time_s);
    const Vec3 position = interpolated_motion(*place.segment, place.at, place.fraction_s).position_m;
    const double further_s = std::clamp(place.beyond_s, -max_extrapolation_s_, max_extrapolation_s_);
    return further_s == 0 ? position : position + velocity_at(*place.segment, place.at) * further_s;
}

Vec3 SampledPath::velocity_m_s(double time_s) const noexcept {
    const Place place = find(time_s);
    if (place.beyond_s == 0)
        return interpolated_motion(*place.segment, place.at, place.fraction_s).velocity_m_s;
    return std::abs(place.beyond_s) < max_extrapolation_s_ ? velocity_at(*place.segment, place.at) : Vec3{};
}

Quat SampledPath::orientation(double time_s) const noexcept {
    const Place place = find(time_s);
    const Quat q = interpolated_orientation(*place.segment, place.at, place.fraction_s);
    const double further_s = std::clamp(place.beyond_s, -max_extrapolation_s_, max_extrapolation_s_);
    if (further_s == 0) return q;
    const Vec3 rate = rate_at(*place.segment, place.at);
    const double rate_rad_s = length(rate);
    return rate_rad_s > 0 ? normalized(q * axis_angle(rate, rate_rad_s * further_s)) : q;
}

double SampledPath::age_s(double time_s) const noexcept {
    return std::abs(find(time_s).beyond_s);
}

std::vector<double> SampledPath::times_s() const {
    std::vector<double> times;
    for (const PathSegment& segment : segments_) {
        const auto add = [&](Epoch epoch) {
            const double time_s = seconds_between(epoch, zero_);
            if (times.empty() || time_s > times.back()) times.push_back(time_s);
        };
        add(segment.start);
        for (const Epoch epoch : segment.epochs)
            if (epoch > segment.start && epoch < segment.stop) add(epoch);
        add(segment.stop);
    }
    return times;
}

} // namespace obscura::ephemeris
