// SPDX-License-Identifier: Apache-2.0
#include "emulator/daemon/start_progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

/// Neither less of a step nor a shorter time says how long the rest takes.
constexpr double min_share = 0.01, min_elapsed_s = 1;

std::string span_text(double seconds) {
    const auto whole = [](double v) { return static_cast<long>(std::ceil(v)); };
    if (seconds < 90) return fmt::format("{} s", whole(seconds));
    return seconds < 5400 ? fmt::format("{} min", whole(seconds / 60))
                          : fmt::format("{} h", whole(seconds / 3600));
}

} // namespace

void StartProgress::note(const std::string& step, std::optional<double> share, Time now) {
    const std::lock_guard lock(mutex_);
    if (step != report_.step) {
        begun_ = now;
        first_share_ = -1;
    }
    report_ = {step, share, {}};
    if (!share) return;
    report_.share = std::clamp(*share, 0.0, 1.0);
    if (first_share_ < 0) {
        first_share_ = *report_.share;
        begun_ = now;
    }
    const double done = *report_.share - first_share_, elapsed_s = to_seconds(now - begun_);
    if (done >= min_share && elapsed_s >= min_elapsed_s)
        report_.left_s = elapsed_s * (1 - *report_.share) / done;
}

StartProgress::Report StartProgress::report() const {
    const std::lock_guard lock(mutex_);
    return report_;
}

std::string StartProgress::Report::words() const {
    std::string text = step;
    if (share) text += fmt::format(" {:.0f} %", std::floor(100 * *share));
    if (left_s) text += fmt::format(", {} left", span_text(*left_s));
    return text;
}

} // namespace obscura::emulator
