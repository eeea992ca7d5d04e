// SPDX-License-Identifier: Apache-2.0
#include "host/interrupt.hpp"

#include <unistd.h>

#include <csignal>

namespace obscura::host {
namespace {

std::atomic<bool> seen{false};
std::atomic<int> first_signal{0};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");
static_assert(std::atomic<int>::is_always_lock_free, "set in a signal handler");

void on_signal(int number) {
    int none = 0;
    first_signal.compare_exchange_strong(none, number, std::memory_order_relaxed);
    seen.store(true, std::memory_order_release);
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

const std::atomic<bool>& interrupt_flag() noexcept {
    return seen;
}

int interrupt_signal() noexcept {
    return seen.load(std::memory_order_acquire) ? first_signal.load(std::memory_order_relaxed) : 0;
}

void end_by_interrupt() noexcept {
    const int number = interrupt_signal() != 0 ? interrupt_signal() : SIGTERM;
    std::signal(number, SIG_DFL);
    sigset_t only;
    sigemptyset(&only);
    sigaddset(&only, number);
    pthread_sigmask(SIG_UNBLOCK, &only, nullptr);
    kill(getpid(), number);
    for (;;)
        pause();
}

} // namespace obscura::host
