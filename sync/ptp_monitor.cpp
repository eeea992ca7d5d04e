// SPDX-License-Identifier: Apache-2.0
#include "sync/ptp_monitor.hpp"

#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "sync/ptp_management.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace obscura::sync {
namespace {

// Time without a response after which ptp4l counts as gone.
constexpr int patient_rounds = 3;

using SteadyClock = std::chrono::steady_clock;

/// A local datagram socket with an abstract name chosen by the kernel, connected to ptp4l.
class ManagementSocket {
public:
    explicit ManagementSocket(const std::string& path)
        : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
        sockaddr_un own{}, peer{};
        own.sun_family = peer.sun_family = AF_UNIX;
        if (path.size() >= sizeof peer.sun_path) return;
        std::memcpy(peer.sun_path, path.c_str(), path.size());
        connected_ = bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own.sun_family) == 0 &&
                     connect(fd_, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) == 0;
    }
    ~ManagementSocket() {
        if (fd_ >= 0) close(fd_);
    }
    ManagementSocket(const ManagementSocket&) = delete;
    ManagementSocket& operator=(const ManagementSocket&) = delete;

    [[nodiscard]] bool connected() const { return connected_; }
    bool send_all(std::span<const std::uint8_t> bytes) const {
        return send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
    }
    /// Receives a message; empty when none arrives before `deadline`.
    std::span<const std::uint8_t> receive(SteadyClock::time_point deadline) {
        for (;;) {
            const auto left =
                std::chrono::duration_cast<std::chrono::milliseconds>(deadline - SteadyClock::now()).count();
            pollfd p{fd_, POLLIN, 0};
            if (left < 0 || poll(&p, 1, static_cast<int>(left) + 1) <= 0) return {};
            const ssize_t n = recv(fd_, buffer_.data(), buffer_.size(), MSG_TRUNC);
            if (n < 0) return {};
            if (static_cast<std::size_t>(n) <= buffer_.size())
                return {buffer_.data(), static_cast<std::size_t>(n)};
        }
    }

private:
    int fd_;
    bool connected_ = false;
    std::array<std::uint8_t, 1500> buffer_{};
};

} // namespace

std::int64_t tai_correction_from(const PtpStatus& status, int kernel_tai_s, std::int64_t before_ns) {
    if (kernel_tai_s != 0) return 0;
    if (!status.locked || !status.ptp_timescale) return before_ns;
    return std::int64_t{status.utc_offset_s} * 1'000'000'000;
}

bool ptp_locked(const PtpStatus& status, std::int64_t lock_ns) {
    if (status.state == PtpState::master) return true;
    // A ptp4l that only measures (free_running) while another program steers the clock never leaves
    // "uncalibrated"; a measured path delay shows that its offset is valid.
    const bool follows = status.state == PtpState::slave ||
                         (status.state == PtpState::uncalibrated && status.path_delay_ns != 0);
    return follows && status.offset_ns <= lock_ns && status.offset_ns >= -lock_ns;
}

PtpMonitor::PtpMonitor(PtpMonitorSettings settings) : settings_(std::move(settings)) {
    thread_ = std::thread([this] {
        name_this_thread(heartbeat_.name().c_str());
        loop();
        heartbeat_.rest();
    });
}

PtpMonitor::~PtpMonitor() {
    {
        const std::lock_guard lock(mutex_);
        quit_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

PtpStatus PtpMonitor::status() const {
    const std::lock_guard lock(mutex_);
    return status_;
}

void PtpMonitor::loop() {
    bool was_locked = false, was_heard = false;
    std::uint32_t answers = 0;
    int misses = 0;
    std::unique_lock lock(mutex_);
    while (!quit_) {
        lock.unlock();
        PtpStatus now;
        bool heard = poll_once(now);
        answers += heard;
        if (heard) {
            misses = 0;
        } else if (++misses < patient_rounds && was_heard) {
            heard = true; // ptp4l is present but busy
            now = status();
        } else {
            now = {};
        }
        now.answers = answers;
        now.locked = ptp_locked(now, settings_.lock_ns);
        timex kernel{};
        const int kernel_tai_s = adjtimex(&kernel) >= 0 ? kernel.tai : 0;
        correction_ns_.store(tai_correction_from(now, kernel_tai_s, correction_ns_.load()));
        if (heard != std::exchange(was_heard, heard)) {
            if (heard)
                log_info("ptp: {} answers", settings_.socket);
            else
                log_warning("ptp: {} does not answer any more", settings_.socket);
        }
        if (now.locked != std::exchange(was_locked, now.locked))
            log_notice("ptp: {} (state {}, offset {} ns, TAI - UTC {} s)",
                       now.locked ? "locked" : "not locked", static_cast<int>(now.state), now.offset_ns,
                       now.utc_offset_s);
        lock.lock();
        status_ = now;
        // Wait in steps, with a heartbeat before each.
        for (std::int64_t left_ns = settings_.poll_ns; left_ns > 0 && !quit_;
             left_ns -= Heartbeat::max_wait_ns) {
            heartbeat_.beat();
            wake_.wait_for(lock, std::chrono::nanoseconds(std::min(left_ns, Heartbeat::max_wait_ns)),
                           [this] { return quit_; });
        }
    }
}

bool PtpMonitor::poll_once(PtpStatus& status) {
    // Open a socket for each round: ptp4l may have been restarted, and late responses are discarded.
    ManagementSocket socket(settings_.socket);
    if (!socket.connected()) return false;
    for (const PtpDataSet set : ptp_data_sets) {
        if (!socket.send_all(ptp_get(set, settings_.domain, ++sequence_))) return false;
        heartbeat_.beat();
        const auto deadline = SteadyClock::now() + std::chrono::nanoseconds(settings_.answer_timeout_ns);
        bool taken = false;
        while (!taken) {
            const auto answer = socket.receive(deadline);
            if (answer.empty()) return false;
            taken = ptp_take_answer(answer, set, settings_.domain, sequence_, status);
        }
        // Receive one response per port; further ones follow the first at once.
        if (set == PtpDataSet::port)
            for (auto more = socket.receive(SteadyClock::now()); !more.empty();
                 more = socket.receive(SteadyClock::now()))
                ptp_take_answer(more, set, settings_.domain, sequence_, status);
    }
    return true;
}

} // namespace obscura::sync
