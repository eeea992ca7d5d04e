// SPDX-License-Identifier: Apache-2.0
// CounterAndTimerControl.
#include "core/camera/io_state.hpp"
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

template<auto member>
std::uint64_t get_counter(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return encode(f, d.control.settings().counters[i].*member);
}
template<auto member>
Status set_counter(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    decode(f, word, wanted.counters[i].*member);
    return apply_settings(d, wanted);
}
std::uint64_t get_counter_value(const Feature&, DeviceContext& d, std::uint32_t i) {
    return counter_value(d.control.settings().counters[i], i, io_inputs(d.control, d.clock));
}
std::uint64_t get_counter_status(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(counter_status(d.control.settings().counters[i], i, io_inputs(d.control, d.clock)));
}

template<auto member>
std::uint64_t get_timer(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return encode(f, d.control.settings().timers[i].*member);
}
template<auto member>
Status set_timer(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    decode(f, word, wanted.timers[i].*member);
    return apply_settings(d, wanted);
}
std::uint64_t get_timer_value(const Feature& f, DeviceContext& d, std::uint32_t i) {
    return encode(f, timer_value_ns(d.control.settings().timers[i], i, io_inputs(d.control, d.clock)));
}
std::uint64_t get_timer_status(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(timer_status(d.control.settings().timers[i], i, io_inputs(d.control, d.clock)));
}

constexpr std::array counter_selector_entries{
    entry("Counter0", 0),
    entry("Counter1", 1),
};

constexpr std::array counter_event_source_entries{
    entry("Off", IoEvent::off),
    entry("Line0", IoEvent::line0),
    entry("FrameTrigger", IoEvent::frame_trigger),
    FeatureEntry{.name = "FrameTriggerMissed", .value = value(IoEvent::frame_trigger_missed), .custom = true},
    entry("FrameStart", IoEvent::frame_start),
    entry("FrameEnd", IoEvent::frame_end),
    entry("ExposureStart", IoEvent::exposure_start),
    entry("ExposureEnd", IoEvent::exposure_end),
    entry("AcquisitionStart", IoEvent::acquisition_start),
    entry("Line1", IoEvent::line1),
    entry("Line2", IoEvent::line2),
    entry("Line3", IoEvent::line3),
};

constexpr std::array counter_event_activation_entries{
    entry("RisingEdge", 0),
};

constexpr std::array counter_reset_source_entries{
    entry("Off", CounterReset::off),
    entry("AcquisitionStart", CounterReset::acquisition_start),
    FeatureEntry{.name = "CounterEnd",
                 .value = value(CounterReset::counter_end),
                 .tooltip = "End of this counter, after every CounterDuration events",
                 .custom = true},
};

constexpr std::array counter_status_entries{
    entry("CounterIdle", IoStatus::idle),
    entry("CounterTriggerWait", IoStatus::trigger_wait),
    entry("CounterActive", IoStatus::active),
    entry("CounterCompleted", IoStatus::completed),
};

constexpr std::array timer_selector_entries{
    entry("Timer0", 0),
    entry("Timer1", 1),
};

constexpr std::array timer_trigger_source_entries{
    entry("Off", IoEvent::off),
    entry("Line0", IoEvent::line0),
    entry("FrameTrigger", IoEvent::frame_trigger),
    entry("FrameStart", IoEvent::frame_start),
    entry("FrameEnd", IoEvent::frame_end),
    entry("ExposureStart", IoEvent::exposure_start),
    entry("ExposureEnd", IoEvent::exposure_end),
    entry("AcquisitionStart", IoEvent::acquisition_start),
    entry("Line1", IoEvent::line1),
    entry("Line2", IoEvent::line2),
    entry("Line3", IoEvent::line3),
};

constexpr std::array timer_trigger_activation_entries{
    entry("RisingEdge", 0),
};

constexpr std::array timer_status_entries{
    entry("TimerIdle", IoStatus::idle),
    entry("TimerTriggerWait", IoStatus::trigger_wait),
    entry("TimerActive", IoStatus::active),
    entry("TimerCompleted", IoStatus::completed),
};

