// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/log.hpp"

#include "core/clock.hpp"
#include "core/realtime/log_history.hpp"
#include "core/text/printable.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno> // program_invocation_short_name
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <mutex>
#include <utility>

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

/// The journal's native socket, used when standard error is the journal: systemd sets JOURNAL_STREAM to the
/// device and inode of that stream.
class Journal {
public:
    Journal() {
        const char* stream = std::getenv("JOURNAL_STREAM");
        struct stat error {};
        if (stream == nullptr || fstat(STDERR_FILENO, &error) != 0 ||
            fmt::format("{}:{}", error.st_dev, error.st_ino) != stream)
            return;
        is_stderr_ = true;
        fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    }
    /// Standard error is the journal.
    [[nodiscard]] bool is_stderr() const noexcept { return is_stderr_; }
    [[nodiscard]] bool send(const std::string& entry) const noexcept {
        sockaddr_un to{};
        to.sun_family = AF_UNIX;
        std::memcpy(to.sun_path, path, sizeof path);
        return fd_ >= 0 && sendto(fd_, entry.data(), entry.size(), MSG_NOSIGNAL,
                                  reinterpret_cast<const sockaddr*>(&to), sizeof to) >= 0;
    }

private:
    static constexpr char path[] = "/run/systemd/journal/socket";
    bool is_stderr_ = false;
    int fd_ = -1; // open until the process ends
};

/// Lines "OBSCURA_CAMERA=0\n" for the fields of `message` that follow the words camera and frame, as `text`
/// has them.
std::string number_fields(std::string_view text, std::string_view message) {
    std::string fields;
    std::size_t at = 0;
    while (at <= text.size()) {
        const std::size_t field = message.find('{'), end = message.find('}', field);
        if (end == std::string_view::npos) break;
        const std::string_view before = message.substr(0, field);
        const std::size_t found = text.find(before, at);
        if (found == std::string_view::npos) break;
        at = found + before.size();
        const std::string_view rest = text.substr(at);
        const std::string_view digits = rest.substr(0, rest.find_first_not_of("0123456789"));
        for (const auto& [word, name] : {std::pair{"camera ", "CAMERA"}, std::pair{"frame ", "FRAME"}})
            if (before.ends_with(word) && !digits.empty())
                fields += fmt::format("OBSCURA_{}={}\n", name, digits);
        message.remove_prefix(end + 1);
    }
    return fields;
}

LogHistory& history() noexcept {
    static LogHistory all;
    return all;
}

std::int64_t utc_ns() {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    return now.tv_sec * ns_per_s + now.tv_nsec;
}

void write_line(LogLevel level, const std::string& text, std::string_view message) {
    static const Journal journal;
    history().add(level, text, utc_ns(), message_id(message));
    if (journal.is_stderr() && journal.send(journal_entry(level, text, message))) return;
    const std::string line = journal.is_stderr() ? fmt::format("<{}>{}\n", static_cast<int>(level), text)
                                                 : fmt::format("{}{}\n", name_of(level), text);
    // One write per line, so that lines of several threads never mix.
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
}

} // namespace

std::string journal_entry(LogLevel level, std::string_view text, std::string_view message) {
    const std::string line = printable(text, max_message_bytes);
    return fmt::format("MESSAGE={}\nPRIORITY={}\nSYSLOG_IDENTIFIER={}\nOBSCURA_PART={}\nMESSAGE_ID={}\n{}",
                       line, static_cast<int>(level), program_invocation_short_name,
                       line.substr(0, line.find_first_of(": ")), message_id(message),
                       number_fields(line, message));
}

std::string message_id(std::string_view message) {
    __extension__ using Bits = unsigned __int128;
    constexpr auto bits = [](std::uint64_t high, std::uint64_t low) { return Bits{high} << 64 | low; };
    constexpr Bits prime = bits(0x0000000001000000, 0x000000000000013b);
    Bits hash = bits(0x6c62272e07bb0142, 0x62b821756295c58d);
    const auto add = [&](std::string_view bytes) {
        for (const char c : bytes)
            hash = (hash ^ static_cast<unsigned char>(c)) * prime;
    };
    while (!message.empty()) {
        const std::size_t field = message.find('{'), end = message.find('}', field);
        add(message.substr(0, field));
        if (end == std::string_view::npos) break;
        add("\u2026");
        message.remove_prefix(end + 1);
    }
    return fmt::format("{:016x}{:016x}", static_cast<std::uint64_t>(hash >> 64),
                       static_cast<std::uint64_t>(hash));
}

bool LogLimit::admit(Time now, std::uint64_t& suppressed) noexcept {
    suppressed = 0;
    if (now - window_ >= window_ns || window_ == Time{}) {
        window_ = now;
        written_ = 0;
        suppressed = std::exchange(suppressed_, 0);
    }
    if (written_ < lines) {
        ++written_;
        return true;
    }
    ++suppressed_;
    return false;
}

void set_log_level(LogLevel level) noexcept {
    current_level.store(level, std::memory_order_relaxed);
}
LogLevel log_level() noexcept {
    return current_level.load(std::memory_order_relaxed);
}

void log_line(LogLevel level, std::string_view text, std::string_view message) {
    if (level > log_level()) return;
    static std::mutex mutex;
    static LogLimit limit;
    std::uint64_t suppressed = 0;
    {
        const std::lock_guard lock(mutex);
        if (!limit.admit(MonotonicClock().now(), suppressed)) return;
    }
    if (suppressed > 0) {
        static constexpr std::string_view left_out = "log: {} lines were too many for {} s and are left out";
        write_line(LogLevel::warning, fmt::format(left_out, suppressed, LogLimit::window_ns / ns_per_s),
                   left_out);
    }
    write_line(level, printable(text, max_message_bytes), message);
}

void LogHistory::add(LogLevel level, std::string_view text, std::int64_t utc_ns, std::string_view message) {
    const std::lock_guard lock(mutex_);
    ++counts_[static_cast<std::size_t>(level)];
    Entry& entry = entries_[++last_id_ % lines];
    entry.utc_ns = utc_ns;
    entry.level = level;
    entry.bytes = text.copy(entry.text.data(), entry.text.size());
    entry.message_bytes = message.copy(entry.message.data(), entry.message.size());
}

std::uint64_t LogHistory::count(LogLevel level) const {
    const std::lock_guard lock(mutex_);
    return counts_[static_cast<std::size_t>(level)];
}

std::vector<LoggedLine> LogHistory::after(std::uint64_t after, std::size_t most) const {
    const std::lock_guard lock(mutex_);
    const std::uint64_t gone = last_id_ > lines ? last_id_ - lines : std::uint64_t{0};
    std::vector<LoggedLine> found;
    for (std::uint64_t id = std::max(after, gone); id < last_id_ && found.size() < most;) {
        const Entry& entry = entries_[++id % lines];
        found.push_back({id,
                         entry.utc_ns,
                         entry.level,
                         {entry.text.data(), entry.bytes},
                         {entry.message.data(), entry.message_bytes}});
    }
    return found;
}

const LogHistory& log_history() noexcept {
    return history();
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
        log_line(record.level,
                 fmt::format(fmt::runtime(record.text), record.arguments[0], record.arguments[1],
                             record.arguments[2]),
                 record.text);
    }
    const std::uint64_t lost = lost_.load(std::memory_order_relaxed);
    if (lost != lost_reported_) {
        log_warning("log: {} records were lost, the ring was full", lost - lost_reported_);
        lost_reported_ = lost;
    }
    return count;
}

} // namespace obscura
