// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/pose_ring.hpp"

#include "core/pose_range.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::emulator {
namespace {

Pose moved_on(const Pose& pose, const PoseRates& rates, double span_s) noexcept {
    const double rate_rad_s = length(rates.rate_rad_s);
    return {pose.position_m + rates.velocity_m_s * span_s,
            rate_rad_s > 0 ? normalized(pose.orientation * axis_angle(rates.rate_rad_s, rate_rad_s * span_s))
                           : pose.orientation};
}

/// Rotation vector of a unit quaternion, 0 to pi long.
Vec3 rotation_vector(Quat q) noexcept {
    if (q.w < 0) q = {-q.w, -q.x, -q.y, -q.z};
    const Vec3 v{q.x, q.y, q.z};
    const double sine = length(v);
    return sine > 0 ? v * (2 * std::atan2(sine, q.w) / sine) : Vec3{};
}

/// Derivative of the rotation vector `turn` of a frame that rotates at `rate_rad_s` in its own axes (Shuster,
/// A survey of attitude representations, J. Astronaut. Sci. 41, 439, 1993, eq. 276, for rates in own axes).
Vec3 vector_rate(Vec3 turn, Vec3 rate_rad_s) noexcept {
    const double angle2 = length_squared(turn), angle = std::sqrt(angle2);
    // The factor has the limit 1/12.
    const double factor = angle > 1e-3 ? (1 - angle / 2 / std::tan(angle / 2)) / angle2 : 1.0 / 12;
    return rate_rad_s + cross(turn, rate_rad_s) * 0.5 + cross(turn, cross(turn, rate_rad_s)) * factor;
}

/// Hermite's cubic at the share `s` of a span from 0 to `to`, with the slopes at both ends per span.
Vec3 hermite(Vec3 to, Vec3 slope0, Vec3 slope1, double s) noexcept {
    return s * (slope0 + s * (3 * to - 2 * slope0 - slope1 + s * (slope0 + slope1 - 2 * to)));
}

/// Pose at the share `s` of `span_s` between two poses with rates: cubic in position and in the rotation
/// vector from the first attitude.
Pose between(const Pose& a, const PoseRates& a_rates, const Pose& b, const PoseRates& b_rates, double span_s,
             double s) noexcept {
    Pose pose = interpolate(a, b, s);
    pose.position_m = a.position_m + hermite(b.position_m - a.position_m, a_rates.velocity_m_s * span_s,
                                             b_rates.velocity_m_s * span_s, s);
    // Cubics of rates that do not fit to poses far apart in time go far.
    if (!is_in_range(pose.position_m)) return interpolate(a, b, s);
    const Vec3 turn = rotation_vector(conjugate(a.orientation) * b.orientation);
    // With more than half a turn the shortest way is not that of the rates.
    constexpr double max_rad = 3;
    const double stated_rad = std::max(length(a_rates.rate_rad_s), length(b_rates.rate_rad_s)) * span_s;
    if (length(turn) > max_rad || stated_rad > max_rad) return pose;
    const Vec3 turned =
        hermite(turn, a_rates.rate_rad_s * span_s, vector_rate(turn, b_rates.rate_rad_s) * span_s, s);
    if (const double angle = length(turned); angle > 0)
        pose.orientation = normalized(a.orientation * axis_angle(turned, angle));
    else
        pose.orientation = a.orientation;
    return pose;
}

} // namespace

bool PoseRing::push(double time_s, const Pose& pose, const std::optional<PoseRates>& rates) noexcept {
    const std::uint64_t count = count_.load(std::memory_order_relaxed);
    if (count > 0 && !(time_s > time_of(count - 1))) return false;
    const Vec3& p = pose.position_m;
    const Quat& q = pose.orientation;
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const auto [v, w] = rates.value_or(PoseRates{{none, none, none}, {none, none, none}});
    const std::array<double, 14> values{time_s, p.x, p.y, p.z, q.w, q.x, q.y,
                                        q.z,    v.x, v.y, v.z, w.x, w.y, w.z};
    // Order every access by itself (release here, acquire in at()), because ThreadSanitizer does not
    // understand fences.
    sequence_.fetch_add(1, std::memory_order_acq_rel);
    Cell& cell = cells_[count % capacity];
    for (std::size_t i = 0; i < values.size(); ++i)
        cell.values[i].store(values[i], std::memory_order_release);
    count_.store(count + 1, std::memory_order_release);
    sequence_.fetch_add(1, std::memory_order_acq_rel);
    return true;
}

bool PoseRing::at(double time_s, Pose& pose) const noexcept {
    for (;;) {
        const std::uint64_t before = sequence_.load(std::memory_order_acquire);
        if (before % 2 != 0) continue; // the writer is between its stores
        const std::uint64_t count = count_.load(std::memory_order_acquire);
        if (count == 0) return false;
        const Pose found = evaluate(count, time_s);
        if (sequence_.load(std::memory_order_acquire) != before) continue;
        pose = found;
        return true;
    }
}

double PoseRing::age_s(double time_s) const noexcept {
    return count() == 0 ? 0 : std::max(0.0, time_s - newest_s());
}

double PoseRing::newest_s() const noexcept {
    const std::uint64_t n = count();
    return n == 0 ? 0 : time_of(n - 1);
}

double PoseRing::time_of(std::uint64_t number) const noexcept {
    return cells_[number % capacity].values[0].load(std::memory_order_acquire);
}

Pose PoseRing::pose_of(std::uint64_t number) const noexcept {
    const auto& v = cells_[number % capacity].values;
    const auto get = [&v](std::size_t i) { return v[i].load(std::memory_order_acquire); };
    return {{get(1), get(2), get(3)}, {get(4), get(5), get(6), get(7)}};
}

bool PoseRing::rates_of(std::uint64_t number, PoseRates& rates) const noexcept {
    const auto& v = cells_[number % capacity].values;
    const auto get = [&v](std::size_t i) { return v[i].load(std::memory_order_acquire); };
    rates = {{get(8), get(9), get(10)}, {get(11), get(12), get(13)}};
    return !std::isnan(rates.velocity_m_s.x);
}

Pose PoseRing::evaluate(std::uint64_t count, double time_s) const noexcept {
    const std::uint64_t newest = count - 1;
    const std::uint64_t oldest = count > capacity ? count - capacity : 0;
    if (PoseRates rates; time_s > time_of(newest) && rates_of(newest, rates))
        return moved_on(pose_of(newest), rates, std::min(time_s - time_of(newest), max_extrapolation_s_));
    if (newest == oldest || time_s <= time_of(oldest)) return pose_of(oldest);
    std::uint64_t after = newest;
    if (const double last_s = time_of(newest); time_s > last_s) {
        time_s = std::min(time_s, last_s + max_extrapolation_s_);
    } else {
        while (after > oldest + 1 && time_of(after - 1) >= time_s)
            --after;
    }
    const double from_s = time_of(after - 1), to_s = time_of(after);
    const Pose from = pose_of(after - 1), to = pose_of(after);
    const double share = (time_s - from_s) / (to_s - from_s);
    if (PoseRates before, behind; share < 1 && rates_of(after - 1, before) && rates_of(after, behind))
        return between(from, before, to, behind, to_s - from_s, share);
    return interpolate(from, to, share);
}

} // namespace obscura::emulator
