// SPDX-License-Identifier: Apache-2.0
// Real-time threads: name, SCHED_FIFO priority, CPU affinity, memory locking.
#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <string_view>

namespace obscura {

/// Set of CPU cores by number; the empty set: any core.
using CoreSet = std::bitset<1024>;

/// Parses a list such as "2-3,5"; the empty text gives the empty set. No value for any other syntax.
[[nodiscard]] std::optional<CoreSet> parse_cores(std::string_view text);
/// Formats a set as parse_cores() reads it; "any" for the empty set.
[[nodiscard]] std::string cores_text(const CoreSet& cores);
/// Cores that this process may run on.
[[nodiscard]] CoreSet permitted_cores() noexcept;

/// Scheduling of a thread.
struct ThreadSettings {
    int priority = 0; ///< SCHED_FIFO, 1..99; 0: SCHED_OTHER
    CoreSet cores{};  ///< CPU affinity; empty: any core
};

/// Answer of the operating system to a request for real time; `why` states a refusal in one line.
struct RealtimeGrant {
    bool granted = false;
    std::string why;
};

/// Names the calling thread (15 characters at most are kept).
void name_this_thread(const char* name) noexcept;

/// Declares the calling thread real-time from now on, whether or not the scheduler grants SCHED_FIFO: it must
/// not allocate, lock, log or throw. Tests check that. Prefaults its stack.
void declare_this_thread_realtime() noexcept;
[[nodiscard]] bool this_thread_is_realtime() noexcept;

/// Puts the calling thread under SCHED_FIFO at `priority` (1..99). A refusal is no error: on test benches and
/// laptops the same program runs without that permission.
RealtimeGrant make_this_thread_realtime(int priority) noexcept;

/// Pins the calling thread, and threads that it creates later, to `cores`; the empty set changes nothing.
RealtimeGrant pin_this_thread(const CoreSet& cores) noexcept;

/// First call of every worker thread: sets its name, and its affinity and priority as far as granted.
void enter_thread(const char* name, const ThreadSettings& settings) noexcept;

/// Whether this process may use SCHED_FIFO at `priority`; changes nothing.
[[nodiscard]] RealtimeGrant realtime_permitted(int priority) noexcept;

/// What prefault_stack() touches, bytes: several times the deepest stack of rendering.
inline constexpr std::size_t prefaulted_stack_bytes = std::size_t{256} * 1024;

/// Touches the calling thread's stack below the caller, so that a path taken for the first time late (a tile
/// that is missing) meets no page fault there. Needed where memory may not be locked.
void prefault_stack() noexcept;

/// Locks the process's memory, present and future (mlockall). Call after the pools exist.
RealtimeGrant lock_memory() noexcept;

} // namespace obscura
