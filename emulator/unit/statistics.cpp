// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/statistics.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <variant>

namespace obscura::emulator {
namespace {

using Json = nlohmann::ordered_json;

double to_us(std::int64_t ns) {
    return static_cast<double>(ns) / 1e3;
}

Json latency(const LatencyHistogram& h) {
    return {
        {"count", h.count()},       {"p50", to_us(h.quantile_ns(0.5))}, {"p99", to_us(h.quantile_ns(0.99))},
        {"max", to_us(h.max_ns())}, {"sum", to_us(h.sum_ns())},         {"up_to", h.up_to_bounds()}};
}

/// The values of `rows` at their places in the state of a camera.
template<typename Rows, typename Counters>
void add_metrics(Json& state, const Rows& rows, const Counters& counters) {
    for (const CounterMetric<Counters>& row : rows)
        state[Json::json_pointer(fmt::format("/{}/{}", row.group, row.name))] = row.value(counters);
}

Json to_json(const std::vector<transports::TransportStatistics::Value>& values) {
    Json json = Json::object();
    for (const auto& [name, value] : values)
        std::visit([&, &key = name](auto number) { json[key] = number; }, value);
    return json;
}

Json to_json(const transports::TransportStatistics& statistics) {
    Json json = to_json(statistics.values);
    for (const auto& group : statistics.groups)
        json[group.name] = to_json(group.values);
    for (const auto& [name, text] : statistics.texts)
        json[name] = text;
    return json;
}

} // namespace

void add_metrics(nlohmann::ordered_json& state, const SimulatorCounters& counters) {
    add_metrics(state, simulator_metrics, counters);
}

std::string summary_line(const Camera& camera, const TransportList& transports) {
    const CameraCounters c = camera.counters();
    std::string line = fmt::format(
        "{} triggers, {} frames, {} complete, {} late, {} missed triggers, {} dropped, {} abandoned",
        c.triggers, c.frames, c.complete, c.late, c.missed_triggers, c.dropped, c.abandoned);
    if (c.unsent > 0) line += fmt::format(", {} unsent", c.unsent);
    for (const auto& transport : transports) {
        const transports::TransportCounters t = transport->counters();
        if (transport->kind() == "watch" && t.submitted == 0) continue; // no viewer so far
        line += fmt::format("; {}: {} delivered, {} dropped", transport->kind(), t.delivered, t.dropped);
    }
    return line;
}

nlohmann::ordered_json statistics_json(const Camera& camera, const Releaser& releaser,
                                       const TransportList& transports, const StageLatencies& stages,
                                       const SourceState& source, std::uint32_t run) {
    const CameraCounters c = camera.counters();
    Json json;
    json["clock"] = {{"state", source.lockstep ? "lockstep" : name_of(source.clock)},
                     {"source", source.name}};
    if (source.offset_ns) json["clock"]["offset_ns"] = *source.offset_ns;
    json["trigger"] = {{"refused", source.refused}};
    json["camera"]["run"] = run;
    add_metrics(json, camera_metrics, c);
    json["latency_us"] = {{"trigger_to_first_row", latency(releaser.trigger_to_first_row())},
                          {"trigger_to_last_row", latency(releaser.trigger_to_last_row())},
                          {"release_lateness", latency(releaser.release_lateness())}};
    json["stages_us"] = {{"trigger_seen", latency(stages.trigger_seen)},
                         {"render", latency(stages.render)},
                         {"detector", latency(stages.detector)},
                         {"first_byte", Json::object()}};
    for (std::size_t slot = 0; slot < transports.size(); ++slot)
        if (stages.first_byte[slot].count() > 0)
            json["stages_us"]["first_byte"][std::string(transports[slot]->kind())] =
                latency(stages.first_byte[slot]);
    json["transports"] = Json::object();
    for (const auto& transport : transports)
        json["transports"][std::string(transport->kind())] = to_json(transport->statistics());
    return json;
}

} // namespace obscura::emulator
