// SPDX-License-Identifier: Apache-2.0
// Watch transport: copies of the newest frames for viewers in this and other processes.
#pragma once

#include "core/realtime/event_count.hpp"
#include "transports/frame_queue.hpp"
#include "transports/transport.hpp"
#include "transports/watch/frame_ring.hpp"
#include "transports/watch/frame_ring_reader.hpp"
#include "transports/watch/saturation_counts.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace obscura::transports {

/// A frame that has ended.
struct WatchedFrame {
    std::uint64_t number = 0; ///< counts the frames that were looked at, also those left out, from 1
    FrameInfo info;
    std::uint32_t flags = 0;           ///< FrameFlag
    std::int32_t rows = 0;             ///< that are there; the others are 0
    std::vector<std::uint16_t> pixels; ///< info.width x info.height
};

/// A frame of the ring with what its pixels do not say.
struct KeptFrame {
    std::uint64_t serial = 0; ///< of the ring
    FrameInfo info;
    std::uint32_t flags = 0;        ///< FrameFlag
    std::int32_t rows = 0;          ///< that are there
    std::vector<RowTime> row_times; ///< of all rows, scheduling clock
};

/// One pixel of a frame of the ring.
struct KeptPixel {
    std::uint16_t dn = 0;
    std::optional<float> mean_e{}; ///< see PixelTruth; none: the pool keeps none
};

/// Copies frames to a FrameRing, only while there are viewers, and at most as fast as its thread runs: a
/// frame that comes while two others wait is left out. Without viewers it keeps the last frame, and copies it
/// for the first one who looks. It takes every frame, so that the camera counts the
/// same with and without viewers. A thread of ordinary scheduling copies; the pipeline thread only puts a
/// reference into a queue. Readers of this process are thread-safe, those of others read the ring; neither
/// holds up the copying. Not supervised: viewers may wait.
class WatchTransport final : public Transport {
public:
    /// For frames of `max_pixels`; `enter` is called first on the thread. Throws HardwareError.
    WatchTransport(std::size_t max_pixels, std::function<void()> enter);
    ~WatchTransport() override;

    /// Frames of the pool that it may hold.
    static constexpr std::size_t frames_held = 5;
    static constexpr std::size_t queued_frames = 2;

    [[nodiscard]] std::string_view kind() const override { return "watch"; }
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;

    /// Has frames copied from now on for `watched_ns`: all of them, or with a distance of at least
    /// `period_ns`. The smallest period requested within that time holds. A frame that comes too
    /// soon and remains the newest one for another period is copied then, so that the last one of a series is
    /// seen. Thread-safe.
    void look(std::int64_t period_ns);
    /// A viewer that calls look() again within this time does not miss the next frame.
    static constexpr std::int64_t watched_ns = 2 * ns_per_s;

    /// A copy of the newest frame with a number above `after`, for which it waits until `until`, or
    /// `given_up` becomes true; none: none came. Looks meanwhile.
    [[nodiscard]] std::optional<WatchedFrame> newest(std::uint64_t after,
                                                     std::chrono::steady_clock::time_point until,
                                                     const std::atomic<bool>& given_up);
    /// A copy of the frame with that number; none: it is not among the latest that were copied.
    [[nodiscard]] std::optional<WatchedFrame> numbered(std::uint64_t number);
    /// What is known of the newest frame, for which it waits as newest() does.
    [[nodiscard]] std::optional<FrameInfo> newest_info(std::chrono::steady_clock::time_point until,
                                                       const std::atomic<bool>& given_up);
    /// The newest frame of the ring with that FrameInfo::frame_id; else the newest one, for which it waits as
    /// newest() does if the id is 0. None: there is none.
    [[nodiscard]] std::optional<KeptFrame> kept(std::uint64_t frame_id,
                                                std::chrono::steady_clock::time_point until,
                                                const std::atomic<bool>& given_up);
    /// The pixel in column `x` and row `y` of such a frame; none: it has been overwritten.
    [[nodiscard]] std::optional<KeptPixel> pixel(const KeptFrame& frame, std::int32_t x, std::int32_t y);
    /// Looks, and has saturated pixels counted for the same time. Thread-safe.
    void count_saturated();
    [[nodiscard]] const SaturationCounts& saturated() const noexcept { return saturated_; }
    /// TAI minus CLOCK_MONOTONIC at the newest frame that was copied; 0: none was. Thread-safe.
    [[nodiscard]] std::int64_t tai_offset_ns();
    /// For readers of other processes.
    [[nodiscard]] FrameRing& ring() noexcept { return ring_; }

private:
    /// What the queue does not say of a frame.
    struct Place {
        std::uint64_t number = 0;
        std::int64_t not_before_ns = 0; ///< if no newer frame comes until then; 0: copied in any case
    };

    /// A frame of the ring.
    struct Known {
        std::uint64_t number = 0, serial = 0; ///< 0: none
        FrameInfo info;
    };
    /// What few ask for of it.
    struct Details {
        std::vector<RowTime> row_times;
        std::vector<float> mean_e; ///< PixelTruth::mean_e; empty: the pool keeps none
    };

    /// Newest frame that came without viewers.
    struct Unseen {
        std::atomic<bool> taken{false}; ///< a thread is at it
        FrameRef frame{};
        std::uint64_t number = 0;
    };
    void keep(const FrameRef& frame, std::uint64_t number) noexcept;
    /// The newest one that was kept, with its number; empty: none.
    [[nodiscard]] std::pair<FrameRef, std::uint64_t> take_unseen() noexcept;

    void work();
    /// The frame with its pixels; none: it has been overwritten.
    [[nodiscard]] std::optional<WatchedFrame> copy_of(const Known& known) const;
    /// When `place` is to be copied if no newer frame comes; CLOCK_MONOTONIC.
    [[nodiscard]] Time due(const Place& place) const noexcept;
    void copy(const Frame& frame, std::uint64_t number);
    void look_locked(std::int64_t period_ns);

    const std::function<void()> enter_;
    FrameQueue queue_;
    EventCount wake_;
    std::atomic<bool> stopping_{false};
    std::atomic<std::int64_t> watched_until_{0}; ///< CLOCK_MONOTONIC, ns
    std::atomic<std::int64_t> period_ns_{0};
    std::uint64_t seen_ = 0;                      ///< pipeline thread: frames that came
    std::array<Unseen, 2> unseen_{};              ///< while a reader is at one of them the other is free
    std::atomic<std::uint64_t> unseen_number_{0}; ///< of the newest one of these
    std::atomic<bool> unseen_wanted_{false};
    std::int64_t next_ns_ = 0;                      ///< pipeline thread: earliest next frame that is copied
    std::array<Place, queued_frames + 1> places_{}; ///< of frame k of the queue at k % frames_held
    std::uint64_t queued_ = 0;                      ///< pipeline thread: frames that were queued
    std::atomic<std::uint64_t> taken_{0};           ///< own thread: frames that were taken out
    std::atomic<std::uint64_t> submitted_{0}, delivered_{0}, dropped_{0}, bytes_{0};
    std::thread thread_;

    FrameRing ring_; ///< written by the own thread
    const FrameRingReader reader_;
    SaturationCounts saturated_; ///< noted by the own thread

    std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::int64_t period_until_ = 0;
    std::uint64_t newest_number_ = 0;               ///< of the ring; 0: a newer one has come since
    std::array<Known, FrameRing::slots> known_{};   ///< that with serial s at s % slots
    std::array<Details, FrameRing::slots> details_; ///< of those
    std::size_t newest_ = 0;                        ///< among them
};

} // namespace obscura::transports
