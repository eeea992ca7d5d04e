// SPDX-License-Identifier: Apache-2.0
#include "sync/settings.hpp"

#include "core/error.hpp"
#include "core/text/suggestion.hpp"
#include "sync/conditioner.hpp"
#include "sync/ptp_monitor.hpp"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace obscura::sync {
namespace {

constexpr std::array<std::string_view, line_count> line_tables{"trigger", "line1", "line2", "line3"};

std::int64_t rounded(double value, std::int64_t unit_ns) {
    return std::llround(value * static_cast<double>(unit_ns));
}

/// Allowed values of `source` for Line0, or for the further lines.
std::vector<std::string_view> source_names(bool line0) {
    std::vector<std::string_view> names;
    for (const SourceTraits* traits : source_traits())
        if (line0 || traits->group != SourceGroup::simulator) names.push_back(traits->name);
    names.push_back(no_source);
    return names;
}

// Help texts composed from the traits of the sources. They are static because keys do not copy them.

std::string described_sources(bool line0) {
    std::string text;
    for (const SourceTraits* traits : source_traits())
        if (line0 || traits->group != SourceGroup::simulator)
            text += fmt::format("{}: {}; ", traits->name, traits->help);
    return text;
}

std::string_view source_help(bool line0) {
    static const std::string first = fmt::format("Trigger source of Line0. {}{}: software triggers only",
                                                 described_sources(true), no_source);
    static const std::string further =
        fmt::format("Trigger source of this input line. {}{}: the line is not connected",
                    described_sources(false), no_source);
    return line0 ? first : further;
}

const std::string& sources_with_rate() {
    static const std::string names = [] {
        std::string text;
        for (const SourceTraits* traits : source_traits())
            if (traits->uses_rate) text += (text.empty() ? "" : ", ") + std::string(traits->name);
        return text;
    }();
    return names;
}

std::string_view rate_help() {
    static const std::string text =
        fmt::format("Rate of the edges ({}); other sources: nominal rate, in which scene_time counts",
                    sources_with_rate());
    return text;
}

std::string_view phase_help() {
    static const std::string text =
        fmt::format("Delay of all edges against the schedule ({})", sources_with_rate());
    return text;
}

std::string_view device_help() {
    static const std::string text = [] {
        std::string nodes;
        for (const SourceTraits* traits : source_traits())
            if (!traits->device.empty())
                nodes += fmt::format("{}{} ({})", nodes.empty() ? "" : ", ", traits->device, traits->name);
        return fmt::format("Device node of the source; empty: {}", nodes);
    }();
    return text;
}

config::Keys line_keys(TriggerLineSettings& line) {
    const bool line0 = line.number == 0;
    config::Keys keys{
        config::key("source", &line.source).choices(source_names(line0)).help(source_help(line0)),
        config::key("rate_hz", &line.rate_hz).unit("Hz").range(0.001, 10000).help(rate_help()),
        config::key("phase_ms", &line.phase_ms).unit("ms").range(0, 1e6).help(phase_help()),
    };
    bool has_device = false;
    for (const auto& kind : line.kinds.all()) {
        // Place `device` before the keys of the first source that opens a device.
        if (!std::exchange(has_device, has_device || !kind->traits().device.empty()) && has_device)
            keys.push_back(config::key("device", &line.device).help(device_help()));
        for (config::Key& key : kind->keys())
            keys.push_back(std::move(key));
    }
    keys.push_back(
        config::key("debounce_us", &line.debounce_us)
            .unit("us")
            .range(0, 1e6)
            .help("Debounce time: an edge earlier than this after the last accepted one is dropped"));
    keys.push_back(config::key("divider", &line.divider)
                       .range(1, 1000000)
                       .help("Trigger divider N: the first of every N edges is a trigger"));
    keys.push_back(config::key("delay_us", &line.delay_us)
                       .unit("us")
                       .range(0, 1e7)
                       .help("Trigger delay, from the edge to the start of the exposure"));
    if (line0) // a reload may replace the source of Line0
        for (config::Key& key : keys)
            key = std::move(key).reloadable();
    return keys;
}

void check_line(const TriggerLineSettings& line, const Refuse& refuse) {
    if (const double hz = line.rate_hz / line.divider; hz < lowest_rate_hz)
        refuse("divider", fmt::format("{} leaves {} Hz, allowed are 1e-6 Hz and more", line.divider, hz));
    if (const SourceKind* kind = line.kind()) kind->check(line, refuse);
}

auto line_check(const TriggerLineSettings& line) {
    return [&line](const config::ReadTable& table) {
        check_line(line, [&table](std::string_view key, std::string_view what) { table.refuse(key, what); });
    };
}

} // namespace

std::string TriggerLineSettings::table() const {
    return number == 0 ? std::string(line_tables[0])
                       : fmt::format("{}.{}", line_tables[0], line_tables.at(number));
}

