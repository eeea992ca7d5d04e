// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/pps_input.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "sync/clock_reading.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/pps.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>

namespace obscura::sync {
namespace {

class PpsInput final : public EdgeInput {
public:
    PpsInput(const std::string& table, const std::string& device)
        : fd_(::open(device.c_str(), O_RDWR | O_CLOEXEC)) {
        if (!fd_) throw HardwareError(fmt::format("{}.device: {}: {}", table, device, std::strerror(errno)));
        pps_kparams params{};
        if (::ioctl(fd_.get(), PPS_GETPARAMS, &params) != 0)
            throw HardwareError(
                fmt::format("{}.device: {}: no PPS device ({})", table, device, std::strerror(errno)));
        params.mode |= PPS_CAPTUREASSERT;
        params.mode &= ~PPS_OFFSETASSERT;
        // Enable capture only if it is off: setting it needs more permissions than reading.
        if (::ioctl(fd_.get(), PPS_SETPARAMS, &params) != 0 && errno != EPERM)
            throw HardwareError(fmt::format("{}.device: {}: cannot capture assert edges ({})", table, device,
                                            std::strerror(errno)));
    }

    int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept override {
        pps_fdata data{};
        data.timeout.sec = timeout_ns / ns_per_s;
        data.timeout.nsec = static_cast<std::int32_t>(timeout_ns % ns_per_s);
        if (::ioctl(fd_.get(), PPS_FETCH, &data) != 0) return errno == ETIMEDOUT || errno == EINTR ? 0 : gone;
        timespec now{};
        clock_gettime(CLOCK_MONOTONIC, &now);
        // The fetch also returns for clear edges and on timeout.
        if (data.info.assert_sequence == last_ || edges.empty()) return 0;
        last_ = data.info.assert_sequence;
        const std::int64_t at_ns = data.info.assert_tu.sec * ns_per_s + data.info.assert_tu.nsec;
        edges[0] = {plausible_edge(at_ns, monotonic_minus(CLOCK_REALTIME), Time{to_ns(now)}), last_};
        return 1;
    }

private:
    FileDescriptor fd_;
    std::uint32_t last_ = 0;
};

} // namespace

std::unique_ptr<EdgeInput> open_pps(const std::string& table, const std::string& device) {
    return std::make_unique<PpsInput>(table, device);
}

} // namespace obscura::sync
