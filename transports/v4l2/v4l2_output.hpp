// SPDX-License-Identifier: Apache-2.0
// V4L2 transport: feeds a Linux video output node (v4l2loopback or another). Read this first.
#pragma once

#include "transports/frame_queue.hpp"
#include "transports/transport.hpp"
#include "transports/v4l2/settings.hpp"
#include "transports/v4l2/v4l2_calls.hpp"
#include "transports/v4l2/v4l2_node.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace obscura::transports {

/// Counters of the node since start(); values may be a frame behind.
struct V4l2Counters {
    std::uint64_t opened = 0;   ///< times the node was opened successfully
    std::uint64_t lost = 0;     ///< times it disappeared or failed while in use
    std::uint64_t refused = 0;  ///< failed attempts to open it
    std::uint64_t problems = 0; ///< causes, each logged once until an image is sent again
    std::uint64_t no_node = 0;  ///< frames dropped because the node was missing
    std::uint64_t busy = 0;     ///< frames dropped because the driver had no free buffer
    std::uint64_t partial = 0;  ///< frames dropped because their producer abandoned them
};

/// Sends only complete frames: windows composed as in the frame, in the format of the settings. Time stamps
/// are the trigger edges (CLOCK_MONOTONIC, truncated to us) in mmap mode and the driver's own in write()
/// mode. A thread of its own packs rows as they become final, so an image is sent right after its last row.
///
/// A node that is missing, held by another program or removed is tried again at growing intervals and does
/// not disturb the daemon; each cause is logged once, and so is the recovery.
///
/// stop() expects every frame to be complete or abandoned; it sends queued frames for at most 0.3 s and drops
/// the rest. submit() is thread-bound and makes one system call (an eventfd).
class V4l2Output final : public Transport {
public:
    explicit V4l2Output(V4l2Settings settings, const V4l2Context& context = {},
                        V4l2Calls& calls = system_v4l2_calls());
    ~V4l2Output() override;

    [[nodiscard]] std::string_view kind() const override { return "v4l2"; }
    /// Throws HardwareError if the node cannot be used and the settings require it.
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;
    [[nodiscard]] bool delivers_all() const noexcept override { return true; }
    /// With the node, and why it is not used.
    [[nodiscard]] TransportStatistics statistics() const override;
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }
    [[nodiscard]] V4l2Counters v4l2_counters() const noexcept;

private:
    using Instant = std::chrono::steady_clock::time_point;
    struct Wake {
        Wake();
        ~Wake();
        Wake(const Wake&) = delete;
        Wake& operator=(const Wake&) = delete;
        void up() const noexcept;
        /// Waits until up() is called, at most `timeout_ns`.
        void wait(std::int64_t timeout_ns) const noexcept;
        int fd;
    };

    void work();
    /// Opens the node for `image`, in place of the one that is open. Throws HardwareError.
    void open(V4l2Image image);
    /// Opens like open(); on failure logs the cause once and sets the time of the next attempt.
    void try_open(V4l2Image image, Instant now);
    void lose(const std::string& problem, Instant now);
    void report(const std::string& problem);
    void set_trouble(const std::string& problem);
    void retry_later(Instant now);
    void delivered();
    void send(const Frame& frame);

    V4l2Settings settings_;
    const V4l2Context context_;
    V4l2Calls& calls_;
    V4l2Image announced_; ///< image the node is opened for before the first frame
    FrameQueue queue_;    ///< filled by submit(), emptied by work()
    Wake wake_;
    Heartbeat heartbeat_{"v4l2-output"};
    std::atomic<bool> stopping_{false};
    std::thread thread_;

    std::unique_ptr<V4l2Node> node_; ///< used by work() only, while it runs
    Instant next_try_{};
    std::int64_t retry_ns_ = 0;
    std::vector<std::string> reported_; ///< causes logged since the last image sent
    std::string described_;             ///< description of the node logged last
    std::uint64_t missed_ = 0;          ///< frames dropped since the last recovery
    mutable std::mutex trouble_mutex_;
    std::string trouble_; ///< why the node is not open; empty: it is

    std::atomic<std::uint64_t> submitted_{0}, delivered_{0}, dropped_{0}, bytes_{0};
    std::atomic<std::uint64_t> opened_{0}, lost_{0}, refused_{0}, problems_{0}, no_node_{0}, busy_{0},
        partial_{0};
};

} // namespace obscura::transports
