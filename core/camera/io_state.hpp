// SPDX-License-Identifier: Apache-2.0
// State of the camera's lines, counters and timers, derived from its recorded activity.
#pragma once

#include "core/camera/camera.hpp"
#include "core/clock.hpp"

#include <array>
#include <atomic>
#include <cstdint>

namespace obscura {

/// Activity of the camera at one instant.
struct IoInputs {
    Time now;
    CameraActivity activity;
};

[[nodiscard]] IoInputs io_inputs(const CameraControl& camera, const Clock& clock);

/// Number of occurrences of the event up to `in.now`. All overlapping frames but the last count as ended.
[[nodiscard]] std::uint64_t count_of(IoEvent event, const IoInputs& in) noexcept;
/// Time of the last occurrence, in `t`; returns false when there was none.
[[nodiscard]] bool last_of(IoEvent event, const IoInputs& in, Time& t) noexcept;
/// SFNC ExposureActive and FrameActive of the current frame.
[[nodiscard]] bool exposure_active(const IoInputs& in) noexcept;
[[nodiscard]] bool frame_active(const IoInputs& in) noexcept;
/// Level of an input line. A line whose source reports one kind of edge only shows its last edge as a pulse
/// of 1 ms.
[[nodiscard]] bool line_level(std::size_t line, const LineEdges& edges, const IoInputs& in) noexcept;

/// SFNC CounterStatus and TimerStatus.
enum class IoStatus : std::uint32_t { idle, trigger_wait, active, completed };

/// Value of counter `i` of in.activity, configured as `counter`.
[[nodiscard]] std::uint32_t counter_value(const EventCounter& counter, std::size_t i,
                                          const IoInputs& in) noexcept;
[[nodiscard]] IoStatus counter_status(const EventCounter& counter, std::size_t i,
                                      const IoInputs& in) noexcept;
/// Number of counter ends since the last reset that was not caused by the counter's own end.
[[nodiscard]] std::uint64_t counter_ends(const EventCounter& counter, std::size_t i,
                                         const IoInputs& in) noexcept;

/// Last start of timer `i`, configured as `timer`; returns false when it was not started since its reset.
[[nodiscard]] bool timer_start(const PulseTimer& timer, std::size_t i, const IoInputs& in,
                               Time& start) noexcept;
/// Time that the timer has been active since its last start.
[[nodiscard]] std::int64_t timer_value_ns(const PulseTimer& timer, std::size_t i,
                                          const IoInputs& in) noexcept;
[[nodiscard]] IoStatus timer_status(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept;
/// Whether the timer's signal is high: after the delay, before the end of the duration.
[[nodiscard]] bool timer_level(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept;

/// Last resets of counters and timers. One thread resets, any number of threads read.
class IoMarks {
public:
    /// Resets counter `i`; `in` is the state before this reset.
    void reset_counter(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept;
    /// Makes counter `i` count from `count` events on.
    void rebase_counter(std::size_t i, std::uint64_t count) noexcept;
    void reset_timer(std::size_t i, Time now) noexcept;
    void fill(CameraActivity& activity) const noexcept;

private:
    std::array<std::atomic<std::uint64_t>, counter_count> base_{};
    std::array<std::atomic<std::uint32_t>, counter_count> value_at_reset_{};
    std::array<std::atomic<std::int64_t>, timer_count> timer_reset_ns_{};
};

} // namespace obscura
