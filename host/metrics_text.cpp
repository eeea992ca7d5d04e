// SPDX-License-Identifier: Apache-2.0
#include "host/metrics_text.hpp"

#include "core/realtime/latency_histogram.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::host {
namespace {

using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;
using Labels = std::vector<std::pair<std::string_view, std::string>>;

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\' || c == '"') out += '\\';
        out += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    return out;
}

std::string labels_text(const Labels& labels) {
    std::string text;
    for (const auto& [name, value] : labels)
        text += fmt::format("{}{}=\"{}\"", text.empty() ? "" : ",", name, escaped(value));
    return text.empty() ? text : "{" + text + "}";
}

Labels with(Labels labels, std::string_view name, std::string value) {
    labels.emplace_back(name, std::move(value));
    return labels;
}

std::string text_at(const Json& json, const char* pointer) {
    const Pointer at(pointer);
    return json.contains(at) && json[at].is_string() ? json[at].get<std::string>() : std::string();
}

/// Families in the order of their first sample, each with all of its samples, as the format wants them.
class Exposition {
public:
    /// `type`: "counter", "gauge" or "histogram".
    void declare(std::string_view name, std::string_view type, std::string_view help) {
        for (const Family& family : families_)
            if (family.name == name) return;
        families_.push_back(
            {std::string(name),
             fmt::format("# HELP obscura_{0} {1}\n# TYPE obscura_{0} {2}\n", name, help, type),
             {}});
    }
    void add(std::string_view family, std::string_view suffix, const Labels& labels, const Json& value) {
        if (!value.is_number() && !value.is_boolean()) return;
        const std::string number = value.is_boolean()        ? value.get<bool>() ? "1" : "0"
                                   : value.is_number_float() ? fmt::format("{}", value.get<double>())
                                                             : value.dump();
        for (Family& one : families_)
            if (one.name == family)
                one.samples +=
                    fmt::format("obscura_{}{}{} {}\n", family, suffix, labels_text(labels), number);
    }
    [[nodiscard]] std::string text() const {
        std::string all;
        for (const Family& family : families_)
            if (!family.samples.empty()) all += family.head + family.samples;
        return all;
    }

private:
    struct Family {
        std::string name, head, samples;
    };
    std::vector<Family> families_;
};

/// One number of a camera. Rows of one family stand together; their help is that of the first.
struct CameraNumber {
    std::string_view family, type, help;
    std::string_view label, label_value; ///< empty: none
    const char* pointer;                 ///< in the camera's object
};

