// Finds out when counters and timers end, for those whom that triggers.
#pragma once

#include "core/io_state.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>

namespace obscura::emulator {

/// Looked at by one real-time thread, whenever something may have happened; set up by one control thread.
class IoEnds {
public:
    // Control side.

    void set(const CameraSettings& settings, const IoInputs& in);
    void reset_counter(std::size_t i, const IoInputs& in) noexcept;
    void reset_timer(std::size_t i, Time now) noexcept { marks_.reset_timer(i, now); }
    /// Those that an acquisition start resets.
    void acquisition_start(const IoInputs& in) noexcept;

    // Any thread.

    /// No counter and no timer listens to anything: no need to look.
    [[nodiscard]] bool idle() const noexcept { return idle_.load(std::memory_order_relaxed); }
    void fill(CameraActivity& activity) const noexcept { marks_.fill(activity); }

    // The thread that looks.

    /// Takes over what was set meanwhile.
    void begin_look() noexcept;
    /// How often counter `i` has ended since the last look, and when it did last. Never, where it counts
    /// missed triggers: what its end triggers could be missed in turn, without end.
    [[nodiscard]] std::uint64_t new_counter_ends(std::size_t i, const IoInputs& in, Time& last) noexcept;
    /// Whether timer `i` was started since the last look, and when it ends.
    [[nodiscard]] bool timer_started(std::size_t i, const IoInputs& in, Time& end) noexcept;

    /// Whether it has not been reset or set up anew since.
    [[nodiscard]] bool timer_runs(std::size_t i, const IoInputs& in) noexcept;

private:
    /// What has happened of one when it was set up is no news.
    struct Counter {
        EventCounter set_up;
        std::uint64_t base = 0, ended = 0;
    };
    struct Timer {
        PulseTimer set_up;
        Time started;
    };

    IoMarks marks_;
    std::mutex mutex_; ///< of what is wanted; who looks only ever tries to take it
    std::array<Counter, counter_count> wanted_counters_;
    std::array<Timer, timer_count> wanted_timers_;
    std::atomic<bool> idle_{true};
    // The thread that looks.
    std::array<Counter, counter_count> counters_;
    std::array<Timer, timer_count> timers_;
};

} // namespace obscura::emulator
