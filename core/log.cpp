#include "core/log.hpp"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace obscura {
namespace {

std::atomic<LogLevel> current_level{LogLevel::info};

constexpr std::string_view name_of(LogLevel level) {
    switch (level) {
    case LogLevel::error:
        return "error: ";
    case LogLevel::warning:
        return "warning: ";
    case LogLevel::debug:
        return "debug: ";
    case LogLevel::notice:
    case LogLevel::info:
        break;
    }
    return "";
}

} // namespace

void set_log_level(LogLevel level) noexcept {
    current_level.store(level, std::memory_order_relaxed);
}
LogLevel log_level() noexcept {
    return current_level.load(std::memory_order_relaxed);
}

void log_line(LogLevel level, std::string_view text) {
    if (level > log_level()) return;
    // systemd sets JOURNAL_STREAM when standard error is the journal, which understands "<N>" prefixes.
    static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
    const std::string line = journal ? fmt::format("<{}>{}\n", static_cast<int>(level), text)
                                     : fmt::format("{}{}\n", name_of(level), text);
    // One write per line, so that lines of several threads never mix.
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
}

LogRing::LogRing() noexcept {
    for (std::size_t i = 0; i < capacity; ++i)
        cells_[i].turn.store(i, std::memory_order_relaxed);
}

bool LogRing::push(const LogRecord& record) noexcept {
    std::size_t at = head_.load(std::memory_order_relaxed);
    for (;;) {
        Cell& cell = cells_[at % capacity];
        const std::size_t turn = cell.turn.load(std::memory_order_acquire);
        if (turn == at) {
            if (head_.compare_exchange_weak(at, at + 1, std::memory_order_relaxed)) {
                cell.record = record;
                cell.turn.store(at + 1, std::memory_order_release);
                return true;
            }
        } else if (turn < at) {
            lost_.fetch_add(1, std::memory_order_relaxed);
            return false;
        } else {
            at = head_.load(std::memory_order_relaxed);
        }
    }
}

std::size_t LogRing::drain() {
    std::size_t count = 0;
    for (;; ++count) {
        Cell& cell = cells_[tail_ % capacity];
        if (cell.turn.load(std::memory_order_acquire) != tail_ + 1) break;
        const LogRecord record = cell.record;
        cell.turn.store(tail_ + capacity, std::memory_order_release);
        ++tail_;
        log_line(record.level, fmt::format(fmt::runtime(record.text), record.arguments[0],
                                           record.arguments[1], record.arguments[2]));
    }
    const std::uint64_t lost = lost_.load(std::memory_order_relaxed);
    if (lost != lost_reported_) {
        log_line(LogLevel::warning,
                 fmt::format("{} log records were lost: the ring was full", lost - lost_reported_));
        lost_reported_ = lost;
    }
    return count;
}

} // namespace obscura
