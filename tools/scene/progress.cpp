// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/progress.hpp"

#include "core/text/printable.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace obscura::tools {

std::string span_text(double seconds) {
    if (seconds < 100) return fmt::format("{:.0f} s", seconds);
    if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
    return fmt::format("{:.1f} h", seconds / 3600);
}

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)),
      total_(std::max<std::uint64_t>(total, 1)),
      terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
    if (shown_) fmt::print(stderr, "\r\033[K");
}

void Progress::done(std::uint64_t units) {
    if (!terminal_) return;
    const auto now = Clock::now();
    if (now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    shown_ = true;
    const double part = std::min(1.0, static_cast<double>(units) / static_cast<double>(total_));
    const double passed = std::chrono::duration<double>(now - start_).count();
    std::string left;
    // The first moments give no usable estimate of the remaining time.
    if (part > 0.01 && passed > 0.5) left = fmt::format("  {} left", span_text(passed / part - passed));
    fmt::print(stderr, "\r{} {:3.0f} %{}\033[K", printable(what_, 40), 100 * part, left);
    std::fflush(stderr);
}

} // namespace obscura::tools
