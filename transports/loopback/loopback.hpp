// SPDX-License-Identifier: Apache-2.0
// In-process transport for tests: keeps frames and calls back for each.
#pragma once

#include "transports/transport.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::transports {

/// Queue and storage sizes of a LoopbackTransport, and its callback.
struct LoopbackSettings {
    std::size_t queue_frames = 4; ///< frames taken and not yet complete; more are dropped
    std::size_t keep_frames = 0;  ///< complete frames kept; each one occupies a frame of the pool
    /// Called on the transport's thread for every frame that has ended, complete or abandoned.
    std::function<void(const FrameRef&)> on_frame;
};

/// Transport that waits for each frame to be filled, in the order of submission.
class LoopbackTransport final : public Transport {
public:
    explicit LoopbackTransport(LoopbackSettings settings);
    ~LoopbackTransport() override;

    [[nodiscard]] std::string_view kind() const override { return "loopback"; }
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;

    /// The frames kept so far, oldest first.
    [[nodiscard]] std::vector<FrameRef> kept() const;

private:
    void run();

    const LoopbackSettings settings_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    // Ring of fixed size, so that submit() does not allocate.
    std::vector<FrameRef> queue_;
    std::size_t queued_ = 0, head_ = 0;
    std::deque<FrameRef> kept_;
    TransportCounters counters_;
    bool running_ = false;
    std::thread thread_;
};

} // namespace obscura::transports
