// SPDX-License-Identifier: Apache-2.0
#include "tools/verbs/verb_watch.hpp"

#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "images/writers/pending_file.hpp"
#include "tools/scene/progress.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <utility>

namespace obscura::tools {
namespace {

using WatchClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto poll_interval = 50ms;
/// For a verb to end by itself after an interrupt, with what it has so far.
constexpr std::chrono::milliseconds grace{600}, grace_of_kept_work{10000};
constexpr auto first_terminal_line = 700ms, next_terminal_line = 200ms;
constexpr auto first_line = 5s, next_line = 5s;

} // namespace

VerbWatch::VerbWatch(Settings settings) : settings_(std::move(settings)) {
    // Signals are for the other threads, whose waits they end.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread_ = std::thread([this] { run(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

VerbWatch::~VerbWatch() {
    {
        const std::lock_guard lock(mutex_);
        over_ = true;
    }
    ended_.notify_all();
    thread_.join();
    erase_progress();
}

void VerbWatch::run() {
    pthread_setname_np(pthread_self(), "watch");
    const bool terminal = isatty(STDERR_FILENO) == 1;
    const auto start = WatchClock::now();
    auto next = start + (terminal ? WatchClock::duration(first_terminal_line) : first_line);
    std::optional<WatchClock::time_point> interrupt;
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, poll_interval, [this] { return over_; })) {
        const auto now = WatchClock::now();
        if (host::interrupted()) {
            if (!interrupt) interrupt = now;
            if (now - *interrupt >= (settings_.keeps_work ? grace_of_kept_work : grace)) end();
        } else if (settings_.shows_progress && now >= next) {
            show_progress(settings_.verb, std::chrono::duration<double>(now - start).count(), terminal);
            next = now + (terminal ? WatchClock::duration(next_terminal_line) : next_line);
        }
    }
}

void VerbWatch::end() const {
    erase_progress();
    images::remove_pending_files();
    print_message(fmt::format("obscura {}: interrupted", settings_.verb));
    if (settings_.interrupted_status) _exit(*settings_.interrupted_status);
    host::end_by_interrupt();
}

} // namespace obscura::tools
