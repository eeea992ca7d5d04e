// Lines, counters and timers of the camera: what they show follows from what the camera has done so far.
#pragma once

#include "core/camera.hpp"

#include <cstdint>

namespace obscura::transports::gige {

/// What counters count and timers start from; the values of CounterEventSource and TimerTriggerSource.
enum class IoEvent : std::uint32_t {
    off,
    line0,                ///< an edge of the trigger input, listened to or not
    frame_trigger,        ///< an edge that became a frame
    frame_trigger_missed, ///< counters only
    frame_start,
    frame_end, ///< the last row has left the chip
    exposure_start,
    exposure_end,
    acquisition_start,
};
constexpr std::uint32_t io_event_count = 9;

/// LineSource of the output line.
enum class LineSource : std::uint32_t {
    off,
    exposure_active,
    frame_active,
    frame_trigger_wait,
    acquisition_active,
    timer0_active,
    timer1_active,
    counter0_active,
    counter1_active,
    user_output0,
};
constexpr std::uint32_t line_source_count = 10;

/// The camera at one instant.
struct IoInputs {
    Time now;
    CameraActivity activity;
    bool acquiring = false;
    std::uint64_t acquisitions = 0; ///< acquisition starts so far
    Time acquisition_start;         ///< the last one
};

/// How often the event has happened up to `in.now`. Of frames that overlap, all but the last count as ended.
[[nodiscard]] std::uint64_t count_of(IoEvent event, const IoInputs& in) noexcept;
/// When it happened last; false when it has not yet.
[[nodiscard]] bool last_of(IoEvent event, const IoInputs& in, Time& t) noexcept;
/// Whether the frame in work is exposed, is on its way, and so on.
[[nodiscard]] bool exposure_active(const IoInputs& in) noexcept;
[[nodiscard]] bool frame_active(const IoInputs& in) noexcept;
/// Trigger sources know edges, not levels: Line0 shows its last edge as a pulse of 1 ms.
[[nodiscard]] bool line0_level(const IoInputs& in) noexcept;

/// SFNC CounterStatus and TimerStatus.
enum class IoStatus : std::uint32_t { idle, trigger_wait, active, completed };

/// SFNC CounterControl: counts events from its last reset on.
struct EventCounter {
    IoEvent source = IoEvent::off;
    bool reset_by_acquisition_start = false;
    std::uint32_t duration = 0; ///< counting ends here; 0: never
    std::uint32_t value_at_reset = 0;
    std::uint64_t base = 0; ///< count_of() at the last reset

    [[nodiscard]] std::uint32_t value(const IoInputs& in) const noexcept;
    [[nodiscard]] IoStatus status(const IoInputs& in) const noexcept;
    void reset(const IoInputs& in) noexcept;
};

/// SFNC TimerControl: `delay_ns` after its trigger it is active for `duration_ns`. Each trigger starts it
/// anew.
struct PulseTimer {
    IoEvent source = IoEvent::off;
    std::int64_t delay_ns = 0, duration_ns = 0;
    Time reset_at; ///< triggers before this do not count

    /// Time it has been active since its last trigger.
    [[nodiscard]] std::int64_t value_ns(const IoInputs& in) const noexcept;
    [[nodiscard]] IoStatus status(const IoInputs& in) const noexcept;
    /// Whether its signal is high: past the delay, not past the duration.
    [[nodiscard]] bool level(const IoInputs& in) const noexcept;
};

} // namespace obscura::transports::gige
