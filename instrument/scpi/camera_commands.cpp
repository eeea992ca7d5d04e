// SPDX-License-Identifier: Apache-2.0
// Commands of a camera: features by their SFNC names, short ones, acquisition, trigger, counters.
#include "core/camera/setting_table.hpp"
#include "core/text/suggestion.hpp"
#include "instrument/scpi/commands.hpp"
#include "instrument/scpi/errors.hpp"
#include "instrument/scpi/parameters.hpp"
#include "instrument/scpi/text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::instrument {
namespace {

constexpr double us_per_s = 1e6;

Feature feature_named(const ScpiCall& call, std::string_view name) {
    std::vector<Feature> all = call.context.link.features(call.camera);
    const auto found = std::find_if(all.begin(), all.end(), [&](const Feature& f) { return f.name == name; });
    if (found == all.end()) {
        std::vector<std::string_view> names;
        for (const Feature& feature : all)
            names.push_back(feature.name);
        const auto closest = closest_word(name, names);
        throw ScpiError(ScpiCode::illegal_parameter_value,
                        closest ? fmt::format("no feature {}, did you mean {}?", name, *closest)
                                : fmt::format("no feature {}: FEATure:CATalog? names them", name));
    }
    return std::move(*found);
}

void set_feature(const ScpiCall& call, const Feature& feature, const Parameter& parameter,
                 PlainNumbers numbers) {
    const FeatureValue value = value_for(feature, parameter, numbers);
    call.context.link.set(call.camera, feature.name, value);
}

std::string set_short(const ScpiCall& call) {
    set_feature(call, feature_named(call, call.command.feature), call.parameters[0], PlainNumbers::base_unit);
    return {};
}

std::string query_short(const ScpiCall& call) {
    const Feature feature = feature_named(call, call.command.feature);
    return response_of(feature,
                       call.parameters.empty() ? feature.value : limit_of(feature, call.parameters[0]),
                       PlainNumbers::base_unit);
}

std::string set_named(const ScpiCall& call) {
    set_feature(call, feature_named(call, string_of(call.parameters[0])), call.parameters[1],
                PlainNumbers::feature_unit);
    return {};
}

std::string query_named(const ScpiCall& call) {
    const Feature feature = feature_named(call, string_of(call.parameters[0]));
    return response_of(feature,
                       call.parameters.size() == 1 ? feature.value : limit_of(feature, call.parameters[1]),
                       PlainNumbers::feature_unit);
}

std::string catalogue(const ScpiCall& call) {
    std::vector<std::string> names;
    for (const Feature& feature : call.context.link.features(call.camera))
        names.push_back(string_data(feature.name));
    return fmt::format("{}", fmt::join(names, ","));
}

CameraState state_of(const ScpiCall& call) {
    DaemonState state = call.context.link.state();
    if (call.camera >= state.cameras.size())
        throw ScpiError(ScpiCode::header_suffix_out_of_range,
                        fmt::format("cameras 1 to {}", state.cameras.size()));
    return std::move(state.cameras[call.camera]);
}

std::string trigger(const ScpiCall& call) {
    if (!settle_trigger(call.context, 0))
        throw ScpiError(ScpiCode::trigger_ignored, "the trigger before has no outcome yet");
    try {
        call.context.last_trigger.reset();
        call.context.link.begin_trigger(call.camera);
    } catch (const LinkError& error) {
        throw ScpiError(error.code == "connection-lost" ? ScpiCode::hardware_missing
                                                        : ScpiCode::trigger_ignored,
                        error.what());
    }
    return {};
}

std::string trigger_result(const ScpiCall& call) {
    wait_for_trigger(call.context);
    const std::optional<TriggerResult>& last = call.context.last_trigger;
    if (!last) throw ScpiError(ScpiCode::data_stale, "no trigger of this connection has an outcome");
    return fmt::format("{},{},{},{},{}", last->frame, last->outcome, last->late_rows, last->edge_tai_ns,
                       number_text(last->seconds));
}

std::string acquire(const ScpiCall& call, bool on) {
    if (on)
        call.context.link.start(call.camera);
    else
        call.context.link.stop(call.camera);
    return {};
}

std::string counters(const ScpiCall& call) {
    const CameraState state = state_of(call);
    if (call.parameters.empty()) {
        std::vector<std::int64_t> all;
        for (const auto& [name, count] : state.counters)
            all.push_back(count);
        return fmt::format("{}", fmt::join(all, ","));
    }
    const std::string& wanted = string_of(call.parameters[0]);
    std::vector<std::string_view> names;
    for (const auto& [name, count] : state.counters) {
        if (name == wanted) return fmt::format("{}", count);
        names.push_back(name);
    }
    throw ScpiError(
        ScpiCode::illegal_parameter_value,
        fmt::format("no such counter{}: COUNters:CATalog? names them", did_you_mean(wanted, names)));
}

std::string counter_names(const ScpiCall& call) {
    std::vector<std::string> names;
    for (const auto& [name, count] : state_of(call).counters)
        names.push_back(string_data(name));
    return fmt::format("{}", fmt::join(names, ","));
}

std::string latency(const ScpiCall& call) {
    const std::string& wanted = string_of(call.parameters[0]);
    const CameraState state = state_of(call);
    std::vector<std::string_view> names;
    for (const Latency& one : state.latencies) {
        if (one.name == wanted)
            return fmt::format("{},{},{},{}", number_text(one.count), number_text(one.p50 / us_per_s),
                               number_text(one.p99 / us_per_s), number_text(one.max / us_per_s));
        names.push_back(one.name);
    }
    throw ScpiError(ScpiCode::illegal_parameter_value,
                    fmt::format("no such latency, {}", allowed_words(wanted, names)));
}

std::string latency_names(const ScpiCall& call) {
    std::vector<std::string> names;
    for (const Latency& one : state_of(call).latencies)
        names.push_back(string_data(one.name));
    return fmt::format("{}", fmt::join(names, ","));
}

/// What the setting may be, in SI units: "<0 to 24 dB>", "<Off, Once or Continuous>".
std::string parameters_of(const Setting& setting) {
    if (setting.member.type == SettingType::boolean) return "<ON or OFF>";
    if (const std::optional<SettingRange> range = widest_range(setting)) {
        const BaseUnit base = base_unit_of(setting.unit);
        return fmt::format("<{} to {}{}{}>", number_text(range->minimum / base.per_unit),
                           number_text(range->maximum / base.per_unit), base.name.empty() ? "" : " ",
                           base.name);
    }
    std::string words;
    for (const SettingWord& word : setting.member.words) {
        const bool last = &word == &setting.member.words.back();
        words += fmt::format("{}{}", words.empty() ? "" : last ? " or " : ", ", word.name);
    }
    return fmt::format("<{}>", words);
}

/// A row that sets and asks for one camera setting by a header of SCPI, numbers in SI units.
Command setting_command(std::string_view header, const Setting& setting) {
    Command row{.header = header,
                .parameters = parameters_of(setting),
                .help = help_with_lock(setting),
                .set = set_short,
                .query = query_short,
                .changes_camera = true,
                .least = 1,
                .most = 1,
                .feature = setting.name};
    if (setting.range_of({})) {
        row.query_most = 1;
        row.query_parameters = "[MINimum or MAXimum]";
    }
    return row;
}

/// A query with the name of a feature.
Command about_feature(std::string_view header, std::string_view help, ScpiHandler query) {
    return {.header = header,
            .help = help,
            .query = query,
            .query_least = 1,
            .query_most = 1,
            .query_parameters = "\"<name>\""};
}

std::vector<Command> feature_commands() {
    return {
        {.header = "[CAMera#:]FEATure",
         .parameters = "\"<name>\",<value>",
         .help = "Setting by its SFNC name, in the unit of the feature; numbers may have a suffix (5 MS)",
         .set = set_named,
         .query = query_named,
         .changes_camera = true,
         .least = 2,
         .most = 2,
         .query_least = 1,
         .query_most = 2,
         .query_parameters = "\"<name>\"[,MINimum or MAXimum]"},
        {.header = "[CAMera#:]FEATure:CATalog", .help = "Names of all features", .query = catalogue},
        about_feature("[CAMera#:]FEATure:LIMits", "What the feature may be, as text",
                      [](const ScpiCall& call) {
                          return string_data(feature_named(call, string_of(call.parameters[0])).allowed);
                      }),
        about_feature("[CAMera#:]FEATure:UNIT", "Unit of the feature",
                      [](const ScpiCall& call) {
                          return string_data(feature_named(call, string_of(call.parameters[0])).unit);
                      }),
        setting_command("[CAMera#:]EXPosure[:TIME]", setting("ExposureTime")),
        setting_command("[CAMera#:]EXPosure:MODE", setting("ExposureMode")),
        setting_command("[CAMera#:]EXPosure:AUTO", setting("ExposureAuto")),
        setting_command("[CAMera#:]GAIN", setting("Gain")),
        setting_command("[CAMera#:]BLACk[:LEVel]", setting("BlackLevel")),
        setting_command("[CAMera#:]FRAMe:RATE", setting("AcquisitionFrameRate")),
        setting_command("[CAMera#:]FRAMe:RATE:ENABle", setting("AcquisitionFrameRateEnable")),
        setting_command("[CAMera#:]IMAGe:WIDTh", setting("Width")),
        setting_command("[CAMera#:]IMAGe:HEIGht", setting("Height")),
        setting_command("[CAMera#:]IMAGe:PATTern", setting("TestPattern")),
        setting_command("[CAMera#:]TRIGger[:SEQuence]:MODE", setting("TriggerMode")),
        setting_command("[CAMera#:]TRIGger[:SEQuence]:SOURce", setting("TriggerSource")),
        setting_command("[CAMera#:]TRIGger[:SEQuence]:ACTivation", setting("TriggerActivation")),
        setting_command("[CAMera#:]TRIGger[:SEQuence]:DELay", setting("TriggerDelay")),
    };
}

} // namespace

