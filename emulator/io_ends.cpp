#include "emulator/io_ends.hpp"

#include <utility>

namespace obscura::emulator {

void IoEnds::set(const CameraSettings& settings, const IoInputs& in) {
    const std::lock_guard lock(mutex_);
    bool idle = true;
    for (std::size_t i = 0; i < counter_count; ++i) {
        Counter& counter = wanted_counters_[i];
        const EventCounter& next = settings.counters[i];
        idle = idle && next.source == IoEvent::off;
        if (next == counter.set_up) continue;
        if (next.source != counter.set_up.source) marks_.rebase_counter(i, count_of(next.source, in));
        IoInputs rebased = in;
        marks_.fill(rebased.activity);
        counter = {next, rebased.activity.counters[i].base, counter_ends(next, i, rebased)};
    }
    for (std::size_t i = 0; i < timer_count; ++i) {
        Timer& timer = wanted_timers_[i];
        const PulseTimer& next = settings.timers[i];
        idle = idle && next.source == IoEvent::off;
        if (next == timer.set_up) continue;
        Time started;
        timer = {next, timer_start(next, i, in, started) ? started : Time{}};
    }
    idle_ = idle;
}

void IoEnds::reset_counter(std::size_t i, const IoInputs& in) noexcept {
    marks_.reset_counter(wanted_counters_[i].set_up, i, in);
}

void IoEnds::acquisition_start(const IoInputs& in) noexcept {
    for (std::size_t i = 0; i < counter_count; ++i)
        if (wanted_counters_[i].set_up.reset == CounterReset::acquisition_start) reset_counter(i, in);
}

void IoEnds::begin_look() noexcept {
    // Whoever holds it is about to have us look again.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    for (std::size_t i = 0; i < counter_count; ++i)
        if (counters_[i].set_up != wanted_counters_[i].set_up) counters_[i] = wanted_counters_[i];
    for (std::size_t i = 0; i < timer_count; ++i)
        if (timers_[i].set_up != wanted_timers_[i].set_up) timers_[i] = wanted_timers_[i];
}

std::uint64_t IoEnds::new_counter_ends(std::size_t i, const IoInputs& in, Time& last) noexcept {
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

bool IoEnds::timer_started(std::size_t i, const IoInputs& in, Time& end) noexcept {
    Timer& timer = timers_[i];
    Time start;
    if (!timer_start(timer.set_up, i, in, start) || start == timer.started) return false;
    timer.started = start;
    end = start + timer.set_up.delay_ns + timer.set_up.duration_ns;
    return true;
}

bool IoEnds::timer_runs(std::size_t i, const IoInputs& in) noexcept {
    begin_look();
    return timers_[i].started != Time{} && timers_[i].started >= in.activity.timer_resets[i];
}

} // namespace obscura::emulator
