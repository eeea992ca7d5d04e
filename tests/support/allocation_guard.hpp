// SPDX-License-Identifier: Apache-2.0
// Counts what real-time threads must not do: take memory from the heap.
#pragma once

#include <cstdint>

namespace obscura::test {

/// Allocations so far in threads that declared themselves real-time (core/realtime/realtime.hpp), and in all
/// threads, since the last reset. Every malloc family call and operator new of the program counts, of
/// whatever library.
struct AllocationCounts {
    std::uint64_t realtime = 0, all = 0;
};
void reset_allocation_counts();
[[nodiscard]] AllocationCounts allocation_counts();

/// False under sanitizers, which bring a heap of their own.
[[nodiscard]] bool allocations_are_counted();

} // namespace obscura::test
