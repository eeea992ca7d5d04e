// SPDX-License-Identifier: Apache-2.0
#include "emulator/pose_ring.hpp"

#include <algorithm>

namespace obscura::emulator {

bool PoseRing::push(double time_s, const Pose& pose) noexcept {
    const std::uint64_t count = count_.load(std::memory_order_relaxed);
    if (count > 0 && !(time_s > time_of(count - 1))) return false;
    const Vec3& p = pose.position_m;
    const Quat& q = pose.orientation;
    const std::array<double, 8> values{time_s, p.x, p.y, p.z, q.w, q.x, q.y, q.z};
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

Pose PoseRing::evaluate(std::uint64_t count, double time_s) const noexcept {
    const std::uint64_t newest = count - 1;
    const std::uint64_t oldest = count > capacity ? count - capacity : 0;
    if (newest == oldest || time_s <= time_of(oldest)) return pose_of(oldest);
    std::uint64_t after = newest;
    if (const double last_s = time_of(newest); time_s > last_s) {
        time_s = std::min(time_s, last_s + max_extrapolation_s_);
    } else {
        while (after > oldest + 1 && time_of(after - 1) >= time_s)
            --after;
    }
    const double from_s = time_of(after - 1), to_s = time_of(after);
    return interpolate(pose_of(after - 1), pose_of(after), (time_s - from_s) / (to_s - from_s));
}

} // namespace obscura::emulator
