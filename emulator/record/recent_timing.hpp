// SPDX-License-Identifier: Apache-2.0
// Time stamps of the newest frames, and latencies of the stages before their rows leave.
#pragma once

#include "core/camera/transmit_timestamps.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "emulator/record/timing_log.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Latencies of all frames since the start; those that did not reach a stage are not in its histogram.
struct StageLatencies {
    LatencyHistogram trigger_seen; ///< from the trigger edge until the camera has seen it
    LatencyHistogram render;       ///< of the renderer: from its first to its last row
    LatencyHistogram detector;     ///< from the last rendered row until the detector has made the last one
    std::array<LatencyHistogram, max_transports> first_byte; ///< from the edge, by slot
};

/// Filled by the main thread from the timing log, so that real-time threads do no more for it than push their
/// time stamps. Thread-safe: note() on one thread, the rest on any.
class RecentTiming {
public:
    /// `log` outlives this. `rows`: frames that are kept.
    RecentTiming(const TimingLog& log, std::size_t rows) : log_(log), most_(rows) { kept_.reserve(rows); }

    /// A frame that its transports have finished.
    void note(const FrameTiming& frame);
    [[nodiscard]] const StageLatencies& stages() const noexcept { return stages_; }

    /// Names of the numbers of a row: those of the timing file that are whole numbers of the frame, then
    /// first and last byte of each transport.
    [[nodiscard]] std::vector<std::string> columns() const;
    using Row = std::vector<std::optional<std::int64_t>>;
    /// A frame of Rows.
    struct Frame {
        std::uint64_t id = 0;
        Time edge, ended;
    };
    struct Rows {
        std::vector<Row> rows;     ///< oldest first
        std::vector<Frame> frames; ///< of the rows
        std::uint64_t last = 0;    ///< number of the newest frame; frames are counted since the start, from 1
    };
    /// The newest rows with a number above `after`, at most `most` of them. An instant that a frame does not
    /// have is none. `early`: also of frames that are still in the log, because transports may be sending
    /// them; note() is called from drain() then.
    [[nodiscard]] Rows rows(std::uint64_t after, std::size_t most, bool early = false) const;

    /// How late each row of a frame left.
    struct RowLateness {
        std::uint64_t frame_id = 0, acquisition = 0;
        std::vector<std::int32_t> us; ///< by row; FrameTiming::not_released: it did not leave
    };
    /// The newest kept frame with that id, of the latest acquisition that has one; 0: the newest of all. None
    /// if it is not kept any more. Rows are kept if the log keeps them.
    [[nodiscard]] std::optional<RowLateness> row_lateness(std::uint64_t frame_id) const;

private:
    struct Kept {
        FrameTiming frame;
        std::array<Time, max_transports> first_byte, last_byte;
        std::vector<std::int32_t> row_lateness_us;

        explicit Kept(const FrameTiming& timing);
    };
    void add_row(Rows& found, const Kept& kept) const;

    const TimingLog& log_;
    const std::size_t most_;
    StageLatencies stages_;
    mutable std::mutex mutex_;
    std::vector<Kept> kept_; ///< ring
    std::uint64_t frames_ = 0;
};

} // namespace obscura::emulator
