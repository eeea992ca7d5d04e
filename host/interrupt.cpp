// SPDX-License-Identifier: Apache-2.0
#include "host/interrupt.hpp"

#include <atomic>
#include <csignal>

namespace obscura::host {
namespace {

std::atomic<bool> seen{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

void on_signal(int) {
    seen.store(true, std::memory_order_relaxed);
}

} // namespace

void catch_interrupts() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESETHAND;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() noexcept {
    return seen.load(std::memory_order_relaxed);
}

} // namespace obscura::host
