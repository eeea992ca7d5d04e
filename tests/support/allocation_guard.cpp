// SPDX-License-Identifier: Apache-2.0
#include "tests/support/allocation_guard.hpp"

#include "core/realtime/realtime.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>

namespace obscura::test {
namespace {

std::atomic<std::uint64_t> realtime_count{0}, all_count{0};

[[maybe_unused]] void count() noexcept {
    all_count.fetch_add(1, std::memory_order_relaxed);
    if (this_thread_is_realtime()) realtime_count.fetch_add(1, std::memory_order_relaxed);
}

} // namespace

void reset_allocation_counts() {
    realtime_count = 0;
    all_count = 0;
}

AllocationCounts allocation_counts() {
    return {realtime_count.load(), all_count.load()};
}

bool allocations_are_counted() {
#ifdef OBSCURA_SANITIZED
    return false;
#else
    return true;
#endif
}

} // namespace obscura::test

#ifndef OBSCURA_SANITIZED
// glibc's own heap under our names; operator new ends in malloc.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
    obscura::test::count();
    return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
    obscura::test::count();
    return __libc_calloc(n, size);
}
void* realloc(void* old, std::size_t size) {
    obscura::test::count();
    return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
    obscura::test::count();
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    obscura::test::count();
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    obscura::test::count();
    *out = __libc_memalign(alignment, size);
    return *out != nullptr ? 0 : ENOMEM;
}
}
#endif
