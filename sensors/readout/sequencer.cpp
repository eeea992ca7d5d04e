// SPDX-License-Identifier: Apache-2.0
#include "sensors/readout/sequencer.hpp"

#include "sensors/readout/row_slots.hpp"

#include <algorithm>
#include <limits>

namespace obscura::sensors {
namespace {

constexpr Time never{std::numeric_limits<std::int64_t>::min()};

bool same(const WindowRequest& a, const WindowRequest& b) {
    return a.region == b.region && a.exposure_ns == b.exposure_ns && a.sampling == b.sampling &&
           a.reads == b.reads;
}

} // namespace

Time ReadoutSequencer::start_of(const ReadoutSettings& settings, Time trigger) const noexcept {
    // Lines, and times of a model, follow the trigger.
    if (!running_ || trigger >= reading_until_ || settings.shutter == Shutter::push_broom ||
        settings.shutter == Shutter::model)
        return trigger;
    return grid_origin_ + ceil_div(trigger - grid_origin_, grid_ns_) * grid_ns_;
}

void ReadoutSequencer::keep_old_starts(const ReadoutSettings& settings, ReadoutPlan& plan) const noexcept {
    const std::int64_t whole_cycle = plan.cycle_ns - (settings.reset_instant_ns - settings.sample_instant_ns);
    for (FrameWindow& window : plan.windows) {
        const bool own_reset = window.exposure_requested_ns < whole_cycle;
        if (own_reset || window.sampling != Sampling::destructive) continue;
        window.exposure_min_ns = std::numeric_limits<std::int64_t>::max();
        window.exposure_max_ns = 0;
        for (std::int32_t r = 0; r < window.sensor.height; ++r) {
            const auto i = static_cast<std::size_t>(window.image_y + r);
            const Time old = row_reset_[static_cast<std::size_t>(plan.sensor_row[i])];
            if (old != never && old < plan.rows[i].read && old != plan.rows[i].reset) {
                plan.rows[i].reset = old;
                window.flags |= settings_changed;
            }
            window.exposure_min_ns = std::min(window.exposure_min_ns, plan.rows[i].exposure_ns());
            window.exposure_max_ns = std::max(window.exposure_max_ns, plan.rows[i].exposure_ns());
        }
    }
}

void ReadoutSequencer::reserve(const ReadoutSettings& settings) {
    windows_.reserve(max_windows);
    row_reset_.reserve(static_cast<std::size_t>(settings.height));
}

TriggerVerdict ReadoutSequencer::next(const ReadoutSettings& settings, std::span<const WindowRequest> windows,
                                      Time trigger, ReadoutPlan& plan) {
    if (running_ && trigger < earliest_next_) {
        ++over_triggers_;
        return TriggerVerdict::over_trigger;
    }
    const Time start = start_of(settings, trigger);
    reason_ = plan_readout(settings, windows, start, plan);
    if (!reason_.empty()) return TriggerVerdict::refused;

    const bool rolling = settings.shutter == Shutter::rolling;
    const bool changed =
        running_ && !std::equal(windows.begin(), windows.end(), windows_.begin(), windows_.end(), same);
    if (changed && rolling && settings.overlapped && start < reading_until_) keep_old_starts(settings, plan);
    if (start != trigger)
        for (FrameWindow& window : plan.windows)
            window.flags |= trigger_deferred;

    const auto height = static_cast<std::size_t>(settings.height);
    if (!running_ || row_reset_.size() != height) row_reset_.assign(height, never);
    for (const FrameWindow& window : plan.windows) {
        if (!rolling || window.sampling != Sampling::destructive) continue;
        for (std::int32_t r = 0; r < window.sensor.height; ++r) {
            const auto i = static_cast<std::size_t>(window.image_y + r);
            row_reset_[static_cast<std::size_t>(plan.sensor_row[i])] =
                plan.rows[i].read + (settings.reset_instant_ns - settings.sample_instant_ns);
        }
    }
    running_ = true;
    ++accepted_;
    windows_.assign(windows.begin(), windows.end());
    earliest_next_ = start + plan.frame_period_ns;
    reading_until_ = *std::max_element(plan.release.begin(), plan.release.end());
    const bool one_grid = !rolling || windows.size() == 1;
    grid_ns_ = one_grid ? plan.row_ns : plan.cycle_ns;
    grid_origin_ =
        rolling ? (one_grid ? plan.cycle_start + settings.reset_instant_ns : start) : plan.cycle_start;
    return TriggerVerdict::accepted;
}

} // namespace obscura::sensors