constexpr std::array counter_and_timer_features{
    Feature{.name = "CounterSelector", .type = FeatureType::enumeration, .entries = counter_selector_entries},
    Feature{.name = "CounterEventSource",
            .type = FeatureType::enumeration,
            .address = 0xA700,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .entries = counter_event_source_entries,
            .get = get_counter<&EventCounter::source>,
            .set = set_counter<&EventCounter::source>},
    Feature{.name = "CounterEventActivation",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .entries = counter_event_activation_entries},
    Feature{.name = "CounterResetSource",
            .type = FeatureType::enumeration,
            .address = 0xA704,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .entries = counter_reset_source_entries,
            .get = get_counter<&EventCounter::reset>,
            .set = set_counter<&EventCounter::reset>},
    Feature{.name = "CounterReset",
            .type = FeatureType::command,
            .address = 0xA708,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .run =
                [](DeviceContext& d, std::uint32_t i) {
                    d.control.reset_counter(i);
                    return Status::success;
                }},
    Feature{.name = "CounterValue",
            .access = Access::read_only,
            .address = 0xA70C,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .get = get_counter_value},
    Feature{.name = "CounterValueAtReset",
            .access = Access::read_only,
            .address = 0xA710,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t i) -> std::uint64_t {
                return d.control.activity().counters[i].value_at_reset;
            }},
    Feature{.name = "CounterDuration",
            .tooltip = "Events until the counter ends; 0: it does not",
            .address = 0xA714,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .minimum = fixed(0),
            .maximum = fixed(0xFFFFFFFF),
            .get = get_counter<&EventCounter::duration>,
            .set = set_counter<&EventCounter::duration>},
    Feature{.name = "CounterStatus",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .address = 0xA718,
            .selectors = {"CounterSelector"},
            .stride = 32,
            .entries = counter_status_entries,
            .get = get_counter_status},
    Feature{.name = "TimerSelector", .type = FeatureType::enumeration, .entries = timer_selector_entries},
    Feature{.name = "TimerTriggerSource",
            .type = FeatureType::enumeration,
            .address = 0xA780,
            .selectors = {"TimerSelector"},
            .stride = 32,
            .entries = timer_trigger_source_entries,
            .get = get_timer<&PulseTimer::source>,
            .set = set_timer<&PulseTimer::source>},
    Feature{.name = "TimerTriggerActivation",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .entries = timer_trigger_activation_entries},
    Feature{.name = "TimerDelay",
            .type = FeatureType::floating,
            .address = 0xA784,
            .selectors = {"TimerSelector"},
            .stride = 32,
            .unit = "us",
            .scale = 100,
            .minimum = fixed(0),
            .maximum = fixed(42949672.95),
            .get = get_timer<&PulseTimer::delay_ns>,
            .set = set_timer<&PulseTimer::delay_ns>},
    Feature{.name = "TimerDuration",
            .type = FeatureType::floating,
            .address = 0xA788,
            .selectors = {"TimerSelector"},
            .stride = 32,
            .unit = "us",
            .scale = 100,
            .minimum = fixed(0),
            .maximum = fixed(42949672.95),
            .get = get_timer<&PulseTimer::duration_ns>,
            .set = set_timer<&PulseTimer::duration_ns>},
    Feature{.name = "TimerReset",
            .type = FeatureType::command,
            .address = 0xA78C,
            .selectors = {"TimerSelector"},
            .stride = 32,
            .run =
                [](DeviceContext& d, std::uint32_t i) {
                    d.control.reset_timer(i);
                    return Status::success;
                }},
    Feature{.name = "TimerValue",
            .type = FeatureType::floating,
            .access = Access::read_only,
            .address = 0xA790,
            .selectors = {"TimerSelector"},
            .stride = 32,
            .unit = "us",
            .scale = 100,
            .get = get_timer_value},
    Feature{.name = "TimerStatus",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .address = 0xA794,
            .selectors = {"TimerSelector"},
            .stride = 32,
            .entries = timer_status_entries,
            .get = get_timer_status},
};

} // namespace

FeatureCategory counter_and_timer_control() {
    return {.name = "CounterAndTimerControl", .features = counter_and_timer_features};
}

} // namespace obscura::transports::gige
