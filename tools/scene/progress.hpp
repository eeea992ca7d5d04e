// SPDX-License-Identifier: Apache-2.0
// Progress line with the remaining time, shown on a terminal only.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace obscura::tools {

/// "12 s", "3 min" or "1.5 h".
[[nodiscard]] std::string span_text(double seconds);

/// Writes "what  43 %  12 s left" to standard error if that is a terminal, at most ten times a second, and
/// erases it at the end. Thread-bound.
class Progress {
public:
    Progress(std::string what, std::uint64_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `units` of the total are done, counted from the beginning.
    void done(std::uint64_t units);

private:
    using Clock = std::chrono::steady_clock;
    std::string what_;
    std::uint64_t total_;
    bool terminal_;
    bool shown_ = false;
    Clock::time_point start_ = Clock::now(), last_{};
};

} // namespace obscura::tools
