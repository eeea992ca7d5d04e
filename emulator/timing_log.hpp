// When everything happened to each frame: recorded on a real-time thread, written as CSV by an ordinary one.
#pragma once

#include "core/time.hpp"
#include "core/transmit_timestamps.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

namespace obscura::emulator {

/// The stamps of one frame, scheduling clock; 0 where not reached.
struct FrameTiming {
    std::uint64_t frame_id = 0, trigger_id = 0;
    Time edge, seen, pose, render_begin, render_end, detector_end;
    Time due;      ///< release time of the first row
    Time first;    ///< its release
    Time last_due; ///< release time of the last row
    Time last;     ///< its release
    std::uint32_t rows = 0, late_rows = 0;
    std::int64_t worst_row_ns = 0; ///< how long after its time the latest row left
    std::uint32_t worst_row = 0;   ///< which one that was
    std::uint32_t flags = 0;       ///< FrameFlag
    Time ended;                    ///< when the releasing thread was done with it

    /// How long after its time each row left, in microseconds; empty where rows are not kept.
    std::span<std::int32_t> row_lateness_us;
    static constexpr std::int32_t not_released = INT32_MAX;
    const TransmitTimestamps* transmit = nullptr; ///< written until the transports are done with the frame
};

/// A queue between the releasing thread and the one that writes. push() neither allocates nor waits.
class TimingLog {
public:
    /// Names the columns of transmit timestamps: the kinds of the camera's transports, by slot. Before frames
    /// are made. Allocates.
    void set_transports(std::vector<std::string> kinds);
    /// Before frames are made: the lateness of every row is kept as well, of frames up to `max_rows`.
    /// Allocates.
    void keep_rows(std::size_t max_rows);

    /// Cleared transmit timestamps for the frame begun as the `number`-th. Thread that begins frames.
    [[nodiscard]] TransmitTimestamps& transmit_timestamps(std::uint32_t number) noexcept;
    /// For the rows of the frame that push() comes for next: `rows` entries not_released, or nothing where
    /// they are not kept. Releasing thread.
    [[nodiscard]] std::span<std::int32_t> next_rows(std::size_t rows) noexcept;
    void push(const FrameTiming& timing) noexcept;

    /// Appends what has gathered of frames that ended before `before` to `out`, one line a frame; returns the
    /// number of lines. Transports have to be done with those frames. One thread at a time.
    std::size_t drain(std::ostream& out, Time before = Time{INT64_MAX});
    /// Discards what has gathered.
    void discard() noexcept;
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

    /// The first line of the file: names of the columns, times in ns of the scheduling clock.
    [[nodiscard]] std::string header() const;

private:
    static constexpr std::size_t capacity = 1024;
    std::array<FrameTiming, capacity> cells_{};
    // Twice as many: frames are begun before a line is pushed for them.
    std::array<TransmitTimestamps, 2 * capacity> transmit_;
    std::vector<std::string> transports_; ///< kinds by slot
    std::vector<std::int32_t> rows_;      ///< max_rows_ for each cell
    std::size_t max_rows_ = 0;
    std::atomic<std::size_t> head_{0}, tail_{0};
    std::atomic<std::uint64_t> lost_{0};
};

} // namespace obscura::emulator