std::vector<Command> camera_commands() {
    std::vector<Command> rows{
        {.header = "*TRG",
         .help = "Triggers a frame of camera 1, without waiting for its outcome",
         .set = trigger,
         .changes_camera = true},
        {.header = "[CAMera#:]TRIGger[:SEQuence][:IMMediate]",
         .help = "Triggers a frame, without waiting for its outcome",
         .set = trigger,
         .changes_camera = true},
        {.header = "[CAMera#:]TRIGger[:SEQuence]:RESult",
         .help =
             "Outcome of this connection's last trigger, waited for: frame, outcome, late rows, edge as TAI in ns since 1970, seconds until the last row had left",
         .query = trigger_result},
        {.header = "[CAMera#:]INITiate[:IMMediate]",
         .help = "Starts the acquisition",
         .set = [](const ScpiCall& call) { return acquire(call, true); },
         .changes_camera = true},
        {.header = "[CAMera#:]ABORt",
         .help = "Stops the acquisition; the frame in progress is finished",
         .set = [](const ScpiCall& call) { return acquire(call, false); },
         .changes_camera = true},
        {.header = "[CAMera#:]ACQuisition[:STATe]",
         .help = "Whether the camera acquires",
         .query = [](const ScpiCall& call) { return std::string(state_of(call).acquiring ? "1" : "0"); }},
        {.header = "[CAMera#:]FRAMe[:NUMBer]",
         .help = "Number of the last frame",
         .query = [](const ScpiCall& call) { return fmt::format("{}", state_of(call).frame_id); }},
        {.header = "[CAMera#:]CONTroller",
         .help = "Address of the GigE Vision client that controls the camera; \"\": none",
         .query = [](const ScpiCall& call) { return string_data(state_of(call).controller); }},
        {.header = "[CAMera#:]HEALth",
         .help = "good, idle or bad: the verdict on the last minute",
         .query = [](const ScpiCall& call) { return state_of(call).health; }},
        {.header = "[CAMera#:]VERDict",
         .help = "The verdict on the last minute, as text",
         .query = [](const ScpiCall& call) { return string_data(state_of(call).verdict); }},
        {.header = "[CAMera#:]CLOCk:STATe",
         .help = "free, locked, holdover or lockstep",
         .query = [](const ScpiCall& call) { return state_of(call).clock; }},
        {.header = "[CAMera#:]COUNters",
         .help = "A counter since the start, or all in the order of the catalogue",
         .query = counters,
         .query_most = 1,
         .query_parameters = "[\"<name>\"]"},
        {.header = "[CAMera#:]COUNters:CATalog", .help = "Names of the counters", .query = counter_names},
        {.header = "[CAMera#:]LATency",
         .help = "Number of frames, and p50, p99 and maximum in s",
         .query = latency,
         .query_least = 1,
         .query_most = 1,
         .query_parameters = "\"<name>\""},
        {.header = "[CAMera#:]LATency:CATalog", .help = "Names of the latencies", .query = latency_names},
    };
    for (Command& row : feature_commands())
        rows.push_back(std::move(row));
    return rows;
}

} // namespace obscura::instrument
