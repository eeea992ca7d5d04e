// SPDX-License-Identifier: Apache-2.0
// Software trigger source: fires when fire() is called.
#pragma once

#include "core/clock.hpp"
#include "sync/sync.hpp"

#include <atomic>
#include <cstdint>
#include <mutex>

namespace obscura::sync {

/// Delivers a trigger on the calling thread for every fire(); used by control ports, tests and lockstep.
class SoftwareTrigger final : public TriggerSource {
public:
    /// `clock` is used for the `seen` stamp and must outlive the source.
    /// `name`, a literal, is how logs and statistics call it.
    explicit SoftwareTrigger(const Clock& clock, std::string_view name = "software")
        : clock_(clock), name_(name) {}

    [[nodiscard]] std::string_view name() const override { return name_; }
    void start(TriggerSink& sink) override;
    void stop() override;

    /// Delivers a trigger whose edge is `edge`; returns false when the source is not started. Not for
    /// real-time threads. In lockstep `scene` is the scene's time, and the clock is locked, because it is the
    /// simulator's own. `request`: see Trigger.
    bool fire(Time edge, Time scene = Trigger::scene_of_camera, std::uint64_t request = 0);
    [[nodiscard]] ClockState clock_state(Time /*now*/) const noexcept override {
        return state_.load(std::memory_order_relaxed);
    }

private:
    const Clock& clock_;
    const std::string_view name_;
    std::mutex mutex_;
    TriggerSink* sink_ = nullptr;
    std::uint64_t next_id_ = 1;
    std::atomic<ClockState> state_{ClockState::free};
};

} // namespace obscura::sync
