// The part of Device that has lines, counters and timers.
#include "transports/gige/device/device.hpp"
#include "transports/gige/device/device_words.hpp"

namespace obscura::transports::gige {

bool Device::output_level(const IoInputs& in) const {
    const CameraSettings s = control_.settings();
    switch (static_cast<LineSource>(bank_.peek(feature::line_source))) {
    case LineSource::off:
        break;
    case LineSource::exposure_active:
        return exposure_active(in);
    case LineSource::frame_active:
        return frame_active(in);
    case LineSource::frame_trigger_wait:
        return control_.acquiring() && in.activity.trigger_ready;
    case LineSource::acquisition_active:
        return control_.acquiring();
    case LineSource::timer0_active:
        return timer_level(s.timers[0], 0, in);
    case LineSource::timer1_active:
        return timer_level(s.timers[1], 1, in);
    case LineSource::counter0_active:
        return counter_status(s.counters[0], 0, in) == IoStatus::active;
    case LineSource::counter1_active:
        return counter_status(s.counters[1], 1, in) == IoStatus::active;
    case LineSource::user_output0:
        return (bank_.peek(feature::user_output_value) & 1) != 0;
    }
    return false;
}

std::uint32_t Device::line_status_all() const {
    const IoInputs in = io_inputs(control_, clock_);
    std::uint32_t all = output_level(in) ? line_status_output : 0U;
    for (std::size_t i = 0; i < line_count; ++i)
        if (line_level(i, limits_.lines[i], in)) all |= line_status_line0 << i;
    for (std::uint32_t i = 0; i <= line_count; ++i)
        if (bank_.peek(feature::line_inverter + 4 * i) != 0) all ^= line_status_line0 << i;
    return all;
}

void Device::add_digital_io() {
    for (std::uint32_t line = 0; line <= line_count; ++line)
        bank_.add({.name = "LineInverter",
                   .address = feature::line_inverter + 4 * line,
                   .access = Access::read_write,
                   .maximum = 1});
    bank_.add({.name = "LineSource",
               .address = feature::line_source,
               .access = Access::read_write,
               .reset = static_cast<std::uint32_t>(LineSource::exposure_active),
               .maximum = line_source_count - 1});
    word("LineStatusAll", feature::line_status_all, 0, [this] { return line_status_all(); });
    bank_.add({.name = "UserOutputValue",
               .address = feature::user_output_value,
               .access = Access::read_write,
               .maximum = 1});
}

void Device::add_counters() {
    for (std::uint32_t i = 0; i < counter_count; ++i) {
        const std::uint32_t base = feature::counters + i * feature::counter_stride;
        setting(
            "CounterEventSource", base + feature::counter::event_source, false,
            [i](const CameraSettings& s) { return static_cast<std::uint32_t>(s.counters[i].source); },
            [i](CameraSettings& s, std::uint32_t value) {
                s.counters[i].source = static_cast<IoEvent>(value);
                return value < io_event_count;
            });
        setting(
            "CounterResetSource", base + feature::counter::reset_source, false,
            [i](const CameraSettings& s) { return static_cast<std::uint32_t>(s.counters[i].reset); },
            [i](CameraSettings& s, std::uint32_t value) {
                s.counters[i].reset = static_cast<CounterReset>(value);
                return value <= static_cast<std::uint32_t>(CounterReset::counter_end);
            });
        command("CounterReset", base + feature::counter::reset, [this, i] {
            control_.reset_counter(i);
            return Status::success;
        });
        word("CounterValue", base + feature::counter::value, 0, [this, i] {
            return counter_value(control_.settings().counters[i], i, io_inputs(control_, clock_));
        });
        word("CounterValueAtReset", base + feature::counter::value_at_reset, 0,
             [this, i] { return control_.activity().counters[i].value_at_reset; });
        setting(
            "CounterDuration", base + feature::counter::duration, false,
            [i](const CameraSettings& s) { return s.counters[i].duration; },
            [i](CameraSettings& s, std::uint32_t value) {
                s.counters[i].duration = value;
                return true;
            });
        word("CounterStatus", base + feature::counter::status, 0, [this, i] {
            return static_cast<std::uint32_t>(
                counter_status(control_.settings().counters[i], i, io_inputs(control_, clock_)));
        });
    }
}

void Device::add_timers() {
    for (std::uint32_t i = 0; i < timer_count; ++i) {
        const std::uint32_t base = feature::timers + i * feature::timer_stride;
        setting(
            "TimerTriggerSource", base + feature::timer::trigger_source, false,
            [i](const CameraSettings& s) { return static_cast<std::uint32_t>(s.timers[i].source); },
            [i](CameraSettings& s, std::uint32_t value) {
                s.timers[i].source = static_cast<IoEvent>(value);
                return value < io_event_count;
            });
        const auto span = [&](std::string_view name, std::uint32_t offset, std::int64_t PulseTimer::*member) {
            setting(
                name, base + offset, false,
                [i, member](const CameraSettings& s) { return time_units(s.timers[i].*member); },
                [i, member](CameraSettings& s, std::uint32_t value) {
                    s.timers[i].*member = std::int64_t{value} * feature::time_unit_ns;
                    return true;
                });
        };
        span("TimerDelay", feature::timer::delay, &PulseTimer::delay_ns);
        span("TimerDuration", feature::timer::duration, &PulseTimer::duration_ns);
        command("TimerReset", base + feature::timer::reset, [this, i] {
            control_.reset_timer(i);
            return Status::success;
        });
        word("TimerValue", base + feature::timer::value, 0, [this, i] {
            return time_units(timer_value_ns(control_.settings().timers[i], i, io_inputs(control_, clock_)));
        });
        word("TimerStatus", base + feature::timer::status, 0, [this, i] {
            return static_cast<std::uint32_t>(
                timer_status(control_.settings().timers[i], i, io_inputs(control_, clock_)));
        });
    }
}

} // namespace obscura::transports::gige