constexpr std::array camera_numbers{
    CameraNumber{"triggers_total", "counter", "Trigger edges while acquiring, by what became of them.",
                 "outcome", "frame", "/camera/frames"},
    CameraNumber{"triggers_total", "", "", "outcome", "missed", "/camera/missed_triggers"},
    CameraNumber{"triggers_total", "", "", "outcome", "masked", "/camera/masked_triggers"},
    CameraNumber{"triggers_total", "", "", "outcome", "dropped", "/camera/dropped"},
    CameraNumber{"triggers_seen_total", "counter",
                 "Trigger edges while acquiring, that in progress included.", "", "", "/camera/triggers"},
    CameraNumber{"triggers_ignored_total", "counter",
                 "Trigger edges while not acquiring, or from a source that is not selected.", "", "",
                 "/camera/ignored"},
    CameraNumber{"triggers_latched_total", "counter", "Trigger edges that waited for the camera.", "", "",
                 "/camera/latched_triggers"},
    CameraNumber{"triggers_refused_total", "counter", "Messages of the trigger source that were no triggers.",
                 "", "", "/trigger/refused"},
    CameraNumber{"frames_total", "counter", "Frames, by what became of them.", "outcome", "complete",
                 "/camera/complete"},
    CameraNumber{"frames_total", "", "", "outcome", "abandoned", "/camera/abandoned"},
    CameraNumber{"frames_unsent_total", "counter",
                 "Frames that no transport took: none had a receiver, or room. Viewers may have seen them.",
                 "", "", "/camera/unsent"},
    CameraNumber{"frames_late_total", "counter", "Complete frames with rows that were not ready in time.", "",
                 "", "/camera/late"},
    CameraNumber{"rows_late_total", "counter", "Rows that were not ready in time.", "", "",
                 "/camera/late_rows"},
    CameraNumber{"frames_stalled_total", "counter",
                 "Frames with rows that were ready in time and left more than a millisecond late.", "", "",
                 "/camera/stalled"},
    CameraNumber{"rows_stalled_total", "counter",
                 "Rows that were ready in time and left more than a millisecond late.", "", "",
                 "/camera/stalled_rows"},
    CameraNumber{"frames_repeated_total", "counter", "Late frames replaced by the one before.", "", "",
                 "/camera/repeated"},
    CameraNumber{"frames_partial_total", "counter", "Late frames ended early.", "", "", "/camera/partial"},
    CameraNumber{"frames_late_dropped_total", "counter", "Late frames that were not sent.", "", "",
                 "/camera/late_dropped"},
    CameraNumber{"frames_degraded_total", "counter", "Frames rendered below full quality to be in time.", "",
                 "", "/camera/quality/degraded"},
    CameraNumber{"frames_tiles_missing_total", "counter",
                 "Frames with coarser cells of terrain than asked for, because tiles were missing.", "", "",
                 "/camera/lod_deficit/frames"},
    CameraNumber{"acquiring", "gauge", "1 while the acquisition runs.", "", "", "/acquiring"},
    CameraNumber{"trigger_ready", "gauge", "1 while a trigger would be accepted.", "", "", "/trigger_ready"},
    CameraNumber{"frame_age_seconds", "gauge",
                 "Time since the last complete frame of this acquisition, to a tenth of a second; not where "
                 "frames come on request.",
                 "", "", "/last_frame/age_s"},
    CameraNumber{"frame_overdue_seconds", "gauge",
                 "Age from which the next frame is overdue: three times the longest gap of the last minute, "
                 "2 s at least.",
                 "", "", "/last_frame/overdue_s"},
    CameraNumber{"simulator_connections_total", "counter", "Connections to the simulator port.", "", "",
                 "/simulator/connections"},
    CameraNumber{"simulator_lines_total", "counter",
                 "Lines to the simulator port, by what they were; those refused with connections.", "kind",
                 "pose", "/simulator/poses"},
    CameraNumber{"simulator_lines_total", "", "", "kind", "step", "/simulator/steps"},
    CameraNumber{"simulator_lines_total", "", "", "kind", "refused", "/simulator/refused"},
    CameraNumber{"last_frame_id", "gauge", "Number of the last frame.", "", "", "/frame_id"},
};

constexpr std::array<std::pair<std::string_view, std::string_view>, 3> latencies{
    {{"trigger_to_first_row", "From the trigger edge to the release of the first row."},
     {"trigger_to_last_row", "From the trigger edge to the release of the last row."},
     {"release_lateness", "From the time of a row that was ready to its release."}}};
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> stages{
    {{"trigger_seen", "From the trigger edge until the camera has seen it."},
     {"render", "Of the renderer, from the first to the last row of a frame."},
     {"detector", "From the last rendered row until the detector has made the last one."}}};
constexpr std::array clock_states{"free", "locked", "holdover", "lockstep"};

/// Counters of the GigE transport that have families of their own. Rows of one family stand together.
constexpr std::array gige_numbers{
    CameraNumber{"gige_packets_total", "counter", "Stream packets; those sent include those sent again.",
                 "kind", "sent", "packets"},
    CameraNumber{"gige_packets_total", "", "", "kind", "resent", "resent_packets"},
    CameraNumber{"gige_packets_total", "", "", "kind", "withheld", "injected_losses"},
    CameraNumber{"gige_packets_total", "", "", "kind", "error", "send_errors"},
    CameraNumber{"gige_resend_requests_total", "counter", "Requests of clients for packets once more.", "",
                 "", "resend_requests"},
    CameraNumber{"gige_control_taken_total", "counter", "Times that a client took control of the camera.", "",
                 "", "control_taken"},
    CameraNumber{"gige_control_lost_total", "counter",
                 "Clients that lost control because they had been silent too long.", "", "", "control_lost"},
};

