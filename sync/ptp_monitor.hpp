// Monitor of ptp4l on this machine: polls its clock state over the management socket.
#pragma once

#include "core/heartbeat.hpp"
#include "core/ptp_status.hpp"

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
    std::int64_t lock_ns = 10'000;          ///< a slave is locked when its offset is at most this
    std::int64_t poll_ns = 1'000'000'000;   ///< between rounds of questions
    std::int64_t patience_ns = 200'000'000; ///< for each answer
};

/// A thread that talks to ptp4l's management socket. It may come and go; while it is away `state` is unknown.
/// Only the peer that was connected to is heard, and what it says is checked.
class PtpMonitor {
public:
    explicit PtpMonitor(PtpMonitorSettings settings);
    ~PtpMonitor();
    PtpMonitor(const PtpMonitor&) = delete;
    PtpMonitor& operator=(const PtpMonitor&) = delete;

    /// Any ordinary thread.
    [[nodiscard]] PtpStatus status() const;
    /// To be added to the kernel's CLOCK_TAI, in ns: the announced offset from UTC while the kernel has none,
    /// from the first lock on; else 0.
    [[nodiscard]] std::int64_t tai_correction_ns() const noexcept {
        return correction_ns_.load(std::memory_order_relaxed);
    }
    /// Of its thread. Any thread.
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

private:
    void loop();
    bool poll_once(PtpStatus& status);

    const PtpMonitorSettings settings_;
    std::uint16_t sequence_ = 0; // of the thread
    mutable std::mutex mutex_;   // guards status_ and quit_
    std::condition_variable wake_;
    PtpStatus status_;
    bool quit_ = false;
    std::atomic<std::int64_t> correction_ns_{0};
    Heartbeat heartbeat_{"ptp-monitor"};
    std::thread thread_;
};

/// Whether the clock is the network's or follows it to within `lock_ns`.
[[nodiscard]] bool ptp_locked(const PtpStatus& status, std::int64_t lock_ns);

/// What kernel and network together make of the offset between TAI and the kernel's CLOCK_TAI.
[[nodiscard]] std::int64_t tai_correction_from(const PtpStatus& status, int kernel_tai_s,
                                               std::int64_t before_ns);

} // namespace obscura::sync
