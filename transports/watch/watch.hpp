// SPDX-License-Identifier: Apache-2.0
// Watch transport: copies of the newest frames for programs that look at the camera.
#pragma once

#include "core/event_count.hpp"
#include "transports/frame_queue.hpp"
#include "transports/transport.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::transports {

/// A frame that has ended.
struct WatchedFrame {
    std::uint64_t number = 0; ///< counts the frames that were looked at, also those left out, from 1
    FrameInfo info;
    std::uint32_t flags = 0;           ///< FrameFlag
    std::int32_t rows = 0;             ///< that are there; the others are 0
    std::vector<std::uint16_t> pixels; ///< info.width x info.height, the first ones
};

/// Copies frames only while somebody looks, and at most as fast as its thread runs: a frame that comes while
/// two others wait is left out. It takes every frame, so that the camera counts the same whether somebody
/// looks or not. A thread of ordinary scheduling copies; the pipeline thread only puts a reference into a
/// queue. Readers are thread-safe and never hold up the copying. Not supervised: looking may wait.
class WatchTransport final : public Transport {
public:
    /// Copies of frames of `most_pixels`; `enter` is called first on the thread.
    WatchTransport(std::size_t most_pixels, std::function<void()> enter);
    ~WatchTransport() override;

    /// Frames of the pool that it may hold.
    static constexpr std::size_t frames_held = 3;

    [[nodiscard]] std::string_view kind() const override { return "watch"; }
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;

    using Frames = std::shared_ptr<const WatchedFrame>;
    /// The newest copy with a number above `after`, for which it waits until `until`, or `given_up` becomes
    /// true; null: none came. Frames are copied from the first call on until some time after the last.
    [[nodiscard]] Frames newest(std::uint64_t after, std::chrono::steady_clock::time_point until,
                                const std::atomic<bool>& given_up);

private:
    void work();
    void copy(const Frame& frame, std::uint64_t number);
    [[nodiscard]] std::shared_ptr<WatchedFrame> free_copy();

    const std::function<void()> enter_;
    FrameQueue queue_;
    EventCount wake_;
    std::atomic<bool> stopping_{false};
    std::atomic<std::int64_t> watched_until_{0};       ///< CLOCK_MONOTONIC, ns
    std::array<std::uint64_t, frames_held> numbers_{}; ///< of frame k of the queue at k % frames_held
    std::uint64_t queued_ = 0;                         ///< pipeline thread: frames that were queued
    std::uint64_t copied_ = 0;                         ///< own thread: frames that were taken out
    std::atomic<std::uint64_t> submitted_{0}, delivered_{0}, dropped_{0}, bytes_{0};
    std::thread thread_;

    /// Memory of the copies; outlives readers that are late.
    struct Copies {
        std::mutex mutex;
        std::vector<std::unique_ptr<WatchedFrame>> all;
        std::vector<WatchedFrame*> free;
    };
    const std::shared_ptr<Copies> copies_;
    mutable std::mutex mutex_; ///< of newest_
    std::condition_variable changed_;
    Frames newest_;
};

} // namespace obscura::transports
