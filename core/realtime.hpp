// Names, priorities, cores and memory of threads that have deadlines.
#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <string_view>

namespace obscura {

/// Processor cores by their numbers; none: any core will do.
using CoreSet = std::bitset<1024>;

/// "2-3,5" as cores; nothing for the empty text. No value when it is not of that form.
[[nodiscard]] std::optional<CoreSet> parse_cores(std::string_view text);
/// The other way round; "any" when there are none.
[[nodiscard]] std::string cores_text(const CoreSet& cores);
/// Cores that this process may use.
[[nodiscard]] CoreSet permitted_cores() noexcept;

/// How a thread is scheduled.
struct ThreadSettings {
    int priority = 0; ///< SCHED_FIFO, 1..99; 0: ordinary scheduling
    CoreSet cores{};  ///< where it may run; none: anywhere
};

/// What the operating system granted of a wish for real time; `why` says what it refused, in one line.
struct RealtimeGrant {
    bool granted = false;
    std::string why;
};

/// Names the calling thread (15 characters at most are kept).
void name_this_thread(const char* name) noexcept;

/// Says that the calling thread has a deadline from here on, whatever the scheduler grants it: it must not
/// allocate, lock, log or throw. Tests hold it to that.
void declare_this_thread_realtime() noexcept;
[[nodiscard]] bool this_thread_is_realtime() noexcept;

/// Puts the calling thread under SCHED_FIFO at `priority` (1..99). Refusal is no error: benches and laptops
/// run the same program without the right to it.
RealtimeGrant make_this_thread_realtime(int priority) noexcept;

/// Keeps the calling thread, and threads it makes later, on `cores`; none of them: nothing changes.
RealtimeGrant pin_this_thread(const CoreSet& cores) noexcept;

/// What every worker does first: takes its name, its cores and its priority, as far as they are granted.
void enter_thread(const char* name, const ThreadSettings& settings) noexcept;

/// Whether this process may use SCHED_FIFO at `priority`; changes nothing.
[[nodiscard]] RealtimeGrant realtime_permitted(int priority) noexcept;

/// Locks the process's memory, present and future (mlockall). Call after the pools exist.
RealtimeGrant lock_memory() noexcept;

} // namespace obscura
