// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/event_count.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>

namespace obscura {

static_assert(sizeof(std::atomic<std::uint32_t>) == 4, "the futex word is the atomic itself");

void EventCount::notify() noexcept {
    // Sequentially consistent with wait(): either the waiter sees the new count, or notify() sees the waiter.
    count_.fetch_add(1, std::memory_order_seq_cst);
    if (waiting_.load(std::memory_order_seq_cst) != 0)
        syscall(SYS_futex, &count_, FUTEX_WAKE_PRIVATE, 0x7fffffff, nullptr, nullptr, 0);
}

void EventCount::wait(std::uint32_t seen, Time deadline) noexcept {
    waiting_.fetch_add(1, std::memory_order_seq_cst);
    if (count_.load(std::memory_order_seq_cst) == seen) {
        timespec at{};
        at.tv_sec = deadline.ns / ns_per_s;
        at.tv_nsec = deadline.ns % ns_per_s;
        syscall(SYS_futex, &count_, FUTEX_WAIT_BITSET_PRIVATE, seen, deadline == never ? nullptr : &at,
                nullptr, FUTEX_BITSET_MATCH_ANY);
    }
    waiting_.fetch_sub(1, std::memory_order_seq_cst);
}

} // namespace obscura
