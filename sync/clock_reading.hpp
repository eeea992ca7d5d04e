// SPDX-License-Identifier: Apache-2.0
// Conversion of other clocks' time stamps to the scheduling clock.
#pragma once

#include "core/time.hpp"

#include <ctime>

namespace obscura::sync {

/// Current difference CLOCK_MONOTONIC minus the clock `id`, from the fastest of several readings. `id` may be
/// that of a PTP device.
[[nodiscard]] std::int64_t monotonic_minus(clockid_t id) noexcept;

/// clockid of an open character device (/dev/ptpN): FD_TO_CLOCKID of the kernel's documentation.
[[nodiscard]] constexpr clockid_t clock_of_device(int fd) noexcept {
    return static_cast<clockid_t>((~static_cast<unsigned>(fd) << 3) | 3u);
}

/// Converts an edge's time stamp `at_ns` of another clock to the scheduling clock, given the difference of
/// the two. A result more than 1 ms after `seen` or more than 1 s before it is implausible (the other clock
/// was stepped in between) and is replaced by `seen`.
[[nodiscard]] constexpr Time plausible_edge(std::int64_t at_ns, std::int64_t monotonic_minus_ns,
                                            Time seen) noexcept {
    const Time edge{at_ns + monotonic_minus_ns};
    const bool plausible = edge - seen <= ns_per_ms && seen - edge <= ns_per_s;
    return plausible ? edge : seen;
}

constexpr std::int64_t to_ns(const timespec& t) noexcept {
    return std::int64_t{t.tv_sec} * ns_per_s + t.tv_nsec;
}

} // namespace obscura::sync
