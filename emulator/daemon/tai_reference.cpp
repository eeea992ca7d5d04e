// SPDX-License-Identifier: Apache-2.0
#include "emulator/daemon/tai_reference.hpp"

#include "core/realtime/log.hpp"
#include "core/time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <utility>

namespace obscura::emulator {
namespace {

constexpr std::int64_t seconds_per_day = 86'400;

std::int64_t utc_day_number(std::int64_t utc_s) {
    return utc_s / seconds_per_day - (utc_s % seconds_per_day < 0 ? 1 : 0);
}

} // namespace

TaiCorrection tai_correction(int kernel_tai_s, std::int64_t ptp_ns, const ephemeris::LeapSeconds& list,
                             std::int64_t utc_s) {
    if (kernel_tai_s != 0) return {0, TaiSource::kernel};
    if (ptp_ns != 0) return {ptp_ns, TaiSource::ptp};
    const auto next =
        std::upper_bound(list.steps.begin(), list.steps.end(), utc_day_number(utc_s),
                         [](std::int64_t day, const ephemeris::LeapSecond& step) { return day < step.day; });
    if (next == list.steps.begin()) return {};
    return {std::prev(next)->tai_minus_utc_s * ns_per_s, TaiSource::list};
}

std::string tai_text(const TaiCorrection& correction, const ephemeris::LeapSeconds& list) {
    switch (correction.source) {
    case TaiSource::kernel:
        return "by the kernel";
    case TaiSource::ptp:
        return "by PTP";
    case TaiSource::list:
        return fmt::format("UTC plus {} s by {}, as the kernel has no TAI offset", correction.ns / ns_per_s,
                           list.source);
    case TaiSource::unknown:
        break;
    }
    return "not known: the kernel has no TAI offset, and the machine's clock is before the first leap second";
}

int kernel_tai_minus_utc_s() noexcept {
    timespec utc{}, tai{};
    clock_gettime(CLOCK_REALTIME, &utc);
    clock_gettime(CLOCK_TAI, &tai);
    return static_cast<int>(std::lround(static_cast<double>(tai.tv_sec - utc.tv_sec) +
                                        static_cast<double>(tai.tv_nsec - utc.tv_nsec) * 1e-9));
}

TaiCorrection TaiReference::refresh(std::int64_t ptp_ns) {
    const std::int64_t utc_s = std::time(nullptr);
    if (std::exchange(list_day_, utc_day_number(utc_s)) != utc_day_number(utc_s))
        list_ = ephemeris::system_leap_seconds();
    const TaiCorrection correction = tai_correction(kernel_tai_minus_utc_s(), ptp_ns, list_, utc_s);
    if (std::exchange(logged_, true) && correction.source == source_) return correction;
    source_ = correction.source;
    const std::string text = tai_text(correction, list_);
    if (source_ == TaiSource::unknown)
        log_warning("tai: {}", text);
    else if (source_ == TaiSource::list)
        log_notice("tai: {}", text);
    else
        log_info("tai: {}", text);
    return correction;
}

} // namespace obscura::emulator
