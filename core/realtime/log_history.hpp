// SPDX-License-Identifier: Apache-2.0
// History of the log: the latest lines that this process has written, numbered.
#pragma once

#include "core/realtime/log.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace obscura {

/// One line of the log.
struct LoggedLine {
    std::uint64_t id = 0;    ///< counts from 1 in this process
    std::int64_t utc_ns = 0; ///< when it was written, CLOCK_REALTIME
    LogLevel level = LogLevel::info;
    std::string text;    ///< at most LogHistory::text_bytes of it
    std::string message; ///< message_id() of its message
};

/// The latest lines, in memory that does not grow: a service runs for months. Thread-safe, not real-time
/// safe.
class LogHistory {
public:
    /// Lines that are kept, and bytes of each.
    static constexpr std::size_t lines = 1024, text_bytes = 512;

    /// `message`: a message_id().
    void add(LogLevel level, std::string_view text, std::int64_t utc_ns, std::string_view message = {});
    /// The oldest lines kept with an id above `after`, at most `most` of them.
    [[nodiscard]] std::vector<LoggedLine> after(std::uint64_t after, std::size_t most) const;
    /// Number of lines of a level since the start.
    [[nodiscard]] std::uint64_t count(LogLevel level) const;

private:
    struct Entry {
        std::int64_t utc_ns;
        LogLevel level;
        std::size_t bytes;
        std::array<char, text_bytes> text;
        std::array<char, 32> message;
        std::size_t message_bytes;
    };
    mutable std::mutex mutex_;
    std::array<Entry, lines> entries_{}; ///< line n at n % lines
    std::uint64_t last_id_ = 0;
    std::array<std::uint64_t, 8> counts_{}; ///< by priority
};

/// The history of log_line().
[[nodiscard]] const LogHistory& log_history() noexcept;

} // namespace obscura
