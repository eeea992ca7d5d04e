#include "transports/gige/io_state.hpp"

#include <algorithm>

namespace obscura::transports::gige {
namespace {

constexpr std::int64_t line0_pulse_ns = ns_per_ms;

/// Frames whose instant `t` (of the last one) has come.
std::uint64_t frames_past(const IoInputs& in, Time t) noexcept {
    const std::uint64_t frames = in.activity.frames;
    return frames > 0 && t > in.now ? frames - 1 : frames;
}

bool between(const IoInputs& in, Time from, Time to) noexcept {
    return in.activity.frames > 0 && from <= in.now && in.now < to;
}

} // namespace

std::uint64_t count_of(IoEvent event, const IoInputs& in) noexcept {
    const CameraActivity& a = in.activity;
    switch (event) {
    case IoEvent::off:
        break;
    case IoEvent::line0:
        return a.line0_edges;
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
        return in.acquisitions;
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
        return if_any(a.line0_edges, a.line0_edge);
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
        return if_any(in.acquisitions, in.acquisition_start);
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

bool line0_level(const IoInputs& in) noexcept {
    const Time edge = in.activity.line0_edge;
    return in.activity.line0_edges > 0 && edge <= in.now && in.now < edge + line0_pulse_ns;
}

std::uint32_t EventCounter::value(const IoInputs& in) const noexcept {
    const std::uint64_t n = count_of(source, in) - base;
    return static_cast<std::uint32_t>(duration > 0 ? std::min<std::uint64_t>(n, duration) : n);
}

IoStatus EventCounter::status(const IoInputs& in) const noexcept {
    if (source == IoEvent::off) return IoStatus::idle;
    return duration > 0 && value(in) >= duration ? IoStatus::completed : IoStatus::active;
}

void EventCounter::reset(const IoInputs& in) noexcept {
    value_at_reset = value(in);
    base = count_of(source, in);
}

std::int64_t PulseTimer::value_ns(const IoInputs& in) const noexcept {
    Time start;
    if (!last_of(source, in, start) || start < reset_at) return 0;
    return std::clamp<std::int64_t>(in.now - start - delay_ns, 0, duration_ns);
}

IoStatus PulseTimer::status(const IoInputs& in) const noexcept {
    if (source == IoEvent::off) return IoStatus::idle;
    Time start;
    if (!last_of(source, in, start) || start < reset_at) return IoStatus::trigger_wait;
    return in.now < start + delay_ns + duration_ns ? IoStatus::active : IoStatus::completed;
}

bool PulseTimer::level(const IoInputs& in) const noexcept {
    Time start;
    return last_of(source, in, start) && start >= reset_at && in.now >= start + delay_ns &&
           in.now < start + delay_ns + duration_ns;
}

} // namespace obscura::transports::gige
