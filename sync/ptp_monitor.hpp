// SPDX-License-Identifier: Apache-2.0
// Monitor of ptp4l on this machine: polls its clock state over the management socket.
#pragma once

#include "core/ptp_status.hpp"
#include "core/realtime/heartbeat.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

namespace obscura::sync {

struct PtpMonitorSettings {
    std::string socket; ///< ptp4l's uds_address
    std::uint8_t domain = 0;
    std::int64_t lock_ns = 10'000;                ///< a slave is locked when its offset is at most this
    std::int64_t poll_ns = 1'000'000'000;         ///< interval between rounds of requests
    std::int64_t answer_timeout_ns = 200'000'000; ///< timeout of each response
};

/// A thread that queries ptp4l's management socket. ptp4l may stop and restart; while it is absent `state` is
/// unknown. Only messages of the connected peer are received, and all of them are validated.
class PtpMonitor {
public:
    explicit PtpMonitor(PtpMonitorSettings settings);
    ~PtpMonitor();
    PtpMonitor(const PtpMonitor&) = delete;
    PtpMonitor& operator=(const PtpMonitor&) = delete;

    /// Thread-safe, not real-time safe.
    [[nodiscard]] PtpStatus status() const;
    /// Correction to add to the kernel's CLOCK_TAI, in ns: the announced offset from UTC, from the first lock
    /// on, while the kernel has no TAI offset; else 0.
    [[nodiscard]] std::int64_t tai_correction_ns() const noexcept {
        return correction_ns_.load(std::memory_order_relaxed);
    }
    /// Heartbeat of the monitor's thread. Thread-safe.
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

private:
    void loop();
    bool poll_once(PtpStatus& status);

    const PtpMonitorSettings settings_;
    std::uint16_t sequence_ = 0; // used by the thread only
    mutable std::mutex mutex_;   // guards status_ and quit_
    std::condition_variable wake_;
    PtpStatus status_;
    bool quit_ = false;
    std::atomic<std::int64_t> correction_ns_{0};
    Heartbeat heartbeat_{"ptp-monitor"};
    std::thread thread_;
};

/// Whether the clock is the network's grandmaster or follows it to within `lock_ns`.
[[nodiscard]] bool ptp_locked(const PtpStatus& status, std::int64_t lock_ns);

/// Offset between TAI and the kernel's CLOCK_TAI, from the offsets of kernel and network.
[[nodiscard]] std::int64_t tai_correction_from(const PtpStatus& status, int kernel_tai_s,
                                               std::int64_t before_ns);

} // namespace obscura::sync
