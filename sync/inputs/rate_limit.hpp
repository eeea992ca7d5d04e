// SPDX-License-Identifier: Apache-2.0
// Limit of how often something may happen, with room for short bursts.
#pragma once

#include "core/time.hpp"

#include <algorithm>

namespace obscura::sync {

/// Token bucket: `burst` at once, and `rate_hz` in the long run. Real-time safe, thread-bound.
class RateLimit {
public:
    static constexpr double burst = 8;

    explicit RateLimit(double rate_hz) noexcept : rate_hz_(rate_hz) {}

    /// Whether one more is allowed at `now`, which is not before the last one.
    [[nodiscard]] bool allows(Time now) noexcept {
        const double since_s = static_cast<double>(now - last_) / static_cast<double>(ns_per_s);
        left_ = std::min(burst, left_ + rate_hz_ * since_s);
        last_ = now;
        if (left_ < 1) return false;
        left_ -= 1;
        return true;
    }

private:
    double rate_hz_, left_ = burst;
    Time last_{};
};

} // namespace obscura::sync
