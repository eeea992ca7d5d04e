// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/render_rest.hpp"

#include "core/clock.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace obscura::emulator {

std::int64_t RenderRest::owed(Time now, bool first) noexcept {
    const std::int64_t passed_ns = now - last_;
    if (first)
        slept(now);
    else
        balance_ns_ = std::min(balance_ns_ + (1 - share_) * static_cast<double>(passed_ns), max_debt_ns);
    last_ = now;
    const std::int64_t owed = std::llround(balance_ns_ / share_);
    return owed < min_rest_ns ? 0 : std::min(owed, max_rest_ns);
}

void RenderRest::slept(Time now) noexcept {
    balance_ns_ =
        std::max(balance_ns_ - share_ * static_cast<double>(now - last_), -(1 - share_) * credit_for_ns);
    last_ = now;
}

void rest_before_row(double share, bool first) noexcept {
    thread_local RenderRest rest(share);
    const MonotonicClock clock;
    const std::int64_t owed = rest.owed(clock.now(), first);
    if (owed == 0) return;
    const timespec time{0, static_cast<long>(owed)};
    ::nanosleep(&time, nullptr);
    rest.slept(clock.now());
}

} // namespace obscura::emulator
