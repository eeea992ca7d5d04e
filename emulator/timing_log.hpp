// When everything happened to each frame: recorded on a real-time thread, written as CSV by an ordinary one.
#pragma once

#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <iosfwd>

namespace obscura::emulator {

/// The stamps of one frame, scheduling clock; 0 where not reached.
struct FrameTiming {
    std::uint64_t frame_id = 0, trigger_id = 0;
    Time edge, seen, render_begin, render_end, detector_end;
    Time due;      ///< release time of the first row
    Time first;    ///< its release
    Time last_due; ///< release time of the last row
    Time last;     ///< its release
    std::uint32_t rows = 0, late_rows = 0;
    std::int64_t worst_row_ns = 0; ///< how long after its time the latest row became ready
    std::uint32_t flags = 0;       ///< FrameFlag
};

/// A queue between the releasing thread and the one that writes. push() neither allocates nor waits.
class TimingLog {
public:
    void push(const FrameTiming& timing) noexcept;
    /// Appends what has gathered to `out`, one line a frame; returns the number of lines. One thread at a
    /// time.
    std::size_t drain(std::ostream& out);
    /// Discards what has gathered.
    void discard() noexcept;
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

    /// The first line of the file: names of the columns, times in ns of the scheduling clock.
    static const char* header() noexcept;

private:
    static constexpr std::size_t capacity = 1024;
    std::array<FrameTiming, capacity> cells_{};
    std::atomic<std::size_t> head_{0}, tail_{0};
    std::atomic<std::uint64_t> lost_{0};
};

} // namespace obscura::emulator
