// SPDX-License-Identifier: Apache-2.0
// Ring buffer of time-stamped poses received at run time, with interpolation.
#pragma once

#include "renderer/scene/scene.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace obscura::emulator {

/// Rates stated with a pose.
struct PoseRates {
    Vec3 velocity_m_s; ///< in the frame of the position
    Vec3 rate_rad_s;   ///< rotation, in the moving frame's own axes

    constexpr bool operator==(const PoseRates&) const = default;
};

/// Latest poses of the camera, a body or a lamp. Between two poses the position is interpolated linearly and
/// the attitude by slerp, as in a trajectory; where both state rates by cubics that have them. After the
/// newest the pose goes on for max_extrapolation_s, with the rates stated with the newest or else those
/// between the last two, and is then held; before the oldest that one is held. One thread at a time pushes,
/// any thread reads; readers retry for a few stores at most (sequence lock).
class PoseRing final : public scene::LivePose {
public:
    explicit PoseRing(double max_extrapolation_s) : max_extrapolation_s_(max_extrapolation_s) {}

    /// Adds `pose`, whose quaternion has unit norm. Returns false, without effect, unless `time_s` is later
    /// than all before.
    bool push(double time_s, const Pose& pose, const std::optional<PoseRates>& rates = {}) noexcept;
    [[nodiscard]] bool at(double time_s, Pose& pose) const noexcept override;
    [[nodiscard]] double age_s(double time_s) const noexcept override;
    /// Time stamp of the newest pose; 0 if there is none.
    [[nodiscard]] double newest_s() const noexcept;
    [[nodiscard]] std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }

    static constexpr std::size_t capacity = 64;

private:
    struct Cell {
        /// Time, position, scalar-first quaternion, velocity, rotation rate; without rates NaN from there on.
        std::array<std::atomic<double>, 14> values{};
    };
    [[nodiscard]] double time_of(std::uint64_t number) const noexcept;
    [[nodiscard]] Pose pose_of(std::uint64_t number) const noexcept;
    /// Rates stated with a pose; false: none.
    [[nodiscard]] bool rates_of(std::uint64_t number, PoseRates& rates) const noexcept;
    [[nodiscard]] Pose evaluate(std::uint64_t count, double time_s) const noexcept;

    const double max_extrapolation_s_;
    std::array<Cell, capacity> cells_{}; ///< pose n in cell n % capacity
    std::atomic<std::uint64_t> count_{0};
    std::atomic<std::uint64_t> sequence_{0}; ///< odd while a cell is being written
};

} // namespace obscura::emulator
