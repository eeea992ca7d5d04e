// Lines, counters and timers of the camera: what they show follows from what the camera has done so far.
#pragma once

#include "core/camera.hpp"
#include "core/clock.hpp"

#include <array>
#include <atomic>
#include <cstdint>

namespace obscura {

/// The camera at one instant.
struct IoInputs {
    Time now;
    CameraActivity activity;
};

[[nodiscard]] IoInputs io_inputs(const CameraControl& camera, const Clock& clock);

/// How often the event has happened up to `in.now`. Of frames that overlap, all but the last count as ended.
[[nodiscard]] std::uint64_t count_of(IoEvent event, const IoInputs& in) noexcept;
/// When it happened last; false when it has not yet.
[[nodiscard]] bool last_of(IoEvent event, const IoInputs& in, Time& t) noexcept;
/// Whether the frame in work is exposed, is on its way.
[[nodiscard]] bool exposure_active(const IoInputs& in) noexcept;
[[nodiscard]] bool frame_active(const IoInputs& in) noexcept;
/// Of an input. One whose source tells of one kind of edge only shows its last edge as a pulse of 1 ms.
[[nodiscard]] bool line_level(std::size_t line, const LineEdges& edges, const IoInputs& in) noexcept;

/// SFNC CounterStatus and TimerStatus.
enum class IoStatus : std::uint32_t { idle, trigger_wait, active, completed };

/// Counter `i` of in.activity, set up as `counter`.
[[nodiscard]] std::uint32_t counter_value(const EventCounter& counter, std::size_t i,
                                          const IoInputs& in) noexcept;
[[nodiscard]] IoStatus counter_status(const EventCounter& counter, std::size_t i,
                                      const IoInputs& in) noexcept;
/// How often it has ended since its last reset from elsewhere.
[[nodiscard]] std::uint64_t counter_ends(const EventCounter& counter, std::size_t i,
                                         const IoInputs& in) noexcept;

/// When timer `i`, set up as `timer`, was started last; false when it has not been since its reset.
[[nodiscard]] bool timer_start(const PulseTimer& timer, std::size_t i, const IoInputs& in,
                               Time& start) noexcept;
/// Time it has been active since then.
[[nodiscard]] std::int64_t timer_value_ns(const PulseTimer& timer, std::size_t i,
                                          const IoInputs& in) noexcept;
[[nodiscard]] IoStatus timer_status(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept;
/// Whether its signal is high: past the delay, not past the duration.
[[nodiscard]] bool timer_level(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept;

/// Since when counters count and timers may start. One thread resets, any may read.
class IoMarks {
public:
    /// `in`: before this reset.
    void reset_counter(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept;
    /// Counts from `count` events on.
    void rebase_counter(std::size_t i, std::uint64_t count) noexcept;
    void reset_timer(std::size_t i, Time now) noexcept;
    void fill(CameraActivity& activity) const noexcept;

private:
    std::array<std::atomic<std::uint64_t>, counter_count> base_{};
    std::array<std::atomic<std::uint32_t>, counter_count> value_at_reset_{};
    std::array<std::atomic<std::int64_t>, timer_count> timer_reset_ns_{};
};

} // namespace obscura
