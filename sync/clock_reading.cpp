// SPDX-License-Identifier: Apache-2.0
#include "sync/clock_reading.hpp"

namespace obscura::sync {

std::int64_t monotonic_minus(clockid_t id) noexcept {
    std::int64_t best_gap = INT64_MAX, difference = 0;
    for (int attempt = 0; attempt < 4; ++attempt) {
        timespec before{}, other{}, after{};
        clock_gettime(CLOCK_MONOTONIC, &before);
        clock_gettime(id, &other);
        clock_gettime(CLOCK_MONOTONIC, &after);
        const std::int64_t gap = to_ns(after) - to_ns(before);
        if (gap >= best_gap) continue;
        best_gap = gap;
        difference = to_ns(before) + gap / 2 - to_ns(other);
    }
    return difference;
}

} // namespace obscura::sync
