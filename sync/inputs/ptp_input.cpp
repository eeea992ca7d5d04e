// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/ptp_input.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "sync/clock_reading.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/ptp_clock.h>
#include <poll.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace obscura::sync {
namespace {

class PtpInput final : public EdgeInput {
public:
    PtpInput(const std::string& table, const std::string& device, unsigned channel)
        : fd_(::open(device.c_str(), O_RDWR | O_CLOEXEC)), channel_(channel) {
        if (!fd_) throw HardwareError(fmt::format("{}.device: {}: {}", table, device, std::strerror(errno)));
        ptp_clock_caps caps{};
        if (::ioctl(fd_.get(), PTP_CLOCK_GETCAPS, &caps) != 0)
            throw HardwareError(
                fmt::format("{}.device: {}: no PTP clock ({})", table, device, std::strerror(errno)));
        if (caps.n_ext_ts <= static_cast<int>(channel))
            throw HardwareError(
                fmt::format("{}.channel: {}: {} has {} input(s)", table, channel, device, caps.n_ext_ts));
        ptp_extts_request request{};
        request.index = channel;
        request.flags = PTP_ENABLE_FEATURE | PTP_RISING_EDGE;
        if (::ioctl(fd_.get(), PTP_EXTTS_REQUEST, &request) != 0)
            throw HardwareError(fmt::format("{}.device: {}: input {} cannot be enabled ({})", table, device,
                                            channel, std::strerror(errno)));
    }
    ~PtpInput() override {
        ptp_extts_request request{};
        request.index = channel_;
        ::ioctl(fd_.get(), PTP_EXTTS_REQUEST, &request);
    }

    int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept override {
        pollfd poll{fd_.get(), POLLIN, 0};
        const timespec limit{timeout_ns / ns_per_s, timeout_ns % ns_per_s};
        const int ready = ::ppoll(&poll, 1, &limit, nullptr);
        if (ready == 0 || (ready < 0 && errno == EINTR)) return 0;
        if (ready < 0 || (poll.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return gone;
        std::array<ptp_extts_event, 16> events;
        const ssize_t bytes =
            ::read(fd_.get(), events.data(), std::min(events.size(), edges.size()) * sizeof events[0]);
        if (bytes < 0) return errno == EINTR || errno == EAGAIN ? 0 : gone;
        timespec now{};
        clock_gettime(CLOCK_MONOTONIC, &now);
        const std::int64_t difference = monotonic_minus(clock_of_device(fd_.get()));
        int count = 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(bytes) / sizeof events[0]; ++i) {
            if (events[i].index != channel_) continue;
            const std::int64_t at_ns = events[i].t.sec * ns_per_s + events[i].t.nsec;
            edges[static_cast<std::size_t>(count++)] = {plausible_edge(at_ns, difference, Time{to_ns(now)}),
                                                        0};
        }
        return count;
    }

private:
    FileDescriptor fd_;
    unsigned channel_;
};

} // namespace

std::unique_ptr<EdgeInput> open_ptp(const std::string& table, const std::string& device, unsigned channel) {
    return std::make_unique<PtpInput>(table, device, channel);
}

} // namespace obscura::sync
