// SPDX-License-Identifier: Apache-2.0
// Dropping of Linux capabilities in all threads of the process after start-up.
#pragma once

#include <cstdint>
#include <string>

namespace obscura {

/// Result of drop_capabilities().
struct CapabilityReport {
    bool had_any = false;   ///< the process had capabilities
    std::uint64_t kept = 0; ///< bits as in linux/capability.h
    int threads = 0;        ///< threads that dropped theirs
    std::string why;        ///< the failure, in one line; empty: none
};

/// Replaces the capabilities that real time needs by resource limits: raises RLIMIT_RTPRIO and
/// RLIMIT_MEMLOCK so far that later threads may use SCHED_FIFO up to `priority` and locked memory may grow
/// without them (0: neither), and RLIMIT_NICE for a nice level of `nice`, if that is negative. Returns the
/// bits of those capabilities (CAP_SYS_NICE, CAP_IPC_LOCK) whose limit could not be raised.
[[nodiscard]] std::uint64_t replace_by_limits(int priority, int nice = 0) noexcept;

/// Drops every capability but those of `keep` from all threads of this process, empties the ambient and
/// inheritable sets, the bounding set where permitted, and forbids new privileges. Does nothing if the
/// process has no capabilities. Linux keeps capabilities per thread: the calling thread asks the others by a
/// real-time signal (libpsx of Debian 12 knows only threads that the program itself has started, libcap-ng
/// only the calling one). Not reentrant; no other thread may start threads meanwhile.
CapabilityReport drop_capabilities(std::uint64_t keep);

} // namespace obscura
