// SPDX-License-Identifier: Apache-2.0
// Time stamps of each frame: recorded on a real-time thread, written as CSV by an ordinary one.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "core/camera/transmit_timestamps.hpp"
#include "core/time.hpp"
#include "emulator/render/frame_work.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Time stamps of one frame, scheduling clock; 0 if the frame did not reach that stage.
struct FrameTiming {
    std::uint64_t frame_id = 0, trigger_id = 0;
    Time edge, seen, pose, render_begin, render_end, detector_end;
    Time due;                                                ///< release time of the first row
    Time first;                                              ///< actual release of the first row
    Time last_due;                                           ///< release time of the last row
    Time last;                                               ///< actual release of the last row
    std::uint32_t rows = 0, late_rows = 0, stalled_rows = 0; ///< see ReleaseCounters
    std::int64_t worst_row_ns = 0;                           ///< lateness of the latest row
    std::uint32_t worst_row = 0;                             ///< number of the latest row
    std::uint32_t flags = 0;                                 ///< FrameFlag
    std::int32_t width = 0, height = 0;                      ///< of the image
    FrameFacts facts;
    FrameWork work;       ///< 0 if the frame was not made to its end
    FrameQuality quality; ///< as it was published
    Time ended;           ///< end of the frame on the release thread

    /// Lateness of each row in microseconds; empty if rows are not kept.
    std::span<std::int32_t> row_lateness_us;
    static constexpr std::int32_t not_released = INT32_MAX;
    const TransmitTimestamps* transmit = nullptr; ///< written until the transports have finished the frame
};

/// Queue between the release thread and the thread that writes. push() is real-time safe.
class TimingLog {
public:
    /// Names the columns of transmit timestamps: the kinds of the camera's transports, by slot. Before frames
    /// are made. Allocates.
    void set_transports(std::vector<std::string> kinds);
    /// Settings that the file states for each frame. Before frames are made.
    void set_render(const RenderFacts& facts) { render_ = facts; }
    /// Keeps the lateness of every row too, for frames of up to `max_rows`. Before frames are made.
    /// Allocates.
    void keep_rows(std::size_t max_rows);

    /// Cleared transmit timestamps for the `number`-th frame. Called on the thread that begins frames.
    [[nodiscard]] TransmitTimestamps& transmit_timestamps(std::uint32_t number) noexcept;
    /// Row lateness of the frame of the next push(): `rows` entries not_released, or empty if rows are not
    /// kept. Called on the release thread.
    [[nodiscard]] std::span<std::int32_t> next_rows(std::size_t rows) noexcept;
    void push(const FrameTiming& timing) noexcept;

    /// Passes the queued frames that ended before `before` to `take`, oldest first; returns their number.
    /// Transports must have finished those frames. Thread-safe.
    std::size_t drain(const std::function<void(const FrameTiming&)>& take, Time before = Time{INT64_MAX});
    /// Keeps drain() of other threads waiting while the lock lives: what is queued stays. Thread-safe.
    [[nodiscard]] std::unique_lock<std::mutex> hold() const { return std::unique_lock(draining_); }
    /// Passes the queued frames to `look`, oldest first. Transports may still send them. Within hold().
    void queued(const std::function<void(const FrameTiming&)>& look) const;
    /// The same as drain(), to the file.
    std::size_t drain(std::ostream& out, Time before = Time{INT64_MAX},
                      std::span<const std::int64_t> pace_ns = {});
    /// Row of a frame, with its line end. `pace_ns`: see Transport::pace_ns(), by slot; none: 0.
    [[nodiscard]] std::string row(const FrameTiming& frame, std::span<const std::int64_t> pace_ns) const;
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

    /// First line of the file: names of the columns; times are in ns of the scheduling clock.
    [[nodiscard]] std::string header() const;
    /// Kinds of the camera's transports, by slot.
    [[nodiscard]] const std::vector<std::string>& transports() const noexcept { return transports_; }
    [[nodiscard]] const RenderFacts& render() const noexcept { return render_; }

private:
    static constexpr std::size_t capacity = 1024;
    std::array<FrameTiming, capacity> cells_{};
    // Twice as many as cells, because a frame uses them from its begin, before its push().
    std::array<TransmitTimestamps, 2 * capacity> transmit_;
    std::vector<std::string> transports_; ///< kinds by slot
    RenderFacts render_;
    std::vector<std::int32_t> rows_; ///< max_rows_ for each cell
    std::size_t max_rows_ = 0;
    mutable std::mutex draining_; ///< of readers; push() never waits
    std::atomic<std::size_t> head_{0}, tail_{0};
    std::atomic<std::uint64_t> lost_{0};
};

} // namespace obscura::emulator
