// SPDX-License-Identifier: Apache-2.0
#include "core/clock.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>

namespace obscura {
namespace {

std::int64_t read_clock(clockid_t id) noexcept {
    timespec ts{};
    clock_gettime(id, &ts);
    return static_cast<std::int64_t>(ts.tv_sec) * ns_per_s + ts.tv_nsec;
}

} // namespace

Time MonotonicClock::now() const noexcept {
    return {read_clock(CLOCK_MONOTONIC)};
}

bool MonotonicClock::sleep_until(Time deadline) noexcept {
    timespec ts{};
    ts.tv_sec = deadline.ns / ns_per_s;
    ts.tv_nsec = deadline.ns % ns_per_s;
    while (interrupted_.load(std::memory_order_acquire) == 0) {
        if (now() >= deadline) return true;
        // FUTEX_WAIT_BITSET takes an absolute CLOCK_MONOTONIC time-out; interrupt() changes the word and
        // wakes the waiters.
        const long rc = syscall(SYS_futex, &interrupted_, FUTEX_WAIT_BITSET_PRIVATE, 0, &ts, nullptr,
                                FUTEX_BITSET_MATCH_ANY);
        if (rc == -1 && errno == ETIMEDOUT) return true;
    }
    return false;
}

void MonotonicClock::interrupt() noexcept {
    interrupted_.store(1, std::memory_order_release);
    syscall(SYS_futex, &interrupted_, FUTEX_WAKE_PRIVATE, 0x7fffffff, nullptr, nullptr, 0);
}

void MonotonicClock::rearm() noexcept {
    interrupted_.store(0, std::memory_order_release);
}

std::int64_t MonotonicClock::tai_offset_ns() const noexcept {
    // Read TAI between two monotonic readings and keep the attempt with the smallest gap, so that preemption
    // between the readings does not shift the offset.
    std::int64_t best_gap = ns_per_s;
    std::int64_t offset = 0;
    for (int attempt = 0; attempt < 4; ++attempt) {
        const std::int64_t before = read_clock(CLOCK_MONOTONIC);
        const std::int64_t tai = read_clock(CLOCK_TAI);
        const std::int64_t after = read_clock(CLOCK_MONOTONIC);
        if (after - before < best_gap) {
            best_gap = after - before;
            offset = tai - (before + best_gap / 2);
        }
    }
    return offset + tai_correction_ns_.load(std::memory_order_relaxed);
}

Time FakeClock::now() const noexcept {
    const std::lock_guard lock(mutex_);
    return now_;
}

bool FakeClock::sleep_until(Time deadline) noexcept {
    std::unique_lock lock(mutex_);
    if (auto_advance_ && !interrupted_) {
        if (deadline > now_) now_ = deadline;
        return true;
    }
    ++sleepers_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return interrupted_ || now_ >= deadline; });
    --sleepers_;
    return now_ >= deadline && !interrupted_;
}

void FakeClock::interrupt() noexcept {
    const std::lock_guard lock(mutex_);
    interrupted_ = true;
    changed_.notify_all();
}

void FakeClock::rearm() noexcept {
    const std::lock_guard lock(mutex_);
    interrupted_ = false;
}

std::int64_t FakeClock::tai_offset_ns() const noexcept {
    const std::lock_guard lock(mutex_);
    return tai_offset_ns_;
}

void FakeClock::advance_to(Time t) {
    const std::lock_guard lock(mutex_);
    if (t > now_) now_ = t;
    changed_.notify_all();
}

void FakeClock::set_tai_offset_ns(std::int64_t offset_ns) {
    const std::lock_guard lock(mutex_);
    tai_offset_ns_ = offset_ns;
}

int FakeClock::sleepers() const {
    const std::lock_guard lock(mutex_);
    return sleepers_;
}

} // namespace obscura
