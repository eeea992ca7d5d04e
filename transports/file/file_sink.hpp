// SPDX-License-Identifier: Apache-2.0
// File transport: writes every frame to a file. Read this first.
#pragma once

#include "core/realtime/event_count.hpp"
#include "core/realtime/realtime.hpp"
#include "transports/file/settings.hpp"
#include "transports/frame_queue.hpp"
#include "transports/transport.hpp"

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace obscura::images {
class RowFile;
}

namespace obscura::transports {

/// Writes frame_000001.png and so on (frame id, format) into a folder; the second and later acquisitions of
/// one start() write run2_frame_000001.png and so on. A thread of its own waits for each frame to be
/// complete. A file that cannot be written counts as a dropped frame and is logged once until writing
/// succeeds again. A frame that its producer abandoned is written with the missing rows 0 and PARTIAL set, or
/// dropped if it has no rows.
///
/// stop() expects every frame to be complete or abandoned; it writes queued frames for at most 0.3 s and
/// drops the rest. submit() is thread-bound.
class FileSink final : public Transport {
public:
    explicit FileSink(FileSinkSettings settings);
    ~FileSink() override;

    [[nodiscard]] std::string_view kind() const override { return "file"; }
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;
    [[nodiscard]] bool delivers_all() const noexcept override { return true; }
    /// With the folder and, from the first frame on, the room on its disk.
    [[nodiscard]] TransportStatistics statistics() const override;
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }

private:
    void work();
    void write(const Frame& frame);
    /// Throws OutputError.
    void append_truth(const std::filesystem::path& file, const Frame& frame);

    FileSinkSettings settings_;
    FrameQueue queue_; ///< filled by submit(), emptied by work()
    EventCount wake_;
    Heartbeat heartbeat_{"file-sink"};
    std::atomic<bool> stopping_{false};
    std::thread thread_;

    std::atomic<std::uint64_t> submitted_{0}, delivered_{0}, dropped_{0}, bytes_{0};
    std::vector<std::uint16_t> partial_; ///< copy of a partial frame
    std::uint64_t last_id_ = 0, run_ = 1;
    std::uint64_t truth_run_ = 0; ///< whose truth.csv has been begun
    std::unique_ptr<images::RowFile> truth_table_;
    std::atomic<bool> failing_{false};
    std::atomic<std::uint64_t> free_bytes_{0}; ///< on the disk, after the latest frame; 0: not known
};

} // namespace obscura::transports
