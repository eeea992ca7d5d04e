// SPDX-License-Identifier: Apache-2.0
#include "core/camera/io_state.hpp"

#include <algorithm>

namespace obscura {
namespace {

constexpr std::int64_t line_pulse_ns = ns_per_ms;

/// Number of frames whose event has occurred; `t` is the instant of that event in the last frame.
std::uint64_t frames_past(const IoInputs& in, Time t) noexcept {
    const std::uint64_t frames = in.activity.frames;
    return frames > 0 && t > in.now ? frames - 1 : frames;
}

bool between(const IoInputs& in, Time from, Time to) noexcept {
    return in.activity.frames > 0 && from <= in.now && in.now < to;
}

std::size_t line_of(IoEvent event) noexcept {
    return event == IoEvent::line0
               ? 0
               : static_cast<std::size_t>(event) - static_cast<std::size_t>(IoEvent::line1) + 1;
}

std::uint64_t counted(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept {
    // While the camera records the next frame, its last one may briefly count as not ended: clamp at 0.
    const std::uint64_t count = count_of(counter.source, in), base = in.activity.counters[i].base;
    return count > base ? count - base : 0;
}

} // namespace

IoInputs io_inputs(const CameraControl& camera, const Clock& clock) {
    IoInputs in;
    in.activity = camera.activity(); // read before the time, so that no recorded event lies after `now`
    in.now = clock.now();
    return in;
}

std::uint64_t count_of(IoEvent event, const IoInputs& in) noexcept {
    const CameraActivity& a = in.activity;
    switch (event) {
    case IoEvent::off:
        break;
    case IoEvent::line0:
    case IoEvent::line1:
    case IoEvent::line2:
    case IoEvent::line3:
        return a.lines[line_of(event)].edges;
    case IoEvent::frame_trigger:
        return a.frame_triggers;
    case IoEvent::frame_trigger_missed:
        return a.missed_triggers;
    case IoEvent::frame_start:
        return frames_past(in, a.frame_start);
    case IoEvent::frame_end:
        return frames_past(in, a.frame_end);
    case IoEvent::exposure_start:
        return frames_past(in, a.exposure_start);
    case IoEvent::exposure_end:
        return frames_past(in, a.exposure_end);
    case IoEvent::acquisition_start:
        return a.acquisitions;
    }
    return 0;
}

bool last_of(IoEvent event, const IoInputs& in, Time& t) noexcept {
    const CameraActivity& a = in.activity;
    const auto if_any = [&](std::uint64_t count, Time instant) {
        t = instant;
        return count > 0 && instant <= in.now;
    };
    switch (event) {
    case IoEvent::line0:
    case IoEvent::line1:
    case IoEvent::line2:
    case IoEvent::line3:
        return if_any(a.lines[line_of(event)].edges, a.lines[line_of(event)].edge);
    case IoEvent::frame_trigger:
    case IoEvent::frame_start:
        return if_any(a.frames, a.frame_start);
    case IoEvent::frame_end:
        return if_any(a.frames, a.frame_end);
    case IoEvent::exposure_start:
        return if_any(a.frames, a.exposure_start);
    case IoEvent::exposure_end:
        return if_any(a.frames, a.exposure_end);
    case IoEvent::acquisition_start:
        return if_any(a.acquisitions, a.acquisition_start);
    case IoEvent::off:
    case IoEvent::frame_trigger_missed:
        break;
    }
    return false;
}

bool exposure_active(const IoInputs& in) noexcept {
    return between(in, in.activity.exposure_start, in.activity.exposure_end);
}

bool frame_active(const IoInputs& in) noexcept {
    return between(in, in.activity.frame_start, in.activity.frame_end);
}

bool line_level(std::size_t line, const LineEdges& edges, const IoInputs& in) noexcept {
    const LineActivity& a = in.activity.lines[line];
    if (edges.both()) return a.high;
    return a.edges > 0 && a.edge <= in.now && in.now < a.edge + line_pulse_ns;
}

std::uint32_t counter_value(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept {
    const std::uint64_t n = counted(counter, i, in);
    if (counter.duration == 0) return static_cast<std::uint32_t>(n);
    return static_cast<std::uint32_t>(counter.reset == CounterReset::counter_end
                                          ? n % counter.duration
                                          : std::min<std::uint64_t>(n, counter.duration));
}

IoStatus counter_status(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept {
    if (counter.source == IoEvent::off) return IoStatus::idle;
    const bool completed = counter.reset != CounterReset::counter_end && counter_ends(counter, i, in) > 0;
    return completed ? IoStatus::completed : IoStatus::active;
}

std::uint64_t counter_ends(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept {
    if (counter.source == IoEvent::off || counter.duration == 0) return 0;
    const std::uint64_t ends = counted(counter, i, in) / counter.duration;
    return counter.reset == CounterReset::counter_end ? ends : std::min<std::uint64_t>(ends, 1);
}

bool timer_start(const PulseTimer& timer, std::size_t i, const IoInputs& in, Time& start) noexcept {
    return last_of(timer.source, in, start) && start >= in.activity.timer_resets[i];
}

std::int64_t timer_value_ns(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept {
    Time start;
    if (!timer_start(timer, i, in, start)) return 0;
    return std::clamp<std::int64_t>(in.now - start - timer.delay_ns, 0, timer.duration_ns);
}

IoStatus timer_status(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept {
    if (timer.source == IoEvent::off) return IoStatus::idle;
    Time start;
    if (!timer_start(timer, i, in, start)) return IoStatus::trigger_wait;
    return in.now < start + timer.delay_ns + timer.duration_ns ? IoStatus::active : IoStatus::completed;
}

bool timer_level(const PulseTimer& timer, std::size_t i, const IoInputs& in) noexcept {
    Time start;
    return timer_start(timer, i, in, start) && in.now >= start + timer.delay_ns &&
           in.now < start + timer.delay_ns + timer.duration_ns;
}

void IoMarks::reset_counter(const EventCounter& counter, std::size_t i, const IoInputs& in) noexcept {
    value_at_reset_[i].store(counter_value(counter, i, in), std::memory_order_relaxed);
    rebase_counter(i, count_of(counter.source, in));
}

void IoMarks::rebase_counter(std::size_t i, std::uint64_t count) noexcept {
    base_[i].store(count, std::memory_order_release);
}

void IoMarks::reset_timer(std::size_t i, Time now) noexcept {
    timer_reset_ns_[i].store(now.ns, std::memory_order_release);
}

void IoMarks::fill(CameraActivity& activity) const noexcept {
    for (std::size_t i = 0; i < counter_count; ++i)
        activity.counters[i] = {base_[i].load(std::memory_order_acquire),
                                value_at_reset_[i].load(std::memory_order_relaxed)};
    for (std::size_t i = 0; i < timer_count; ++i)
        activity.timer_resets[i] = Time{timer_reset_ns_[i].load(std::memory_order_acquire)};
}

} // namespace obscura
