// SPDX-License-Identifier: Apache-2.0
// AcquisitionControl: acquisition, frame rate, triggers, exposure.
#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/stream_channel.hpp"

#include <algorithm>
#include <array>

namespace obscura::transports::gige {
namespace {

std::uint64_t get_resulting_frame_rate(const Feature& f, DeviceContext& d, std::uint32_t) {
    constexpr double max_rate_hz = 2e6; // what 32 bits hold in mHz
    const std::int64_t period_ns = readout_answer(d).frame_period_ns;
    return period_ns > 0 ? to_word(f, std::min(1e9 / static_cast<double>(period_ns), max_rate_hz)) : 0U;
}

/// One bit for each item of AcquisitionStatusSelector.
std::uint64_t get_acquisition_status(const Feature&, DeviceContext& d, std::uint32_t) {
    const CameraActivity a = d.control.activity();
    const bool acquiring = d.control.acquiring();
    return (acquiring ? 1U : 0U) | (acquiring && a.start_awaited ? 2U : 0U) |
           (acquiring && a.trigger_ready ? 4U : 0U);
}

struct Trigger {
    TriggerChoice CameraSettings::*choice;
    bool (CameraControl::*software)(Time);
};
/// In the order of TriggerSelector.
constexpr std::array triggers{
    Trigger{&CameraSettings::frame_trigger, &CameraControl::software_trigger},
    Trigger{&CameraSettings::start_trigger, &CameraControl::software_start_trigger},
    Trigger{&CameraSettings::burst_trigger, &CameraControl::software_burst_trigger},
    Trigger{&CameraSettings::exposure_trigger, &CameraControl::software_exposure_trigger},
};

template<auto member>
std::uint64_t get_trigger(const Feature&, DeviceContext& d, std::uint32_t i) {
    return value(d.control.settings().*triggers[i].choice.*member);
}
template<auto member>
Status set_trigger(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    decode(f, word, wanted.*triggers[i].choice.*member);
    return apply_settings(d, wanted);
}
Status run_trigger_software(DeviceContext& d, std::uint32_t i) {
    // The camera counts a trigger that comes too early or is not awaited; the command succeeds.
    (d.control.*triggers[i].software)(d.clock.now());
    return Status::success;
}

/// Two bits per input: whether rising edges are reported, whether falling ones are.
std::uint64_t get_line_edges(const Feature&, DeviceContext& d, std::uint32_t) {
    std::uint32_t edges = 0;
    for (std::size_t i = 0; i < line_count; ++i)
        edges |= ((d.limits.lines[i].rising ? 1U : 0U) | (d.limits.lines[i].falling ? 2U : 0U)) << (2 * i);
    return edges;
}

// Words of ExposureMode: SFNC's Off, which this camera does not have, is 0.
constexpr std::uint32_t exposure_mode_base = 1;
std::uint64_t get_exposure_mode(const Feature&, DeviceContext& d, std::uint32_t) {
    return value(d.control.settings().exposure_mode) + exposure_mode_base;
}
Status set_exposure_mode(const Feature& f, DeviceContext& d, std::uint32_t, std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    decode(f, word - exposure_mode_base, wanted.exposure_mode);
    return apply_settings(d, wanted);
}

Status set_exposure_time(const Feature& f, DeviceContext& d, std::uint32_t, std::uint32_t word) {
    CameraSettings wanted = d.control.settings();
    if (wanted.exposure_auto != ExposureAuto::off) return Status::write_protect;
    decode(f, word, wanted.exposure_ns);
    return d.control.apply(wanted) ? Status::success : Status::invalid_parameter;
}

/// Every line number of a real camera is bound to Line0.
constexpr std::array foreign_trigger_sources{
    entry("Line0", TriggerSource::line0),       entry("Line1", TriggerSource::line0),
    entry("Line2", TriggerSource::line0),       entry("Line3", TriggerSource::line0),
    entry("Line4", TriggerSource::line0),       entry("Line5", TriggerSource::line0),
    entry("Software", TriggerSource::software), entry("Action1", TriggerSource::action1),
};

constexpr auto acquisition_mode_entries = entries_of<AcquisitionMode>();

constexpr std::array acquisition_status_selector_entries{
    entry("AcquisitionTriggerWait", 1),
    entry("AcquisitionActive", 0),
    entry("FrameTriggerWait", 2),
};

constexpr std::array trigger_selector_entries{
    entry("FrameStart", 0),
    entry("AcquisitionStart", 1),
    entry("FrameBurstStart", 2),
    entry("ExposureStart", 3),
};

constexpr std::array trigger_source_entries{
    entry(TriggerSource::software),     entry(TriggerSource::line0),      entry(TriggerSource::line1),
    entry(TriggerSource::line2),        entry(TriggerSource::line3),      entry(TriggerSource::counter0_end),
    entry(TriggerSource::counter1_end), entry(TriggerSource::timer0_end), entry(TriggerSource::timer1_end),
    entry(TriggerSource::action1),
};

constexpr std::array trigger_activation_entries{
    entry(TriggerActivation::rising_edge, "LineRises"),
    entry(TriggerActivation::falling_edge, "LineFalls"),
    entry(TriggerActivation::any_edge, "LineRisesAndFalls"),
    entry(TriggerActivation::level_high, "LineHasLevels"),
    entry(TriggerActivation::level_low, "LineHasLevels"),
};

constexpr auto trigger_overlap_entries = entries_of<TriggerOverlap>();

constexpr std::array exposure_mode_entries{
    entry(ExposureMode::timed, {}, exposure_mode_base),
    entry(ExposureMode::trigger_width, "AnyLineRisesAndFalls", exposure_mode_base),
};

constexpr auto exposure_auto_entries = entries_of<ExposureAuto>();

constexpr std::array acquisition_features{
    of_setting({.name = "AcquisitionMode",
                .address = 0xA100,
                .entries = acquisition_mode_entries,
                .foreign = {.bound = true}}),
    Feature{.name = "AcquisitionStart",
            .type = FeatureType::command,
            .address = 0xA104,
            .run = [](DeviceContext& d, std::uint32_t) { return acquisition_start(d); },
            .foreign = {.bound = true}},
    Feature{.name = "AcquisitionStop",
            .type = FeatureType::command,
            .address = 0xA108,
            .run = [](DeviceContext& d, std::uint32_t) { return acquisition_stop(d); },
            .foreign = {.bound = true}},
    Feature{.name = "AcquisitionAbort",
            .type = FeatureType::command,
            .visibility = Visibility::expert,
            .address = 0xA10C,
            .run = [](DeviceContext& d, std::uint32_t) { return acquisition_stop(d); },
            .foreign = {.bound = true}},
    of_setting({.name = "AcquisitionFrameCount", .address = 0xA110, .foreign = {.bound = true}}),
    of_setting({.name = "AcquisitionBurstFrameCount", .address = 0xA130, .foreign = {.bound = true}}),
    of_setting({.name = "AcquisitionFrameRate",
                .address = 0xA114,
                .scale = 1000,
                .minimum = in_register(0xA118),
                .maximum = in_register(0xA11C),
                .foreign = {.bound = true, .other_names = {"AcquisitionFrameRateAbs"}}}),
    of_setting({.name = "AcquisitionFrameRateEnable", .address = 0xA124, .foreign = {.bound = true}}),
    Feature{.name = "ResultingFrameRate",
            .type = FeatureType::floating,
            .custom = true,
            .tooltip = "Highest rate of the sensor with these windows and exposures",
            .access = Access::read_only,
            .address = 0xA128,
            .unit = "Hz",
            .scale = 1000,
            .get = get_resulting_frame_rate,
            .foreign = {.bound = true, .other_names = {"ResultingFrameRateAbs"}}},
    Feature{.name = "SensorReadoutTime",
            .type = FeatureType::floating,
            .custom = true,
            .tooltip = "First to last row of all windows",
            .access = Access::read_only,
            .address = 0xA12C,
            .unit = "us",
            .scale = 100,
            .get = [](const Feature& f, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return duration_to_word(f, readout_answer(d).readout_ns);
            },
            .foreign = {.bound = true}},
    Feature{.name = "AcquisitionStatusSelector",
            .type = FeatureType::enumeration,
            .visibility = Visibility::expert,
            .entries = acquisition_status_selector_entries},
    Feature{.name = "AcquisitionStatus",
            .type = FeatureType::boolean,
            .visibility = Visibility::expert,
            .access = Access::read_only,
            .value_of = "AcquisitionStatusValue",
            .selectors = {"AcquisitionStatusSelector"}},
    Feature{.name = "TriggerSelector", .type = FeatureType::enumeration, .entries = trigger_selector_entries},
    of_setting({.name = "TriggerMode",
                .address = 0xAA00,
                .selectors = {"TriggerSelector"},
                .stride = 64,
                .entries = off_on,
                .lock = FeatureLock::streaming_but_first,
                .locked_by = "TriggerLocked",
                .get = get_trigger<&TriggerChoice::enabled>,
                .set = set_trigger<&TriggerChoice::enabled>,
                .foreign = {.bound = true}}),
    of_setting({.name = "TriggerSource",
                .address = 0xAA04,
                .selectors = {"TriggerSelector"},
                .stride = 64,
                .entries = trigger_source_entries,
                .lock = FeatureLock::streaming_but_first,
                .locked_by = "TriggerLocked",
                .get = get_trigger<&TriggerChoice::source>,
                .set = set_trigger<&TriggerChoice::source>,
                .foreign = {.bound = true, .entries = foreign_trigger_sources}}),
    of_setting({.name = "TriggerActivation",
                .address = 0xAA18,
                .selectors = {"TriggerSelector"},
                .stride = 64,
                .entries = trigger_activation_entries,
                .lock = FeatureLock::streaming_but_first,
                .locked_by = "TriggerLocked",
                .get = get_trigger<&TriggerChoice::activation>,
                .set = set_trigger<&TriggerChoice::activation>}),
    Feature{.name = "TriggerSoftware",
            .type = FeatureType::command,
            .address = 0xAA08,
            .selectors = {"TriggerSelector"},
            .stride = 64,
            .run = run_trigger_software,
            .foreign = {.bound = true}},
    of_setting({.name = "TriggerDelay",
                .address = 0xAA0C,
                .selectors = {"TriggerSelector"},
                .scale = 100,
                .available = "TriggerOfFrames",
                .foreign = {.bound = true, .other_names = {"TriggerDelayAbs"}}}),
    of_setting({.name = "TriggerDivider",
                .visibility = Visibility::expert,
                .address = 0xAA10,
                .selectors = {"TriggerSelector"},
                .available = "TriggerOfFrames",
                .foreign = {.bound = true}}),
    of_setting({.name = "TriggerOverlap",
                .visibility = Visibility::expert,
                .address = 0xAA14,
                .selectors = {"TriggerSelector"},
                .entries = trigger_overlap_entries,
                .available = "TriggerOfFrames",
                .foreign = {.bound = true}}),
    of_setting({.name = "ExposureMode",
                .address = 0xA18C,
                .entries = exposure_mode_entries,
                .get = get_exposure_mode,
                .set = set_exposure_mode}),
    of_setting({.name = "ExposureTime",
                .address = 0xA150,
                .scale = 1, // an hour of anything finer does not fit into a word
                .minimum = in_register(0xA154),
                .maximum = in_register(0xA158),
                .locked_by = "ExposureAuto",
                .set = set_exposure_time,
                .foreign = {.bound = true, .other_names = {"ExposureTimeAbs"}, .moves = true}}),
    of_setting({.name = "ExposureAuto",
                .address = 0xA15C,
                .entries = exposure_auto_entries,
                .foreign = {.bound = true, .moves = true}}),
    of_setting({.name = "ExposureAutoTarget",
                .custom = true,
                .visibility = Visibility::expert,
                .address = 0xA184,
                .scale = 1000}),
    of_setting({.name = "ExposureAutoPercentile",
                .custom = true,
                .visibility = Visibility::expert,
                .address = 0xA188,
                .scale = 1000}),
    Feature{.name = "AcquiringReg",
            .listed = false,
            .access = Access::read_only,
            .address = 0xA120,
            .get = get_acquisition_status},
    Feature{.name = "AcquisitionStatusValue",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(ALL>>N)&1",
            .variables = {{{"ALL", "AcquiringReg"}, {"N", "AcquisitionStatusSelector"}}}},
    Feature{.name = "TriggerOfFrames",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "N=0",
            .variables = {{{"N", "TriggerSelector"}}}},
    Feature{.name = "TriggerLocked",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(N>0)&&(L=1)",
            .variables = {{{"N", "TriggerSelector"}, {"L", "TLParamsLocked"}}}},
    Feature{.name = "LineEdgesReg",
            .listed = false,
            .access = Access::read_only,
            .address = 0xA14C,
            .cached = true,
            .get = get_line_edges},
    Feature{.name = "EdgesOfLine",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(S=1)?(E&3):(((S>=3)&&(S<=5))?((E>>(2*(S-2)))&3):0)",
            .variables = {{{"S", "TriggerSource"}, {"E", "LineEdgesReg"}}}},
    Feature{.name = "LineRises",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "E<>2",
            .variables = {{{"E", "EdgesOfLine"}}}},
    Feature{.name = "LineFalls",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "E<>1",
            .variables = {{{"E", "EdgesOfLine"}}}},
    Feature{.name = "LineRisesAndFalls",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(E=3)||(E=0)",
            .variables = {{{"E", "EdgesOfLine"}}}},
    Feature{.name = "LineHasLevels",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(E=1)&&(N<2)",
            .variables = {{{"E", "LineRisesAndFalls"}, {"N", "TriggerSelector"}}}},
    Feature{.name = "AnyLineRisesAndFalls",
            .type = FeatureType::formula,
            .listed = false,
            .formula = "(E&(E>>1)&0x55)<>0",
            .variables = {{{"E", "LineEdgesReg"}}}},
};

} // namespace

FeatureCategory acquisition_control() {
    return {.name = "AcquisitionControl", .features = acquisition_features};
}

} // namespace obscura::transports::gige
