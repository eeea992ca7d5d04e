// SPDX-License-Identifier: Apache-2.0
#include "host/metrics_text.hpp"

#include "core/camera/camera_counters.hpp"
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
    /// `type`: name of a MetricType.
    void declare(std::string_view name, std::string_view type, std::string_view help) {
        for (const Family& family : families_)
            if (family.name == name) return;
        families_.push_back(
            {std::string(name),
             fmt::format("# HELP obscura_{0} {1}\n# TYPE obscura_{0} {2}\n", name, help, type),
             {}});
    }
    void declare(const Metric& metric) { declare(metric.family, name_of(metric.type), metric.help); }
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

constexpr std::array clock_states{"free", "locked", "holdover", "lockstep"};

Pointer pointer_of(const Metric& metric) {
    return Pointer(metric.group.empty() ? fmt::format("/{}", metric.name)
                                        : fmt::format("/{}/{}", metric.group, metric.name));
}

/// The numbers of a camera that stand in its state.
template<typename Rows>
void add_numbers(Exposition& out, const Rows& rows, const Labels& labels, const Json& camera) {
    for (const Metric& row : rows) {
        if (row.family.empty()) continue;
        out.declare(row);
        if (const Pointer at = pointer_of(row); camera.contains(at))
            out.add(row.family, "",
                    row.label.empty() ? labels : with(labels, row.label, std::string(row.label_value)),
                    camera[at]);
    }
}

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
void add_histogram(Exposition& out, std::string_view family, const Labels& labels, const Json& figures) {
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
    for (const Metric& metric : latency_metrics) {
        out.declare(metric);
        if (const Pointer at = pointer_of(metric); camera.contains(at))
            add_histogram(out, metric.family, labels, camera[at]);
    }
    const Pointer transports("/stages_us/first_byte");
    if (!camera.contains(transports) || camera[transports].empty()) return;
    const std::string family = "trigger_to_first_byte_seconds";
    out.declare(family, "histogram", "From the trigger edge until a transport has sent the first byte.");
    for (const auto& [kind, figures] : camera[transports].items())
        add_histogram(out, family, with(labels, "transport", kind), figures);
}

/// Commands, packets and injected faults of a GigE Vision camera.
void add_gige(Exposition& out, const Labels& labels, const Json& counters) {
    out.declare("gige_commands_received_total", "counter", "Datagrams that came to the control port.");
    out.declare(
        "gige_commands_total", "counter",
        "Commands that were not simply done: denied, repeated (answered, not done again), or throttled (answers withheld).");
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
        if (gige) {
            add_numbers(out, gige_metrics, labels, camera);
            add_gige(out, labels, counters);
        }
        for (const auto& [name, value] : counters.items()) {
            const auto is = [&key = name](const Metric& row) { return row.name == key; };
            if (gige && std::any_of(gige_metrics.begin(), gige_metrics.end(), is)) continue;
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
    add_numbers(out, camera_metrics, labels, camera);
    add_numbers(out, camera_state_metrics, labels, camera);
    add_numbers(out, simulator_metrics, labels, camera);
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
    out.declare("heartbeat_age_seconds", "gauge",
                "Time since the last beat of a supervised thread, of several with one name the longest; "
                "not of those that rest or have announced a wait.");
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