std::string TriggerLineSettings::device_node() const {
    const SourceKind* chosen = kind();
    return device.empty() && chosen != nullptr ? std::string(chosen->traits().device) : device;
}

std::int64_t TriggerLineSettings::phase_ns() const {
    return rounded(phase_ms, ns_per_ms);
}

std::int64_t TriggerLineSettings::debounce_ns() const {
    return rounded(debounce_us, ns_per_us);
}

std::int64_t TriggerLineSettings::delay_ns() const {
    return rounded(delay_us, ns_per_us);
}

TriggerSettings::TriggerSettings() {
    for (std::size_t number = 0; number < lines.size(); ++number)
        lines[number].number = number;
    lines[0].source = "timer";
}

config::Section section_of(TriggerLineSettings& line) {
    config::Section section{
        .name = line_tables.at(line.number),
        .help =
            "Trigger source connected to a further input line of the camera, for TriggerSource, counters and timers."};
    section.keys = line_keys(line);
    section.check = line_check(line);
    section.printed = line.connected();
    return section;
}

config::Section section_of(TriggerSettings& trigger) {
    config::Section section{
        .name = line_tables[0],
        .help = "Trigger source connected to Line0 of the camera, and the conditioning of its edges."};
    section.keys = line_keys(trigger.lines[0]);
    section.keys.push_back(
        config::key("over_trigger", &trigger.over_trigger)
            .help("Edge that comes before the camera is ready. count: missed; "
                  "ignore: masked, not counted as missed; "
                  "latch: the first one starts the next frame as soon as the camera is ready"));
    for (std::size_t number = 1; number < trigger.lines.size(); ++number)
        section.tables.push_back(section_of(trigger.lines[number]));
    section.check = line_check(trigger.lines[0]);
    return section;
}

config::Section section_of(PtpSettings& ptp) {
    config::Section section{.name = "ptp", .help = "Monitoring of ptp4l, the PTP daemon of this machine."};
    section.keys = {
        config::key("enabled", &ptp.enabled)
            .help(
                "Query ptp4l for the state of its clock: shown as Ptp* features, and time stamps are TAI once it is locked"),
        config::key("socket", &ptp.socket).help("Path of ptp4l's management socket (uds_address)"),
        config::key("domain", &ptp.domain).range(0, 127).help("PTP domain of ptp4l (domainNumber)"),
        config::key("lock_us", &ptp.lock_us)
            .unit("us")
            .range(0.001, 1e6)
            .help("Largest offset from the master at which the clock of a slave counts as locked"),
    };
    section.check = [&ptp](const config::ReadTable& table) {
        constexpr std::size_t longest = sizeof(sockaddr_un::sun_path) - 1;
        if (ptp.enabled && (!ptp.socket.starts_with('/') || ptp.socket.size() > longest))
            table.refuse("socket",
                         fmt::format("an absolute path of at most {} characters is wanted, as in {}", longest,
                                     PtpSettings{}.socket));
    };
    return section;
}

ConditionerSettings conditioner_settings(const TriggerLineSettings& line) {
    return {.debounce_ns = line.debounce_ns(),
            .divider = static_cast<std::uint32_t>(line.divider),
            .delay_ns = line.delay_ns()};
}

RationalRate nominal_rate(const TriggerLineSettings& line) {
    return rational_rate(line.rate_hz / line.divider);
}

LineEdges reported_edges(const TriggerLineSettings& line) {
    const SourceKind* kind = line.kind();
    return kind == nullptr ? LineEdges{} : kind->edges();
}

LineEdges reported_edges(const TriggerSettings& trigger, std::size_t number) {
    const TriggerLineSettings& line = trigger.lines.at(number);
    if (number == 0 && !line.connected()) return {.rising = true};
    return reported_edges(line);
}

std::unique_ptr<TriggerSource> make_source(const TriggerLineSettings& line, const Clock& clock,
                                           const ThreadSettings& thread) {
    if (!line.connected()) return nullptr;
    const Refuse refuse = [&line](std::string_view key, std::string_view what) {
        throw ConfigError(fmt::format("{}.{}: {}", line.table(), key, what));
    };
    const SourceKind* kind = line.kind();
    if (kind == nullptr)
        refuse("source", fmt::format("\"{}\" is not known, {}", line.source,
                                     allowed_words(line.source, source_names(line.number == 0))));
    check_line(line, refuse);
    return kind->make(line, clock, thread);
}

PtpMonitorSettings monitor_settings(const PtpSettings& ptp) {
    PtpMonitorSettings settings;
    settings.socket = ptp.socket;
    settings.domain = static_cast<std::uint8_t>(ptp.domain);
    settings.lock_ns = rounded(ptp.lock_us, ns_per_us);
    return settings;
}

} // namespace obscura::sync
