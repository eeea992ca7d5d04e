// SPDX-License-Identifier: Apache-2.0
// Poses of a simulator, shifted to those that a frame was made with.
#pragma once

#include "renderer/scene/scene.hpp"

#include <memory>
#include <utility>

namespace obscura::emulator {

/// A frame may have been made with poses that were extrapolated and have come since, or that are not kept any
/// more: constant offsets bring the poses of now to those of the frame at its mid-exposure. Thread-bound.
class ShiftedPose final : public scene::LivePose {
public:
    explicit ShiftedPose(std::shared_ptr<const scene::LivePose> of) : of_(std::move(of)) {}

    [[nodiscard]] bool at(double time_s, Pose& pose) const noexcept override {
        if (!of_->at(time_s, pose)) return false;
        pose.position_m = pose.position_m + by_m_;
        pose.orientation = normalized(turn_ * pose.orientation);
        return true;
    }
    [[nodiscard]] double age_s(double time_s) const noexcept override { return of_->age_s(time_s); }

    void reset() noexcept {
        by_m_ = {};
        turn_ = {};
    }
    /// Adds what brings `is` to `wanted`.
    void add(const Pose& is, const Pose& wanted) noexcept {
        by_m_ = by_m_ + (wanted.position_m - is.position_m);
        turn_ = normalized(wanted.orientation * conjugate(is.orientation) * turn_);
    }

private:
    std::shared_ptr<const scene::LivePose> of_;
    Vec3 by_m_{};
    Quat turn_{};
};

} // namespace obscura::emulator
