// Gives up the capabilities of this process, in all of its threads, once they have done their work.
#pragma once

#include <cstdint>
#include <string>

namespace obscura {

/// What drop_capabilities() has done.
struct CapabilityReport {
    bool had_any = false;   ///< there was something to give up
    std::uint64_t kept = 0; ///< bits as in linux/capability.h
    int threads = 0;        ///< that have let go
    std::string why;        ///< what went wrong, in one line; empty: nothing
};

/// Takes the place of the capabilities that real time needs: raises the limits so far that later threads may
/// use SCHED_FIFO up to `priority` and locked memory may grow without them. Returns the bits of those
/// (CAP_SYS_NICE, CAP_IPC_LOCK) that it has no replacement for; 0 for `priority` 0.
[[nodiscard]] std::uint64_t replace_by_limits(int priority) noexcept;

/// Drops every capability but those of `keep` from all threads of this process, empties the ambient and
/// inheritable sets, the bounding set where permitted, and forbids new privileges. Does nothing where there
/// is nothing to drop. Linux keeps capabilities for each thread: the calling thread asks the others by a
/// real-time signal (libpsx of Debian 12 knows only threads that the program itself has started, libcap-ng
/// only the calling one). One caller, and no other thread may be starting threads meanwhile.
CapabilityReport drop_capabilities(std::uint64_t keep);

} // namespace obscura
