// The part of Device that has lines, counters and timers.
#include "transports/gige/device.hpp"
#include "transports/gige/device_words.hpp"

namespace obscura::transports::gige {

IoInputs Device::io_inputs() const {
    // The activity first: what it tells of has happened by `now`.
    IoInputs in;
    in.activity = control_.activity();
    in.acquiring = control_.acquiring();
    in.acquisitions = acquisitions_;
    in.acquisition_start = acquisition_start_;
    in.now = clock_.now();
    return in;
}

bool Device::line1_level(const IoInputs& in) const {
    switch (static_cast<LineSource>(bank_.peek(feature::line_source))) {
    case LineSource::off:
        break;
    case LineSource::exposure_active:
        return exposure_active(in);
    case LineSource::frame_active:
        return frame_active(in);
    case LineSource::frame_trigger_wait:
        return in.acquiring && in.activity.trigger_ready;
    case LineSource::acquisition_active:
        return in.acquiring;
    case LineSource::timer0_active:
        return timers_[0].level(in);
    case LineSource::timer1_active:
        return timers_[1].level(in);
    case LineSource::counter0_active:
        return counters_[0].status(in) == IoStatus::active;
    case LineSource::counter1_active:
        return counters_[1].status(in) == IoStatus::active;
    case LineSource::user_output0:
        return (bank_.peek(feature::user_output_value) & 1) != 0;
    }
    return false;
}

std::uint32_t Device::line_status_all() const {
    const IoInputs in = io_inputs();
    const bool line0 = line0_level(in) != (bank_.peek(feature::line_inverter) != 0);
    const bool line1 = line1_level(in) != (bank_.peek(feature::line_inverter + 4) != 0);
    return (line0 ? line_status_line0 : 0U) | (line1 ? line_status_line1 : 0U);
}

void Device::add_digital_io() {
    for (std::uint32_t line = 0; line < 2; ++line)
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

void Device::begin_acquisition_counters() {
    ++acquisitions_;
    acquisition_start_ = clock_.now();
    const IoInputs in = io_inputs();
    for (EventCounter& c : counters_)
        if (c.reset_by_acquisition_start) c.reset(in);
}

void Device::add_counters() {
    for (std::uint32_t i = 0; i < feature::counter_count; ++i) {
        const std::uint32_t base = feature::counters + i * feature::counter_stride;
        EventCounter& c = counters_[i];
        word(
            "CounterEventSource", base + feature::counter::event_source, io_event_count - 1,
            [&c] { return static_cast<std::uint32_t>(c.source); },
            [this, &c](std::uint32_t value) {
                c.source = static_cast<IoEvent>(value);
                c.base = count_of(c.source, io_inputs());
            });
        word(
            "CounterResetSource", base + feature::counter::reset_source, 1,
            [&c] { return std::uint32_t{c.reset_by_acquisition_start}; },
            [&c](std::uint32_t value) { c.reset_by_acquisition_start = value == 1; });
        command("CounterReset", base + feature::counter::reset, [this, &c] {
            c.reset(io_inputs());
            return Status::success;
        });
        word("CounterValue", base + feature::counter::value, 0, [this, &c] { return c.value(io_inputs()); });
        word("CounterValueAtReset", base + feature::counter::value_at_reset, 0,
             [&c] { return c.value_at_reset; });
        word(
            "CounterDuration", base + feature::counter::duration, 0xFFFFFFFF, [&c] { return c.duration; },
            [&c](std::uint32_t value) { c.duration = value; });
        word("CounterStatus", base + feature::counter::status, 0,
             [this, &c] { return static_cast<std::uint32_t>(c.status(io_inputs())); });
    }
}

void Device::add_timers() {
    for (std::uint32_t i = 0; i < feature::timer_count; ++i) {
        const std::uint32_t base = feature::timers + i * feature::timer_stride;
        PulseTimer& t = timers_[i];
        word(
            "TimerTriggerSource", base + feature::timer::trigger_source, io_event_count - 1,
            [&t] { return static_cast<std::uint32_t>(t.source); },
            [&t](std::uint32_t value) { t.source = static_cast<IoEvent>(value); });
        const auto span = [&](std::string_view name, std::uint32_t offset, std::int64_t PulseTimer::*member) {
            word(
                name, base + offset, 0xFFFFFFFF, [&t, member] { return time_units(t.*member); },
                [&t, member](std::uint32_t value) {
                    t.*member = std::int64_t{value} * feature::time_unit_ns;
                });
        };
        span("TimerDelay", feature::timer::delay, &PulseTimer::delay_ns);
        span("TimerDuration", feature::timer::duration, &PulseTimer::duration_ns);
        command("TimerReset", base + feature::timer::reset, [this, &t] {
            t.reset_at = clock_.now();
            return Status::success;
        });
        word("TimerValue", base + feature::timer::value, 0,
             [this, &t] { return time_units(t.value_ns(io_inputs())); });
        word("TimerStatus", base + feature::timer::status, 0,
             [this, &t] { return static_cast<std::uint32_t>(t.status(io_inputs())); });
    }
}

} // namespace obscura::transports::gige
