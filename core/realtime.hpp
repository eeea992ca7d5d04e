// Names, priorities and memory of threads that have deadlines.
#pragma once

#include <string>

namespace obscura {

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

/// Whether this process may use SCHED_FIFO at `priority`; changes nothing.
[[nodiscard]] RealtimeGrant realtime_permitted(int priority) noexcept;

/// Locks the process's memory, present and future (mlockall). Call after the pools exist.
RealtimeGrant lock_memory() noexcept;

} // namespace obscura
