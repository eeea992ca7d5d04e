// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/telemetry.hpp"

#include "core/camera/camera_counters.hpp"
#include "core/camera/frame.hpp"
#include "instrument/packets/space_packet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

namespace obscura::instrument {
namespace {

using T = FieldType;

constexpr std::array<FieldState, 2> no_yes{{{0, "NO"}, {1, "YES"}}};
constexpr std::array<FieldState, 4> healths{{{0, "GOOD"}, {1, "IDLE"}, {2, "BAD"}, {3, "UNKNOWN"}}};
constexpr std::array<FieldState, 5> clocks{
    {{0, "FREE"}, {1, "LOCKED"}, {2, "HOLDOVER"}, {3, "LOCKSTEP"}, {4, "UNKNOWN"}}};
constexpr std::array<FieldState, 5> outcomes{
    {{0, "COMPLETE"}, {1, "LATE"}, {2, "REPEATED"}, {3, "PARTIAL"}, {4, "DROPPED"}}};

/// The value that is called so, in any case; else the last one.
std::uint64_t state_named(std::span<const FieldState> states, std::string_view name) {
    for (const FieldState& state : states)
        if (state.name.size() == name.size() &&
            std::equal(name.begin(), name.end(), state.name.begin(),
                       [](char a, char b) { return (a >= 'a' && a <= 'z' ? a - 'a' + 'A' : a) == b; }))
            return state.value;
    return states.back().value;
}

/// Instants are 0 if there was none.
double us_between(std::int64_t to_ns, std::int64_t from_ns) {
    if (to_ns == 0 || from_ns == 0) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(to_ns - from_ns) * 1e-3;
}

/// Counts beyond 32 bits become the largest one.
FieldValue u32(std::int64_t count) {
    return static_cast<std::uint64_t>(std::clamp<std::int64_t>(count, 0, UINT32_MAX));
}

/// The first row of the list whose bit is set tells the outcome.
std::uint64_t outcome_of(std::int64_t flags) {
    if ((flags & frame_dropped) != 0) return 4;
    if ((flags & frame_repeated) != 0) return 2;
    if ((flags & frame_partial) != 0) return 3;
    return (flags & frame_late) != 0 ? 1 : 0;
}

const CameraState& camera_state(const Housekeeping& source) {
    static const CameraState none;
    return source.state ? *source.state : none;
}

std::uint64_t counter(const Housekeeping& source, std::string_view name) {
    for (const auto& [own, count] : camera_state(source).counters)
        if (own == name && count > 0) return static_cast<std::uint64_t>(count);
    return 0;
}

double latency_field(const Housekeeping& source, std::string_view name, double Latency::*quantile) {
    for (const Latency& one : camera_state(source).latencies)
        if (one.name == name) return one.*quantile;
    return 0;
}

/// A field and where its value comes from.
template<typename Source>
struct Row {
    FieldInfo info;
    FieldValue (*value)(const Source& source) = nullptr; ///< null: `counter`
    std::string_view counter{};                          ///< its name in the state
};

template<typename Source>
FieldValue field_value(const Row<Source>& row, const Source& source) {
    return row.value(source);
}
FieldValue field_value(const Row<Housekeeping>& row, const Housekeeping& source) {
    return row.value != nullptr ? row.value(source) : counter(source, row.counter);
}

using H = Housekeeping;
const std::array<Row<H>, 8> state_rows{{
    {{"CAMERA", T::u8, "", "Number of the camera, from 0"},
     [](const H& h) -> FieldValue { return std::uint64_t{h.camera}; }},
    {{"DAEMON_ANSWERS", T::u8, "", "Whether the daemon answers; if not, what it tells is 0", no_yes},
     [](const H& h) -> FieldValue { return std::uint64_t{h.state.has_value()}; }},
    {{"HEALTH", T::u8, "", "Verdict on the last minute", healths},
     [](const H& h) -> FieldValue { return state_named(healths, camera_state(h).health); }},
    {{"ACQUIRING", T::u8, "", "Whether the camera acquires", no_yes},
     [](const H& h) -> FieldValue { return std::uint64_t{camera_state(h).acquiring}; }},
    {{"TRIGGER_READY", T::u8, "", "Whether it takes a trigger now", no_yes},
     [](const H& h) -> FieldValue { return std::uint64_t{camera_state(h).trigger_ready}; }},
    {{"CONTROLLED", T::u8, "", "Whether a GigE Vision client controls it", no_yes},
     [](const H& h) -> FieldValue { return std::uint64_t{!camera_state(h).controller.empty()}; }},
    {{"CLOCK", T::u8, "", "Clock of the trigger", clocks},
     [](const H& h) -> FieldValue { return state_named(clocks, camera_state(h).clock); }},
    {{"LAST_FRAME", T::u64, "", "Number of the last frame in its acquisition"},
     [](const H& h) -> FieldValue { return camera_state(h).frame_id; }},
}};
/// Behind those and the counters of the camera.
const std::array<Row<H>, 11> program_rows{{
    {{"FIRST_ROW_P50", T::f32, "us", "Trigger to first row, median"},
     [](const H& h) -> FieldValue { return latency_field(h, "trigger_to_first_row", &Latency::p50); }},
    {{"FIRST_ROW_P99", T::f32, "us", "Trigger to first row, 99 %"},
     [](const H& h) -> FieldValue { return latency_field(h, "trigger_to_first_row", &Latency::p99); }},
    {{"LAST_ROW_P99", T::f32, "us", "Trigger to last row, 99 %"},
     [](const H& h) -> FieldValue { return latency_field(h, "trigger_to_last_row", &Latency::p99); }},
    {{"LATENESS_P50", T::f32, "us", "Lateness of rows, median"},
     [](const H& h) -> FieldValue { return latency_field(h, "release_lateness", &Latency::p50); }},
    {{"LATENESS_P99", T::f32, "us", "Lateness of rows, 99 %"},
     [](const H& h) -> FieldValue { return latency_field(h, "release_lateness", &Latency::p99); }},
    {{"LATENESS_MAX", T::f32, "us", "Lateness of the latest row"},
     [](const H& h) -> FieldValue { return latency_field(h, "release_lateness", &Latency::max); }},
    {{"REPORTS", T::u32, "", "Frame reports that this program has sent, of all cameras"},
     [](const H& h) -> FieldValue { return std::uint64_t{h.own.reports}; }},
    {{"REPORTS_LOST", T::u32, "", "Frames for which it had none"},
     [](const H& h) -> FieldValue { return std::uint64_t{h.own.reports_lost}; }},
    {{"COMMANDS_DONE", T::u32, "", "Telecommands that were done"},
     [](const H& h) -> FieldValue { return std::uint64_t{h.own.commands_done}; }},
    {{"COMMANDS_REFUSED", T::u32, "", "Telecommands that were not"},
     [](const H& h) -> FieldValue { return std::uint64_t{h.own.commands_refused}; }},
    {{"COMMAND_GAPS", T::u32, "", "Telecommands whose sequence count was not that of the one before and one"},
     [](const H& h) -> FieldValue { return std::uint64_t{h.own.command_gaps}; }},
}};

/// The counters of the camera that are sent, in their order in the packet.
std::vector<Row<H>> counter_rows() {
    std::vector<Row<H>> rows;
    for (const Metric& metric : camera_metrics) {
        if (metric.telemetry.empty()) continue;
        const auto place = static_cast<std::size_t>(metric.telemetry_place);
        if (rows.size() <= place) rows.resize(place + 1);
        rows[place].info = {metric.telemetry, T::u64, "", metric.telemetry_help};
        rows[place].counter = metric.name;
    }
    return rows;
}

const std::vector<Row<H>>& housekeeping_rows() {
    static const std::vector<Row<H>> all = [] {
        std::vector<Row<H>> rows(state_rows.begin(), state_rows.end());
        const std::vector<Row<H>> counters = counter_rows();
        rows.insert(rows.end(), counters.begin(), counters.end());
        rows.insert(rows.end(), program_rows.begin(), program_rows.end());
        return rows;
    }();
    return all;
}

using F = FrameReport;
const std::array<Row<F>, 18> frame_rows{{
    {{"CAMERA", T::u8, "", "Number of the camera, from 0"},
     [](const F& f) -> FieldValue { return std::uint64_t{f.camera}; }},
    {{"OUTCOME", T::u8, "", "What became of the frame", outcomes},
     [](const F& f) -> FieldValue { return outcome_of(f.frame.flags); }},
    {{"ACQUISITION", T::u32, "", "Number of the acquisition, from 1"},
     [](const F& f) -> FieldValue { return u32(f.frame.acquisition); }},
    {{"FRAME", T::u64, "", "Number of the frame in its acquisition, from 1"},
     [](const F& f) -> FieldValue { return f.frame.frame_id; }},
    {{"TRIGGER", T::u64, "", "Number of the trigger"},
     [](const F& f) -> FieldValue { return f.frame.trigger_id; }},
    {{"EDGE_SECONDS", T::u32, "s", "Edge of the trigger, TAI since 1958: time code CUC, seconds"},
     [](const F& f) -> FieldValue { return std::uint64_t{time_code(f.edge_tai_ns()).seconds}; }},
    {{"EDGE_FRACTION", T::u24, "", "and its fraction in 2^-24 s"},
     [](const F& f) -> FieldValue { return std::uint64_t{time_code(f.edge_tai_ns()).fraction}; }},
    {{"EDGE_TAI_NS", T::i64, "ns", "The same instant exactly, TAI since 1970"},
     [](const F& f) -> FieldValue { return f.edge_tai_ns(); }},
    {{"FIRST_ROW", T::f32, "us", "Edge to first row; NaN: it did not leave"},
     [](const F& f) -> FieldValue { return us_between(f.frame.first, f.frame.edge); }},
    {{"LAST_ROW", T::f32, "us", "Edge to last row; NaN: it did not leave"},
     [](const F& f) -> FieldValue { return us_between(f.frame.last, f.frame.edge); }},
    {{"FIRST_LATENESS", T::f32, "us", "How long after its time the first row left"},
     [](const F& f) -> FieldValue { return us_between(f.frame.first, f.frame.due); }},
    {{"LAST_LATENESS", T::f32, "us", "How long after its time the last row left"},
     [](const F& f) -> FieldValue { return us_between(f.frame.last, f.frame.last_due); }},
    {{"ROWS", T::u32, "", "Rows of the frame"}, [](const F& f) -> FieldValue { return u32(f.frame.rows); }},
    {{"LATE_ROWS", T::u32, "", "Rows that were not ready in time"},
     [](const F& f) -> FieldValue { return u32(f.frame.late_rows); }},
    {{"STALLED_ROWS", T::u32, "", "Rows that were ready and left more than a millisecond late"},
     [](const F& f) -> FieldValue { return u32(f.frame.stalled_rows); }},
    {{"FLAGS", T::u32, "", "Flags of the frame, see docs/images.md"},
     [](const F& f) -> FieldValue { return u32(f.frame.flags); }},
    {{"LOST_BEFORE", T::u32, "", "Frames between the report before and this one that have none"},
     [](const F& f) -> FieldValue { return f.lost_before; }},
    {{"SATURATED", T::u32, "", "Pixels at the largest digital number; 4294967295: they were not counted"},
     [](const F& f) -> FieldValue { return std::uint64_t{f.saturated.value_or(UINT32_MAX)}; }},
}};

using C = CommandReport;
const std::array<Row<C>, 5> command_rows{{
    {{"COMMAND_SEQUENCE", T::u16, "", "Sequence count of the telecommand"},
     [](const C& c) -> FieldValue { return std::uint64_t{c.sequence}; }},
    {{"FUNCTION", T::u8, "", "Its function"},
     [](const C& c) -> FieldValue { return std::uint64_t{c.function}; }},
    {{"CAMERA", T::u8, "", "Its camera"}, [](const C& c) -> FieldValue { return std::uint64_t{c.camera}; }},
    {{"RESULT", T::u8, "", "What became of it", command_results()},
     [](const C& c) -> FieldValue { return static_cast<std::uint64_t>(c.result); }},
    {{"FRAME", T::u64, "", "Number of the frame that a trigger made; 0: none"},
     [](const C& c) -> FieldValue { return c.frame; }},
}};

constexpr std::array<FieldInfo, 3> header_of_telemetry{
    {{"TIME_CODE", T::u8, "", "P-field of the time code: 31, CUC since 1958 with 4 and 3 octets"},
     {"TIME_SECONDS", T::u32, "s", "When the packet was made, TAI since 1958"},
     {"TIME_FRACTION", T::u24, "", "and its fraction in 2^-24 s"}}};

template<typename Rows>
std::vector<FieldInfo> infos_of(const Rows& rows) {
    std::vector<FieldInfo> infos;
    for (const auto& row : rows)
        infos.push_back(row.info);
    return infos;
}

/// The packet of `source`: its rows behind the secondary header.
template<typename Source, typename Rows>
std::vector<std::uint8_t> pack(const Rows& rows, const Source& source, std::uint16_t apid,
                               std::uint16_t& sequence, std::int64_t tai_ns) {
    const TimeCode time = time_code(tai_ns);
    ByteWriter out;
    out.number(time_code_field, bytes_of(header_of_telemetry[0].type));
    out.number(time.seconds, bytes_of(header_of_telemetry[1].type));
    out.number(time.fraction, bytes_of(header_of_telemetry[2].type));
    for (const auto& row : rows)
        out.number(encode(row.info.type, field_value(row, source)), bytes_of(row.info.type));
    const PacketHeader primary{false, true, apid, sequence};
    sequence = static_cast<std::uint16_t>((sequence + 1U) % sequence_modulus);
    return make_packet(primary, out.bytes());
}

} // namespace

std::span<const FieldInfo> telemetry_header() {
    return header_of_telemetry;
}

const std::vector<PacketInfo>& telemetry_packets() {
    static const std::vector<PacketInfo> packets{
        {"HOUSEKEEPING", "State of a camera, once a second", 0, infos_of(housekeeping_rows())},
        {"FRAME", "A frame that has ended", 1, infos_of(frame_rows)},
        {"COMMAND", "What became of a telecommand", 2, infos_of(command_rows)},
    };
    return packets;
}

std::vector<std::uint8_t> TelemetryWriter::write(const Housekeeping& source, std::int64_t tai_ns) {
    return pack(housekeeping_rows(), source, first_apid_, sequence_[0], tai_ns);
}

std::vector<std::uint8_t> TelemetryWriter::write(const FrameReport& source, std::int64_t tai_ns) {
    return pack(frame_rows, source, static_cast<std::uint16_t>(first_apid_ + 1), sequence_[1], tai_ns);
}

std::vector<std::uint8_t> TelemetryWriter::write(const CommandReport& source, std::int64_t tai_ns) {
    return pack(command_rows, source, static_cast<std::uint16_t>(first_apid_ + 2), sequence_[2], tai_ns);
}

} // namespace obscura::instrument
