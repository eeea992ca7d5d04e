// SPDX-License-Identifier: Apache-2.0
// Progress of the running verb with the remaining time, on standard error.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::tools {

/// "12 s", "3 min" or "1.5 h".
[[nodiscard]] std::string span_text(double seconds);

/// Progress of one piece of work, which the watch of the verb (tools/verbs/verb_watch.hpp) shows as
/// "what  43 %  12 s left" while it lives. Those made later, which must end earlier, go first. Created and
/// destroyed by one thread.
class Progress {
public:
    Progress(std::string what, std::uint64_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `units` of the total are done, counted from the beginning. Thread-safe, real-time safe.
    void done(std::uint64_t units) noexcept { done_.store(units, std::memory_order_relaxed); }

private:
    friend void show_progress(std::string_view verb, double elapsed_s, bool terminal);
    using Clock = std::chrono::steady_clock;
    [[nodiscard]] std::string text() const;

    std::string what_;
    std::uint64_t total_;
    std::atomic<std::uint64_t> done_{0};
    Clock::time_point start_ = Clock::now();
    Progress* outer_; ///< shown again when this one ends
};

/// Writes the progress of the innermost piece of work, or else how long `verb` is at work: on a terminal in
/// place of the line before, else as a line of its own. Thread-safe.
void show_progress(std::string_view verb, double elapsed_s, bool terminal);
/// Erases the line of a terminal, before something else is printed. Thread-safe.
void erase_progress();

} // namespace obscura::tools
