// SPDX-License-Identifier: Apache-2.0
#include "sync/timer.hpp"

#include "core/realtime/realtime.hpp"

#include <algorithm>

namespace obscura::sync {

TimerTrigger::TimerTrigger(TimerSettings settings, std::unique_ptr<Clock> clock)
    : settings_(settings), clock_(std::move(clock)) {}

TimerTrigger::~TimerTrigger() {
    stop();
}

void TimerTrigger::start(TriggerSink& sink) {
    stop();
    stopping_ = false;
    missed_ = 0;
    clock_->rearm();
    const Schedule schedule(settings_.rate, settings_.start.value_or(clock_->now()), settings_.phase_ns);
    thread_ = std::thread([this, &sink, schedule] {
        enter_thread(heartbeat_.name().c_str(), settings_.thread);
        declare_this_thread_realtime();
        run(sink, schedule);
    });
}

void TimerTrigger::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    clock_->interrupt();
    thread_.join();
    heartbeat_.rest();
}

void TimerTrigger::run(TriggerSink& sink, const Schedule& schedule) noexcept {
    // A start in the past is the epoch from which slots are counted; slots before now are not delivered.
    std::uint64_t k = schedule.first_slot_from(clock_->now());
    while (!stopping_.load(std::memory_order_relaxed)) {
        heartbeat_.beat();
        // Sleep in steps with a heartbeat each, so that the watchdog does not take a long wait for a hang.
        const Time slot = schedule.slot(k);
        if (!clock_->sleep_until(std::min(slot, clock_->now() + Heartbeat::max_wait_ns))) continue;
        const Time now = clock_->now();
        if (now < slot) continue;
        const std::uint64_t next = schedule.first_slot_from(now + 1);
        // Slots k .. next-1 are due: deliver the last and count the others as missed.
        if (next > k + 1) missed_.fetch_add(next - 1 - k, std::memory_order_relaxed);
        if (next > k) {
            k = next - 1;
            sink.on_trigger(
                {.id = k + 1, .edge = schedule.slot(k), .seen = now, .next = schedule.slot(k + 1)});
            ++k;
        }
    }
}

} // namespace obscura::sync
