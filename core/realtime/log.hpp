// SPDX-License-Identifier: Apache-2.0
// Logging: text lines from ordinary threads, fixed-size records from real-time threads.
#pragma once

#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace obscura {

/// syslog(3) priorities.
enum class LogLevel : int { error = 3, warning = 4, notice = 5, info = 6, debug = 7 };
constexpr auto enum_names(LogLevel /*type*/) {
    return std::array{EnumName{LogLevel::error, "error"}, EnumName{LogLevel::warning, "warning"},
                      EnumName{LogLevel::notice, "notice"}, EnumName{LogLevel::info, "info"},
                      EnumName{LogLevel::debug, "debug"}};
}

/// Lines less severe than this level are not written. Default: info.
void set_log_level(LogLevel level) noexcept;
[[nodiscard]] LogLevel log_level() noexcept;

/// Writes one line to standard error, "level: text", or an entry with fields to the journal when standard
/// error is the journal ("<N>text" if its socket cannot be reached). Control characters become blanks.
/// `message` says which message it is: the text before its fields "{}" were replaced, or the name that the
/// table of messages (docs/appliance.md) has for texts made elsewhere. Thread-safe, not real-time safe.
void log_line(LogLevel level, std::string_view text, std::string_view message);

/// An entry in the native format (https://systemd.io/JOURNAL_NATIVE_PROTOCOL): MESSAGE, PRIORITY, MESSAGE_ID,
/// SYSLOG_IDENTIFIER (the program), OBSCURA_PART (first word of `text`), OBSCURA_CAMERA and OBSCURA_FRAME (if
/// `message` has these fields).
[[nodiscard]] std::string journal_entry(LogLevel level, std::string_view text, std::string_view message);
/// MESSAGE_ID of a message: 32 hexadecimal digits, FNV-1a of 128 bits of the message with "\u2026" for each
/// field, which is how the table of messages and the catalogue made from it (systemd/obscura.catalog) have
/// it.
[[nodiscard]] std::string message_id(std::string_view message);

/// Rate limit: admits a number of lines per time window and counts the others.
class LogLimit {
public:
    static constexpr std::uint32_t lines = 1000;
    static constexpr std::int64_t window_ns = 10 * ns_per_s;
    /// Whether a line may be written at `now`. `suppressed`: number of lines suppressed in the window before,
    /// given once with the first line of a window, else 0.
    [[nodiscard]] bool admit(Time now, std::uint64_t& suppressed) noexcept;

private:
    Time window_;
    std::uint32_t written_ = 0;
    std::uint64_t suppressed_ = 0;
};

template<typename... Args>
void log_formatted(LogLevel level, fmt::format_string<Args...> f, Args&&... args) {
    const fmt::string_view message = f;
    log_line(level, fmt::format(f, std::forward<Args>(args)...), {message.data(), message.size()});
}
template<typename... Args>
void log_error(fmt::format_string<Args...> f, Args&&... args) {
    log_formatted(LogLevel::error, f, std::forward<Args>(args)...);
}
template<typename... Args>
void log_warning(fmt::format_string<Args...> f, Args&&... args) {
    log_formatted(LogLevel::warning, f, std::forward<Args>(args)...);
}
template<typename... Args>
void log_notice(fmt::format_string<Args...> f, Args&&... args) {
    log_formatted(LogLevel::notice, f, std::forward<Args>(args)...);
}
template<typename... Args>
void log_info(fmt::format_string<Args...> f, Args&&... args) {
    if (log_level() >= LogLevel::info) log_formatted(LogLevel::info, f, std::forward<Args>(args)...);
}
template<typename... Args>
void log_debug(fmt::format_string<Args...> f, Args&&... args) {
    if (log_level() >= LogLevel::debug) log_formatted(LogLevel::debug, f, std::forward<Args>(args)...);
}

/// Log record of a real-time thread: a message with static storage and up to three numbers.
struct LogRecord {
    Time time;
    LogLevel level = LogLevel::info;
    const char* text = ""; ///< string literal; "{}" stands for each argument in turn
    std::array<std::int64_t, 3> arguments{};
};

/// Bounded multi-producer, single-consumer ring of records. push() is thread-safe and real-time safe; when
/// the ring is full the record is counted as lost. An ordinary thread calls drain() periodically. Vyukov's
/// bounded queue: every cell holds the turn on which it may be written or read.
class LogRing {
public:
    LogRing() noexcept;
    bool push(const LogRecord& record) noexcept;
    /// Writes the queued records through log_line(); returns their number. One thread at a time.
    std::size_t drain();
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

private:
    static constexpr std::size_t capacity = 1024;
    struct Cell {
        std::atomic<std::size_t> turn{0};
        LogRecord record;
    };
    std::array<Cell, capacity> cells_;
    std::atomic<std::size_t> head_{0};
    std::size_t tail_ = 0;
    std::atomic<std::uint64_t> lost_{0};
    std::uint64_t lost_reported_ = 0;
};

} // namespace obscura