struct ThreadFigures {
    double cpu_s = 0;
    int priority = 0;
};

/// Threads of one name together: their time, and the highest priority.
std::map<std::string, ThreadFigures> by_name(const Json& threads) {
    std::map<std::string, ThreadFigures> all;
    for (const Json& thread : threads) {
        ThreadFigures& one = all[thread.value("name", "")];
        one.cpu_s += thread.value("cpu_s", 0.0);
        one.priority = std::max(one.priority, thread.value("priority", 0));
    }
    return all;
}

/// A histogram as `obscurad --stats` writes it, in seconds.
void add_histogram(Exposition& out, const std::string& family, const Labels& labels, const Json& figures) {
    if (!figures.contains("up_to") || figures["up_to"].size() != latency_bounds_us.size() ||
        !figures.contains("count"))
        return;
    for (std::size_t k = 0; k < latency_bounds_us.size(); ++k)
        out.add(family, "_bucket", with(labels, "le", fmt::format("{:g}", latency_bounds_us[k] * 1e-6)),
                figures["up_to"][k]);
    out.add(family, "_bucket", with(labels, "le", "+Inf"), figures["count"]);
    if (const auto sum = figures.find("sum"); sum != figures.end() && sum->is_number())
        out.add(family, "_sum", labels, sum->get<double>() * 1e-6);
    out.add(family, "_count", labels, figures["count"]);
}

void add_latencies(Exposition& out, const Labels& labels, const Json& camera) {
    const auto add = [&](const char* group, const auto& rows) {
        for (const auto& [name, help] : rows) {
            const std::string family = fmt::format("{}_seconds", name);
            out.declare(family, "histogram", help);
            if (const Pointer at(fmt::format("/{}/{}", group, name)); camera.contains(at))
                add_histogram(out, family, labels, camera[at]);
        }
    };
    add("latency_us", latencies);
    add("stages_us", stages);
    const Pointer transports("/stages_us/first_byte");
    if (!camera.contains(transports) || camera[transports].empty()) return;
    const std::string family = "trigger_to_first_byte_seconds";
    out.declare(family, "histogram", "From the trigger edge until a transport has sent the first byte.");
    for (const auto& [kind, figures] : camera[transports].items())
        add_histogram(out, family, with(labels, "transport", kind), figures);
}

/// Commands, packets and injected faults of a GigE Vision camera.
void add_gige(Exposition& out, const Labels& labels, const Json& counters) {
    for (const CameraNumber& row : gige_numbers) {
        if (!row.type.empty()) out.declare(row.family, row.type, row.help);
        if (counters.contains(row.pointer))
            out.add(row.family, "",
                    row.label.empty() ? labels : with(labels, row.label, std::string(row.label_value)),
                    counters[row.pointer]);
    }
    out.declare("gige_commands_received_total", "counter", "Datagrams that came to the control port.");
    out.declare(
        "gige_commands_total", "counter",
        "Commands that were not simply done: denied, repeated (answered, not done again), or throttled "
        "(answers withheld).");
    if (const auto commands = counters.find("commands"); commands != counters.end())
        for (const auto& [result, count] : commands->items()) {
            if (result == "received")
                out.add("gige_commands_received_total", "", labels, count);
            else
                out.add("gige_commands_total", "", with(labels, "result", result), count);
        }
    out.declare(
        "faults_struck_total", "counter",
        "Packets, frames or commands that injected faults have struck, of all rules since the start.");
    if (const auto struck = counters.find("faults_struck"); struck != counters.end())
        for (const auto& [kind, count] : struck->items())
            out.add("faults_struck_total", "", with(labels, "kind", kind), count);
}

