// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/progress.hpp"

#include "core/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <utility>

namespace obscura::tools {
namespace {

std::mutex progress_mutex;
Progress* innermost = nullptr; // with the mutex
bool line_shown = false;       // with the mutex; of a terminal

void erase_line() {
    if (std::exchange(line_shown, false)) {
        std::fputs("\r\033[K", stderr);
        std::fflush(stderr);
    }
}

} // namespace

std::string span_text(double seconds) {
    if (seconds < 100) return fmt::format("{:.0f} s", seconds);
    if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
    return fmt::format("{:.1f} h", seconds / 3600);
}

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)), total_(std::max<std::uint64_t>(total, 1)) {
    const std::lock_guard lock(progress_mutex);
    outer_ = std::exchange(innermost, this);
}

Progress::~Progress() {
    const std::lock_guard lock(progress_mutex);
    innermost = outer_;
    erase_line();
}

std::string Progress::text() const {
    const double part = std::min(1.0, static_cast<double>(done_.load(std::memory_order_relaxed)) /
                                          static_cast<double>(total_));
    const double passed = std::chrono::duration<double>(Clock::now() - start_).count();
    std::string left;
    // The first moments give no usable estimate of the remaining time.
    if (part > 0.01 && passed > 0.5) left = fmt::format("  {} left", span_text(passed / part - passed));
    return fmt::format("{} {:3.0f} %{}", printable(what_, 40), 100 * part, left);
}

void show_progress(std::string_view verb, double elapsed_s, bool terminal) {
    const std::lock_guard lock(progress_mutex);
    const std::string text = innermost != nullptr
                                 ? innermost->text()
                                 : fmt::format("{}: at work for {}", verb, span_text(elapsed_s));
    // The cursor stays at the beginning: what else is printed takes the place of the line.
    std::fputs((terminal ? fmt::format("\r{}\033[K\r", text) : fmt::format("obscura: {}\n", text)).c_str(),
               stderr);
    std::fflush(stderr);
    line_shown = terminal;
}

void erase_progress() {
    const std::lock_guard lock(progress_mutex);
    erase_line();
}

} // namespace obscura::tools
