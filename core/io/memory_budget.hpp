// SPDX-License-Identifier: Apache-2.0
// Memory budget of the process: how much more it may allocate before the kernel refuses or kills it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace obscura {

/// Memory that the process may still take, and the limit that leaves the least.
struct MemoryLeft {
    std::uint64_t bytes = 0;
    std::string limit; ///< "the limit of the control group", for messages
};

/// The least that is left of: RLIMIT_DATA (see limit_memory()), RLIMIT_AS, memory.max of the process's
/// control group (version 2) and of those above it, and what the machine can give without swapping other
/// programs out (MemAvailable and free swap). Reads /proc and /sys, some 0.1 ms. Thread-safe.
[[nodiscard]] MemoryLeft memory_left();

/// "12.5 MiB of the memory limit of the process (64.0 MiB)".
[[nodiscard]] std::string describe(const MemoryLeft& left);

/// Throws InputError `what: needs ... MiB, ... are left of ...` unless `bytes` are left and a reserve for the
/// threads that run meanwhile. To be called with a size computed from a file's header, before anything of
/// that size is allocated. Thread-safe.
void require_memory(std::uint64_t bytes, std::string_view what);

/// Lets allocations beyond `bytes` of private memory fail with std::bad_alloc (RLIMIT_DATA), so that what
/// asks for too much fails, and not the process. Counts reserved stacks, too. Throws ConfigError if the
/// process uses more already, Error if the limit cannot be set.
void limit_memory(std::uint64_t bytes);

} // namespace obscura
