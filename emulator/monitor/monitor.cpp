// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/monitor.hpp"

#include "core/clock.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/log_history.hpp"
#include "emulator/daemon/daemon.hpp"
#include "emulator/monitor/isolation_advice.hpp"
#include "emulator/monitor/own_threads.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <optional>
#include <utility>

namespace obscura::emulator {
namespace {

using Json = nlohmann::ordered_json;

Time now() {
    return MonotonicClock().now();
}

Json monitor_json(const FrameOutcomes& o) {
    return {{"seconds", o.seconds},         {"triggers", o.triggers}, {"missed_triggers", o.missed_triggers},
            {"frames", o.frames},           {"complete", o.complete}, {"late", o.late},
            {"late_rows", o.late_rows},     {"stalled", o.stalled},   {"stalled_rows", o.stalled_rows},
            {"abandoned", o.abandoned},     {"dropped", o.dropped},   {"unsent", o.unsent},
            {"undelivered", o.undelivered}, {"degraded", o.degraded}};
}

Json lines_by_level() {
    Json lines;
    for (const auto& [level, name] : enum_names(LogLevel{}))
        lines[std::string(name)] = log_history().count(level);
    return lines;
}

Json monitor_json(const PtpStatus& status) {
    // Before the first answer offset and delay are not known.
    const bool known = status.answers > 0;
    return {{"locked", status.locked},
            {"offset_ns", known ? Json(status.offset_ns) : Json()},
            {"path_delay_ns", known ? Json(status.path_delay_ns) : Json()}};
}

double resident_mib() {
    std::uint64_t size = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> size >> resident;
    return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// 0: none of it, or not known.
double locked_mib() {
    return std::strtod(status_field("/proc/self/status", "VmLck").c_str(), nullptr) / 1024;
}

std::string utc_text(std::int64_t ns) {
    const std::time_t seconds = ns / ns_per_s;
    return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds), ns % ns_per_s / ns_per_ms);
}

/// `line0`: kind of the source of Line0; `clock`: state of its clock.
AwaitedTrigger awaited_of(const TriggerChoice& trigger, const std::string& line0, const std::string& clock) {
    AwaitedTrigger awaited;
    if (!trigger.enabled) {
        awaited.name = "the free run";
        return awaited;
    }
    const bool on_line0 = trigger.source == TriggerSource::line0;
    awaited.on_request = trigger.source == TriggerSource::software ||
                         trigger.source == TriggerSource::action1 || (on_line0 && clock == "lockstep");
    awaited.name = on_line0 ? fmt::format("{} ({})", name_of(trigger.source), line0)
                            : std::string(name_of(trigger.source));
    return awaited;
}

} // namespace

config::Keys EventRange::keys() {
    return {config::key("after", &after).range(0, 9e15).help("Only lines with a larger id"),
            config::key("most", &most)
                .range(1, static_cast<double>(LogHistory::lines))
                .help("Largest number of lines")};
}

std::vector<service::Result> state_results() {
    return {
        {"daemon", "map", "",
         "Version, process, configuration, time since the start, memory, lines of the log; starting, while the daemon starts: text, step, share and left_s"},
        {"ptp", "map", "", "With [ptp]: lock, offset_ns and path_delay_ns of the machine's clock"},
        {"heartbeats", "array of maps", "", "Supervised threads: name, age_s, silent"},
        {"threads", "array of maps", "", "Scheduling, cores and processor time of each thread"},
        {"cameras", "array of maps", "",
         "State, verdict, counters and latencies of each camera, see docs/control.md"}};
}

std::vector<service::Result> events_results() {
    return {{"events", "array of maps", "",
             "Lines with id, utc, level, text, and message, the MESSAGE_ID of the journal's catalogue"}};
}

Monitor::Monitor(Daemon& daemon, std::string version)
    : daemon_(daemon),
      version_(std::move(version)),
      started_(now()),
      started_utc_ns_(std::chrono::duration_cast<std::chrono::nanoseconds>(
                          std::chrono::system_clock::now().time_since_epoch())
                          .count()),
      recent_(daemon.camera_count()) {}

void Monitor::tick() {
    const Time time = now();
    state_.reset();
    for (std::size_t i = 0; i < recent_.size(); ++i)
        recent_[i].note(time, daemon_.camera(i).counters(), daemon_.camera(i).acquiring(),
                        daemon_.unit(i).undelivered().frames);
    beats_.note(time, daemon_.heartbeats());
    if (!std::exchange(advised_, true)) {
        const ThreadPlan& plan = daemon_.threads();
        advice_ = isolation_advice(machine_facts(plan.release.cores, highest_priority(plan)));
    }
}

std::shared_ptr<const Json> Monitor::state() {
    if (!state_) state_ = std::make_shared<const Json>(made_state());
    return state_;
}