void add_transports(Exposition& out, const Labels& labels, const Json& camera) {
    out.declare("transport_frames_total", "counter",
                "Frames that a transport was given, by what became of them.");
    out.declare("transport_bytes_total", "counter", "Bytes of frames that a transport has sent.");
    out.declare("transport_value", "gauge", "Further counters of a transport, named as in obscurad --stats.");
    if (!camera.contains("transports")) return;
    for (const auto& [kind, counters] : camera["transports"].items()) {
        const Labels of = with(labels, "transport", kind);
        const bool gige = kind == "gige";
        if (gige) add_gige(out, labels, counters);
        for (const auto& [name, value] : counters.items()) {
            const auto is = [&key = name](const CameraNumber& row) { return row.pointer == key; };
            if (gige && std::any_of(gige_numbers.begin(), gige_numbers.end(), is)) continue;
            if (name == "delivered" || name == "dropped")
                out.add("transport_frames_total", "", with(of, "outcome", name), value);
            else if (name == "bytes")
                out.add("transport_bytes_total", "", of, value);
            else if (name != "submitted" && !value.is_string())
                out.add("transport_value", "", with(of, "counter", name), value);
        }
    }
}

void add_camera(Exposition& out, const Labels& labels, const Json& camera) {
    out.declare("camera_info", "gauge",
                "1, with the sensor, and serial number and address of the GigE Vision camera.");
    out.add("camera_info", "",
            with(with(with(labels, "sensor", text_at(camera, "/sensor")), "serial",
                      text_at(camera, "/transports/gige/serial")),
                 "address", text_at(camera, "/address")),
            1);
    out.declare(
        "trigger_info", "gauge",
        "1, with TriggerSource of FrameStart, FreeRun if that is off, and the kind of Line0's source.");
    if (const Pointer on("/frame_trigger/on"); camera.contains(on))
        out.add("trigger_info", "",
                with(with(labels, "source",
                          camera[on] == true ? text_at(camera, "/frame_trigger/source") : "FreeRun"),
                     "line0", text_at(camera, "/clock/source")),
                1);
    out.declare("controlled", "gauge", "1 while a client controls the camera.");
    out.add("controlled", "", labels, !text_at(camera, "/controller").empty());
    out.declare("camera_bad", "gauge",
                "1 while the verdict on the last minute is that something is not good.");
    out.add("camera_bad", "", labels, text_at(camera, "/verdict/health") == "bad");
    for (const CameraNumber& row : camera_numbers) {
        if (!row.type.empty()) out.declare(row.family, row.type, row.help);
        if (const Pointer at(row.pointer); camera.contains(at))
            out.add(row.family, "",
                    row.label.empty() ? labels : with(labels, row.label, std::string(row.label_value)),
                    camera[at]);
    }
    out.declare("triggers_missed_total", "counter", "Missed trigger edges, by reason.");
    if (const Pointer at("/camera/missed_because"); camera.contains(at))
        for (const auto& [reason, count] : camera[at].items())
            out.add("triggers_missed_total", "", with(labels, "reason", reason), count);
    out.declare("clock_state", "gauge", "1 for the state that the clock of the trigger source is in.");
    for (const char* state : clock_states)
        out.add("clock_state", "", with(labels, "state", state), text_at(camera, "/clock/state") == state);
    out.declare("clock_offset_seconds", "gauge",
                "Last pulse of the clock's reference minus the instant at which it was expected.");
    if (const Pointer at("/clock/offset_ns"); camera.contains(at) && camera[at].is_number())
        out.add("clock_offset_seconds", "", labels, camera[at].get<double>() * 1e-9);
    out.declare("frame_pool_frames", "gauge", "Frame buffers of the camera.");
    if (const Pointer at("/pool"); camera.contains(at)) {
        const auto frames = camera[at].value("frames", std::int64_t{0}),
                   used = camera[at].value("in_use", std::int64_t{0});
        out.add("frame_pool_frames", "", with(labels, "state", "used"), used);
        out.add("frame_pool_frames", "", with(labels, "state", "free"), frames - used);
    }
    add_latencies(out, labels, camera);
    add_transports(out, labels, camera);
}

/// The clock of the machine as ptp4l tells it.
void add_ptp(Exposition& out, const Labels& daemon, const Json& state) {
    const auto add = [&](std::string_view family, const char* help, const char* pointer) {
        out.declare(family, "gauge", help);
        if (const Pointer at(pointer); state.contains(at) && state[at].is_number())
            out.add(family, "", daemon, state[at].get<double>() * 1e-9);
    };
    add("ptp_offset_seconds", "Offset of this machine's clock from its PTP master.", "/ptp/offset_ns");
    add("ptp_path_delay_seconds", "Mean path delay to the PTP master.", "/ptp/path_delay_ns");
}

