// SPDX-License-Identifier: Apache-2.0
// DigitalIOControl. Line0 to Line3 are inputs; Line4 is an output that exists as a status only.
#include "core/camera/io_state.hpp"
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

enum class LineSource : std::uint32_t {
    off,
    exposure_active,
    frame_active,
    frame_trigger_wait,
    acquisition_active,
    timer0_active,
    timer1_active,
    counter0_active,
    counter1_active,
    user_output0,
};

constexpr std::uint32_t user_output0_bit = 1; ///< of UserOutputValueAll

bool output_level(const DeviceContext& d, const IoInputs& in) {
    const CameraSettings s = d.control.settings();
    switch (static_cast<LineSource>(stored(d, "LineSource"))) {
    case LineSource::off:
        break;
    case LineSource::exposure_active:
        return exposure_active(in);
    case LineSource::frame_active:
        return frame_active(in);
    case LineSource::frame_trigger_wait:
        return d.control.acquiring() && in.activity.trigger_ready;
    case LineSource::acquisition_active:
        return d.control.acquiring();
    case LineSource::timer0_active:
        return timer_level(s.timers[0], 0, in);
    case LineSource::timer1_active:
        return timer_level(s.timers[1], 1, in);
    case LineSource::counter0_active:
        return counter_status(s.counters[0], 0, in) == IoStatus::active;
    case LineSource::counter1_active:
        return counter_status(s.counters[1], 1, in) == IoStatus::active;
    case LineSource::user_output0:
        return (stored(d, "UserOutputValueAll") & user_output0_bit) != 0;
    }
    return false;
}

std::uint32_t line_status_all(const DeviceContext& d) {
    const IoInputs in = io_inputs(d.control, d.clock);
    std::uint32_t all = output_level(d, in) ? line_status_output : 0U;
    for (std::size_t i = 0; i < line_count; ++i)
        if (line_level(i, d.limits.lines[i], in)) all |= line_status_line0 << i;
    for (std::uint32_t i = 0; i <= line_count; ++i)
        if (stored(d, "LineInverter", i) != 0) all ^= line_status_line0 << i;
    return all;
}

Status set_user_outputs(const Feature& f, DeviceContext& d, std::uint32_t, std::uint32_t word) {
    if ((word & ~user_output0_bit) != 0) return Status::invalid_parameter;
    d.bank.poke(f.address, word);
    return Status::success;
}

constexpr std::array line_selector_entries{
    entry("Line0", 0), entry("Line1", 1), entry("Line2", 2), entry("Line3", 3), entry("Line4", 4),
};

constexpr std::array line_mode_entries{
    entry("Input", 0),
    entry("Output", 1),
};

constexpr std::array line_source_entries{
    entry("Off", LineSource::off),
    entry("ExposureActive", LineSource::exposure_active),
    entry("FrameActive", LineSource::frame_active),
    entry("FrameTriggerWait", LineSource::frame_trigger_wait),
    entry("AcquisitionActive", LineSource::acquisition_active),
    entry("Timer0Active", LineSource::timer0_active),
    entry("Timer1Active", LineSource::timer1_active),
    entry("Counter0Active", LineSource::counter0_active),
    entry("Counter1Active", LineSource::counter1_active),
    entry("UserOutput0", LineSource::user_output0),
};

constexpr std::array line_format_entries{
    entry("NoConnect", 0),
};

constexpr std::array user_output_selector_entries{
    entry("UserOutput0", 0),
};

constexpr std::array digital_io_features{
    Feature{.name = "LineSelector", .type = FeatureType::enumeration, .entries = line_selector_entries},
    Feature{.name = "LineMode",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .value_of = "LineIsOutput",
            .selectors = {"LineSelector"},
            .entries = line_mode_entries},
    Feature{.name = "LineInverter",
            .type = FeatureType::boolean,
            .address = 0xA620,
            .selectors = {"LineSelector"},
            .stride = 4},
    Feature{.name = "LineStatus",
            .type = FeatureType::boolean,
            .access = Access::read_only,
            .value_of = "LineStatusValue",
            .selectors = {"LineSelector"}},
    Feature{.name = "LineStatusAll",
            .tooltip =
                "An input whose source reports one edge type only shows the last edge as a pulse of 1 ms",
            .access = Access::read_only,
            .address = 0xA60C,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return line_status_all(d);
            },
            .foreign = {.bound = true}},
    Feature{.name = "LineSource",
            .type = FeatureType::enumeration,
            .address = 0xA608,
            .selectors = {"LineSelector"},
            .entries = line_source_entries,
            .available = "LineIsOutput",
            .reset = [](const DeviceContext&) { return value(LineSource::exposure_active); }},
    Feature{.name = "LineFormat",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .selectors = {"LineSelector"},
            .entries = line_format_entries},
    Feature{.name = "UserOutputSelector",
            .type = FeatureType::enumeration,
            .entries = user_output_selector_entries},
    Feature{.name = "UserOutputValue",
            .type = FeatureType::boolean,
            .value_of = "UserOutputValueAll",
            .selectors = {"UserOutputSelector"}},
    Feature{.name = "UserOutputValueAll",
            .visibility = Visibility::expert,
            .address = 0xA610,
            .set = set_user_outputs},
    Feature{.name = "LineIsOutput",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "N=4",
            .variables = {{{"N", "LineSelector"}}}},
    Feature{.name = "LineStatusValue",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(ALL>>LINE)&1",
            .variables = {{{"ALL", "LineStatusAll"}, {"LINE", "LineSelector"}}}},
};

} // namespace

FeatureCategory digital_io_control() {
    return {.name = "DigitalIOControl", .features = digital_io_features};
}

} // namespace obscura::transports::gige