Json Monitor::made_state() const {
    const Time time = now();
    Json state;
    state["daemon"] = {{"version", version_},
                       {"pid", ::getpid()},
                       {"config", daemon_.config().source.string()},
                       {"control", control_},
                       {"started_utc_ns", std::to_string(started_utc_ns_)},
                       {"up_s", static_cast<double>(time - started_) / static_cast<double>(ns_per_s)},
                       {"config_sha256", daemon_.config_sha256()},
                       {"configured_utc_s", daemon_.configured_utc_s()},
                       {"realtime", highest_priority(daemon_.threads()) > 0},
                       {"log_lines", lines_by_level()},
                       {"log_level", name_of(log_level())},
                       {"advice", advice_},
                       {"log_lost", daemon_.lost_messages()}};
    if (const std::optional<PtpStatus> ptp = daemon_.ptp_status()) state["ptp"] = monitor_json(*ptp);
    state["heartbeats"] = Json::array();
    for (const BeatTimes::Age& beat : beats_.ages(time))
        state["heartbeats"].push_back({{"name", beat.name}, {"age_s", beat.age_s}, {"silent", beat.silent}});
    state["cameras"] = Json::array();
    for (std::size_t i = 0; i < recent_.size(); ++i) {
        const Camera& camera = daemon_.camera(i);
        const FramePool& pool = daemon_.unit(i).pool();
        UndeliveredFrames undelivered = daemon_.unit(i).undelivered();
        FrameOutcomes recent = recent_[i].until(time, camera.counters(), undelivered.frames);
        recent.undelivered_by = std::move(undelivered.by);
        const std::string controller = daemon_.controller(i);
        Json statistics = daemon_.statistics_of(i);
        const TriggerChoice trigger = camera.settings().frame_trigger;
        AwaitedTrigger awaited = awaited_of(trigger, statistics["clock"]["source"].get<std::string>(),
                                            statistics["clock"]["state"].get<std::string>());
        awaited.acquires_s =
            static_cast<double>(time - camera.activity().acquisition_start) / static_cast<double>(ns_per_s);
        const std::string address = daemon_.address(i); // empty: no GigE Vision
        const std::optional<RecentFrames::LastFrame> last = recent_[i].last_frame(time);
        const Verdict verdict =
            judge(recent, camera.acquiring(), controller, awaited, !address.empty(), last);
        Json one{{"address", address},
                 {"controller", controller},
                 {"acquiring", camera.acquiring()},
                 {"trigger_ready", camera.trigger_ready()},
                 {"frame_trigger", {{"on", trigger.enabled}, {"source", name_of(trigger.source)}}},
                 {"frame_id", camera.moments().frame_id},
                 {"sensor", daemon_.config().cameras()[i]->sensor.name},
                 {"tai", name_of(daemon_.unit(i).tai_source())},
                 {"pose_age_s", daemon_.unit(i).pose_age_s()},
                 {"pool", {{"frames", pool.size()}, {"in_use", pool.in_use()}}},
                 {"verdict", {{"health", name_of(verdict.health)}, {"text", verdict.text}}},
                 {"recent", monitor_json(recent)}};
        if (last && !awaited.on_request)
            one["last_frame"] = {{"age_s", last->age_s}, {"overdue_s", last->overdue_s}};
        if (const std::optional<SimulatorCounters> simulator = daemon_.unit(i).simulator_counters())
            add_metrics(one, *simulator);
        one.update(statistics);
        state["cameras"].push_back(std::move(one));
    }
    return state;
}

void Monitor::add_process(nlohmann::json& head) {
    head["daemon"]["resident_mib"] = resident_mib();
    head["daemon"]["locked_mib"] = locked_mib();
    nlohmann::json threads = nlohmann::json::array();
    for (const OwnThread& t : own_threads())
        threads.push_back({{"name", t.name},
                           {"policy", t.policy},
                           {"priority", t.priority},
                           {"nice", t.nice},
                           {"cpu_s", t.cpu_s},
                           {"processor", t.processor},
                           {"cores", t.cores}});
    head["threads"] = std::move(threads);
}

Json Monitor::events(std::uint64_t after, std::uint64_t most) {
    Json list = Json::array();
    std::size_t bytes = 0;
    // 64 KiB, as readers of lines expect. Room for the longest one, each character of which may take six
    // bytes as JSON, is left at the end.
    constexpr std::size_t enough = 65536 - 6 * LogHistory::text_bytes - 256;
    for (const LoggedLine& line : log_history().after(after, static_cast<std::size_t>(most))) {
        Json one{{"id", line.id},
                 {"utc", utc_text(line.utc_ns)},
                 {"level", name_of(line.level)},
                 {"text", line.text},
                 {"message", line.message}};
        bytes += one.dump(-1, ' ', true, Json::error_handler_t::replace).size() + 1;
        if (bytes > enough) break;
        list.push_back(std::move(one));
    }
    return {{"events", std::move(list)}};
}

} // namespace obscura::emulator