/// Log, real time and configuration of a daemon.
void add_daemon(Exposition& out, const Labels& daemon, const Json& state) {
    out.declare("log_lines_total", "counter", "Lines of the log, by level.");
    if (const Pointer at("/daemon/log_lines"); state.contains(at))
        for (const auto& [level, count] : state[at].items())
            out.add("log_lines_total", "", with(daemon, "level", level), count);
    out.declare("realtime_granted", "gauge", "1 if threads have priorities of real time.");
    if (const Pointer at("/daemon/realtime"); state.contains(at))
        out.add("realtime_granted", "", daemon, state[at]);
    out.declare("config_last_reload_success_timestamp_seconds", "gauge",
                "When the configuration in use was taken on, at the start or by a reload.");
    if (const Pointer at("/daemon/configured_utc_s"); state.contains(at))
        out.add("config_last_reload_success_timestamp_seconds", "", daemon, state[at]);
    out.declare(
        "heartbeat_age_seconds", "gauge",
        "Time since the last beat of a supervised thread, of several with one name the longest; not of "
        "those that rest or have announced a wait.");
    std::map<std::string, double> ages;
    if (state.contains("heartbeats"))
        for (const Json& beat : state["heartbeats"])
            if (!beat.value("silent", true))
                if (double& age = ages[beat.value("name", "")]; beat.value("age_s", 0.0) > age)
                    age = beat["age_s"].get<double>();
    for (const auto& [thread, age] : ages)
        out.add("heartbeat_age_seconds", "", with(daemon, "thread", thread), age);
}

} // namespace

std::string metrics_text(std::span<const Json> states) {
    Exposition out;
    for (const Json& state : states) {
        Labels daemon{{"config", text_at(state, "/daemon/config")}};
        const auto same = [&daemon](const Json& one) {
            return text_at(one, "/daemon/config") == daemon.front().second;
        };
        if (const Pointer pid("/daemon/pid"); std::count_if(states.begin(), states.end(), same) > 1)
            daemon.emplace_back("pid", state.contains(pid) ? state[pid].dump() : std::string());
        out.declare("build_info", "gauge", "1, with the version of the daemon.");
        out.add("build_info", "", with(daemon, "version", text_at(state, "/daemon/version")), 1);
        const auto number = [&](std::string_view family, std::string_view type, std::string_view help,
                                const char* pointer) {
            out.declare(family, type, help);
            if (const Pointer at(pointer); state.contains(at)) out.add(family, "", daemon, state[at]);
        };
        number("up_seconds", "gauge", "Time since the daemon's start.", "/daemon/up_s");
        out.declare("resident_bytes", "gauge", "Memory of the daemon.");
        if (const Pointer at("/daemon/resident_mib"); state.contains(at) && state[at].is_number())
            out.add("resident_bytes", "", daemon, std::llround(state[at].get<double>() * (1 << 20)));
        number("log_lost_total", "counter", "Log messages of real-time threads that found no room.",
               "/daemon/log_lost");
        add_daemon(out, daemon, state);
        add_ptp(out, daemon, state);
        out.declare("thread_cpu_seconds_total", "counter", "Processor time of a thread.");
        out.declare("thread_priority", "gauge",
                    "Priority of a thread of class fifo or rr; 0: ordinary scheduling.");
        if (state.contains("threads"))
            for (const auto& [name, thread] : by_name(state["threads"])) {
                out.add("thread_cpu_seconds_total", "", with(daemon, "thread", name), thread.cpu_s);
                out.add("thread_priority", "", with(daemon, "thread", name), thread.priority);
            }
        if (state.contains("cameras"))
            for (std::size_t k = 0; k < state["cameras"].size(); ++k)
                add_camera(out, with(daemon, "camera", std::to_string(k)), state["cameras"][k]);
    }
    return out.text();
}

} // namespace obscura::host
