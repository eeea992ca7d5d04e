#include "emulator/statistics.hpp"

#include "transports/gige/gige.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace obscura::emulator {
namespace {

using Json = nlohmann::ordered_json;

double to_us(std::int64_t ns) {
    return static_cast<double>(ns) / 1e3;
}

Json latency(const LatencyHistogram& h) {
    return {{"count", h.count()},
            {"p50", to_us(h.quantile_ns(0.5))},
            {"p99", to_us(h.quantile_ns(0.99))},
            {"max", to_us(h.max_ns())}};
}

Json transport_counters(const transports::Transport& transport) {
    const transports::TransportCounters c = transport.counters();
    Json json{
        {"submitted", c.submitted}, {"delivered", c.delivered}, {"dropped", c.dropped}, {"bytes", c.bytes}};
    if (const auto* gige = dynamic_cast<const transports::gige::GigeCamera*>(&transport)) {
        const transports::gige::GigeCounters g = gige->gige_counters();
        json["packets"] = g.packets;
        json["send_errors"] = g.send_errors;
        json["injected_losses"] = g.injected_losses;
        json["resend_requests"] = g.resend_requests;
        json["resent_packets"] = g.resent_packets;
        json["control_lost"] = g.control_lost;
        json["trigger_to_first_packet_us"] = {{"p50", to_us(g.trigger_to_first_p50_ns)},
                                              {"p99", to_us(g.trigger_to_first_p99_ns)}};
        json["trigger_to_last_packet_us"] = {{"p50", to_us(g.trigger_to_last_p50_ns)},
                                             {"p99", to_us(g.trigger_to_last_p99_ns)}};
    }
    return json;
}

} // namespace

std::string summary_line(const Camera& camera, const TransportList& transports) {
    const CameraCounters c = camera.counters();
    std::string line =
        fmt::format("{} triggers, {} frames, {} complete, {} late, {} missed triggers, {} dropped, "
                    "{} abandoned",
                    c.triggers, c.frames, c.complete, c.late, c.missed_triggers, c.dropped, c.abandoned);
    for (const auto& transport : transports) {
        const transports::TransportCounters t = transport->counters();
        line += fmt::format("; {}: {} delivered, {} dropped", transport->name(), t.delivered, t.dropped);
    }
    return line;
}

std::string statistics_to_json(const Camera& camera, const Releaser& releaser,
                               const TransportList& transports, ClockState clock, std::string_view source) {
    const CameraCounters c = camera.counters();
    Json json;
    json["clock"] = {{"state", name_of(clock)}, {"source", source}};
    json["camera"] = {{"triggers", c.triggers},
                      {"frames", c.frames},
                      {"complete", c.complete},
                      {"late", c.late},
                      {"late_rows", c.late_rows},
                      {"missed_triggers", c.missed_triggers},
                      {"ignored", c.ignored},
                      {"dropped", c.dropped},
                      {"abandoned", c.abandoned},
                      {"masked_triggers", c.masked_triggers},
                      {"latched_triggers", c.latched_triggers},
                      {"repeated", c.repeated},
                      {"late_dropped", c.late_dropped},
                      {"partial", c.partial}};
    json["latency_us"] = {{"trigger_to_first_row", latency(releaser.trigger_to_first_row())},
                          {"trigger_to_last_row", latency(releaser.trigger_to_last_row())},
                          {"release_lateness", latency(releaser.release_lateness())}};
    json["transports"] = Json::object();
    for (const auto& transport : transports)
        json["transports"][std::string(transport->name())] = transport_counters(*transport);
    return json.dump(2) + "\n";
}

} // namespace obscura::emulator
