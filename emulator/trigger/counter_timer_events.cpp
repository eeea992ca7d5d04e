// SPDX-License-Identifier: Apache-2.0
#include "emulator/trigger/counter_timer_events.hpp"

#include <utility>

namespace obscura::emulator {

void CounterTimerEvents::set(const CameraSettings& settings) {
    const IoInputs in = host_.io_inputs();
    {
        const std::lock_guard lock(mutex_);
        bool idle = true;
        for (std::size_t i = 0; i < counter_count; ++i) {
            Counter& counter = configured_counters_[i];
            const EventCounter& next = settings.counters[i];
            idle = idle && next.source == IoEvent::off;
            if (next == counter.set_up) continue;
            if (next.source != counter.set_up.source) marks_.rebase_counter(i, count_of(next.source, in));
            IoInputs rebased = in;
            marks_.fill(rebased.activity);
            counter = {next, rebased.activity.counters[i].base, counter_ends(next, i, rebased)};
        }
        for (std::size_t i = 0; i < timer_count; ++i) {
            Timer& timer = configured_timers_[i];
            const PulseTimer& next = settings.timers[i];
            idle = idle && next.source == IoEvent::off;
            if (next == timer.set_up) continue;
            Time started;
            timer = {next, timer_start(next, i, in, started) ? started : Time{}};
            alarms_.clear(first_alarm_ + first_timer_end + i);
        }
        idle_ = idle;
    }
    request_scan();
}

void CounterTimerEvents::reset_counter(std::size_t i) noexcept {
    marks_.reset_counter(configured_counters_[i].set_up, i, host_.io_inputs());
    request_scan();
}

void CounterTimerEvents::reset_timer(std::size_t i) noexcept {
    marks_.reset_timer(i, clock_.now());
    alarms_.clear(first_alarm_ + first_timer_end + i);
}

void CounterTimerEvents::acquisition_start() noexcept {
    const IoInputs in = host_.io_inputs();
    for (std::size_t i = 0; i < counter_count; ++i)
        if (const EventCounter& counter = configured_counters_[i].set_up;
            counter.reset == CounterReset::acquisition_start)
            marks_.reset_counter(counter, i, in);
}

void CounterTimerEvents::request_scan() noexcept {
    if (!idle()) set_alarm(now, clock_.now());
}

void CounterTimerEvents::frame_begun(const FrameInstants& instants) noexcept {
    if (idle()) return;
    set_alarm(now, clock_.now());
    set_alarm(exposure_start, instants.exposure_start);
    set_alarm(exposure_end, instants.exposure_end);
    set_alarm(frame_end, instants.frame_end);
}

void CounterTimerEvents::on_alarm(std::size_t alarm, Time due) noexcept {
    const std::size_t offset = alarm - first_alarm_;
    if (offset < first_timer_end) {
        scan();
        return;
    }
    const std::size_t timer = offset - first_timer_end;
    if (timer_runs(timer, host_.io_inputs())) emit(counter_count + timer, due);
}

void CounterTimerEvents::take_over_settings() noexcept {
    // The control thread requests a scan after it has changed the settings.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    for (std::size_t i = 0; i < counter_count; ++i)
        if (counters_[i].set_up != configured_counters_[i].set_up) counters_[i] = configured_counters_[i];
    for (std::size_t i = 0; i < timer_count; ++i)
        if (timers_[i].set_up != configured_timers_[i].set_up) timers_[i] = configured_timers_[i];
}

void CounterTimerEvents::scan() noexcept {
    take_over_settings();
    const IoInputs in = host_.io_inputs();
    Time t;
    for (std::size_t i = 0; i < counter_count; ++i)
        for (std::uint64_t n = new_counter_ends(i, in, t); n > 0; --n)
            emit(i, t);
    for (std::size_t i = 0; i < timer_count; ++i)
        if (timer_started(i, in, t)) set_alarm(first_timer_end + i, t);
}

/// Ends of counter `i` since the last scan, and the instant of the last one. None while it counts missed
/// triggers: a trigger from its end could be missed in turn, an infinite loop.
std::uint64_t CounterTimerEvents::new_counter_ends(std::size_t i, const IoInputs& in, Time& last) noexcept {
    Counter& counter = counters_[i];
    if (counter.set_up.source == IoEvent::frame_trigger_missed) return 0;
    if (const std::uint64_t base = in.activity.counters[i].base; base != counter.base) {
        counter.base = base;
        counter.ended = 0;
    }
    const std::uint64_t ends = counter_ends(counter.set_up, i, in);
    if (ends <= counter.ended) return 0;
    if (!last_of(counter.set_up.source, in, last)) last = in.now;
    return ends - std::exchange(counter.ended, ends);
}

/// True if timer `i` was started since the last scan; sets `end` to its end.
bool CounterTimerEvents::timer_started(std::size_t i, const IoInputs& in, Time& end) noexcept {
    Timer& timer = timers_[i];
    Time start;
    if (!timer_start(timer.set_up, i, in, start) || start == timer.started) return false;
    timer.started = start;
    end = start + timer.set_up.delay_ns + timer.set_up.duration_ns;
    return true;
}

/// True if timer `i` has been neither reset nor configured since its start.
bool CounterTimerEvents::timer_runs(std::size_t i, const IoInputs& in) noexcept {
    take_over_settings();
    return timers_[i].started != Time{} && timers_[i].started >= in.activity.timer_resets[i];
}

void CounterTimerEvents::emit(std::size_t end, Time t) noexcept {
    const auto source =
        static_cast<TriggerSource>(static_cast<std::size_t>(TriggerSource::counter0_end) + end);
    host_.on_end(source, {++end_ids_[end], t, clock_.now()});
}

} // namespace obscura::emulator
