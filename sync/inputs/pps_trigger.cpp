// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/pps_trigger.hpp"

#include "core/realtime/realtime.hpp"

#include <algorithm>
#include <utility>

namespace obscura::sync {

PpsTrigger::PpsTrigger(const PpsSettings& settings, const ThreadSettings& thread, EdgeTrigger::Open open,
                       std::unique_ptr<Clock> clock)
    : settings_(settings),
      thread_settings_(thread),
      clock_(std::move(clock)),
      pulses_(*clock_),
      input_({.name = "pps-in", .thread = thread}, std::move(open), *clock_) {}

PpsTrigger::~PpsTrigger() {
    stop();
}

void PpsTrigger::start(TriggerSink& sink) {
    stop();
    pulses_.latest_ns = INT64_MIN;
    stopping_ = false;
    missed_ = 0;
    clock_->rearm();
    input_.start(pulses_);
    thread_ = std::thread([this, &sink] {
        enter_thread(heartbeat_.name().c_str(), thread_settings_);
        declare_this_thread_realtime();
        run(sink);
    });
}

void PpsTrigger::stop() {
    if (!thread_.joinable()) return;
    input_.stop();
    stopping_ = true;
    clock_->interrupt();
    thread_.join();
    heartbeat_.rest();
    state_ = ClockState::free;
}

Heartbeats PpsTrigger::heartbeats() const {
    Heartbeats all = input_.heartbeats();
    all.push_back(&heartbeat_);
    return all;
}

void PpsTrigger::Pulses::on_trigger(const Trigger& t) noexcept {
    latest_ns.store(t.edge.ns, std::memory_order_release);
    clock.interrupt();
}

void PpsTrigger::run(TriggerSink& sink) noexcept {
    PpsSchedule schedule(settings_);
    std::int64_t latest_ns = INT64_MIN;
    std::uint64_t next = 0;
    while (!stopping_.load(std::memory_order_relaxed)) {
        heartbeat_.beat();
        if (const std::int64_t pulse_ns = pulses_.latest_ns.load(std::memory_order_acquire);
            pulse_ns != latest_ns) {
            latest_ns = pulse_ns;
            const bool expected = schedule.started();
            if (schedule.pulse(Time{pulse_ns}) && expected)
                offset_ns_.store(schedule.last_offset_ns(), std::memory_order_relaxed);
        }
        const Time now = clock_->now();
        state_.store(schedule.state(now), std::memory_order_relaxed);
        if (!schedule.started()) {
            if (!clock_->sleep_until(now + Heartbeat::max_wait_ns)) clock_->rearm();
            continue;
        }
        Time due = schedule.slot(next);
        if (schedule.awaits_pulse(next)) due += pulse_timeout_ns;
        if (now < due) {
            // A new pulse moves the slot: recompute it whenever one comes.
            if (!clock_->sleep_until(std::min(due, now + Heartbeat::max_wait_ns))) clock_->rearm();
            continue;
        }
        std::uint64_t latest = schedule.first_slot_from(now + 1) - 1;
        if (latest > next && schedule.awaits_pulse(latest)) --latest;
        missed_.fetch_add(latest - next, std::memory_order_relaxed);
        sink.on_trigger({.id = latest + 1,
                         .edge = schedule.slot(latest),
                         .seen = now,
                         .clock = schedule.state(now),
                         .next = schedule.slot(latest + 1)});
        next = latest + 1;
    }
}

} // namespace obscura::sync
