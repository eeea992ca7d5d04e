// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/gige.hpp"

#include "core/realtime/log.hpp"
#include "transports/gige/channels/gvsp_sender.hpp"
#include "transports/gige/control/control_server.hpp"
#include "transports/gige/device_features.hpp"
#include "transports/gige/fault_rules.hpp"

#include <fmt/format.h>

namespace obscura::transports::gige {

namespace {

/// Settings of the control thread: one priority above the sender, because an acknowledge must not wait for
/// the end of a burst.
ThreadSettings control_thread(const ThreadSettings& sender) {
    return {sender.priority > 0 ? sender.priority + 1 : 0, sender.cores};
}

void read_resends(const SenderCounters& s, GigeCounters& out) {
    const auto count = [&](ResendOutcome outcome) {
        return s.resends[static_cast<std::size_t>(outcome)].load();
    };
    out.resend_requests = s.resend_requests.load();
    out.asked_packets = s.asked_packets.load();
    out.resent_packets = count(ResendOutcome::resent);
    out.asked_before_sent = count(ResendOutcome::before_sent);
    out.refused = {.no_longer_kept = count(ResendOutcome::no_longer_kept),
                   .by_fault = count(ResendOutcome::by_fault),
                   .over_budget = count(ResendOutcome::over_budget),
                   .no_such_packet = count(ResendOutcome::no_such_packet),
                   .no_such_block = count(ResendOutcome::no_such_block),
                   .queue_full = count(ResendOutcome::queue_full)};
}

/// What is known of the control channel and of the stream while they are open.
void add_channels(const ControlPort& port, const GvspSender& sender, Time now, TransportStatistics& s) {
    if (!port.controller().empty()) {
        const Time heard{port.counters().heard_ns.load(std::memory_order_relaxed)};
        s.values.push_back({"controller_silent_s", to_seconds(now - heard)});
    }
    const SenderCounters& counters = sender.counters();
    const std::uint64_t target = counters.stream_target.load(std::memory_order_relaxed);
    s.values.push_back({"no_receiver", counters.no_receiver.load(std::memory_order_relaxed)});
    if (target == 0 || !sender.streaming()) return;
    s.values.push_back({"packet_bytes", std::uint64_t{counters.packet_size.load(std::memory_order_relaxed)}});
    s.texts.push_back({"stream_to", fmt::format("{}:{}", dotted(static_cast<std::uint32_t>(target >> 16)),
                                                target & 0xFFFF)});
}

std::vector<TransportStatistics::Value> strikes_of(const ArmedFaults& faults) {
    std::vector<TransportStatistics::Value> all;
    for (auto& [label, struck] : faults.strikes())
        all.push_back({std::move(label), struck});
    return all;
}

std::vector<TransportStatistics::Value> strikes_by_kind(const ArmedFaults& faults) {
    std::vector<TransportStatistics::Value> all;
    for (const auto& [fault, name] : enum_names(Fault{}))
        all.push_back({std::string(name), faults.struck_since_start(fault)});
    return all;
}

} // namespace

/// In order of construction; destroyed in reverse, so the control side goes before the sender.
struct GigeCamera::Parts {
    NetworkInterface network;
    MessageChannel messages;
    GvspSender sender;
    Device device;
    ControlPort port;
    ControlServer server;
    GigeFaultRules faults{device, sender.counters()};
    GigeFeatures features;

    static NetworkInterface shown_network(const GigeSettings& s) {
        NetworkInterface network = find_interface(s.interface);
        if (const auto mac = parse_mac(s.mac)) network.mac = *mac;
        return network;
    }

    Parts(const GigeSettings& s, std::size_t slot, CameraControl& control, const Clock& clock,
          const GigeContext& context)
        : network(shown_network(s)),
          messages(network),
          sender(s, network, messages, clock, context.thread, slot),
          device(s, network, control, sender, messages, clock, context.seed),
          port(device, s, network, context.control_listener),
          server(port, network, clock, s.port, control_thread(context.thread)),
          features(device, control) {
        device.set_before_disk([this] { server.announce_disk(); });
        device.set_statistics([this] {
            const SenderCounters& c = sender.counters();
            GigeCounters g;
            read_resends(c, g);
            const auto low = [](std::uint64_t n) { return static_cast<std::uint32_t>(n); };
            return StreamStatistics{.submitted = low(c.submitted.load()),
                                    .delivered = low(c.delivered.load()),
                                    .dropped = low(c.dropped.load()),
                                    .asked = low(g.asked_packets),
                                    .resent = low(g.resent_packets),
                                    .asked_before_sent = low(g.asked_before_sent),
                                    .refused = low(g.refused.sum())};
        });
    }
};

GigeCamera::GigeCamera(GigeSettings settings, CameraControl& control, const Clock& clock, GigeContext context)
    : settings_(std::move(settings)), control_(control), clock_(clock), context_(std::move(context)) {}

GigeCamera::~GigeCamera() {
    stop();
}

void GigeCamera::start() {
    parts_ = std::make_unique<Parts>(settings_, transmit_slot(), control_, clock_, context_);
    if (const std::string report = parts_->device.xml_report(); !report.empty())
        log_info("gige.xml: {}", report);
    parts_->device.set_ptp(context_.ptp_status);
    parts_->messages.start();
    parts_->sender.start();
    parts_->server.start();
}

void GigeCamera::stop() {
    if (!parts_) return;
    parts_->server.stop();
    parts_->sender.stop();
    parts_->messages.stop();
}

bool GigeCamera::submit(const FrameRef& frame) noexcept {
    return parts_ && parts_->sender.submit(frame);
}

void GigeCamera::notify(CameraEvent event, Time t, std::int64_t tai_offset_ns) noexcept {
    if (!parts_) return;
    const Event e = event == CameraEvent::trigger_missed ? Event::frame_trigger_missed : Event::error;
    parts_->messages.post(
        {e, 0, static_cast<std::uint64_t>(t.ns + tai_offset_ns - parts_->device.timestamp_origin_ns())});
}

TransportCounters GigeCamera::counters() const noexcept {
    return gige_counters().frames;
}

std::int64_t GigeCamera::pace_ns() const noexcept {
    return parts_ ? parts_->sender.counters().pace_ns.load(std::memory_order_relaxed) : 0;
}

GigeCounters GigeCamera::gige_counters() const noexcept {
    GigeCounters out;
    if (!parts_) return out;
    const SenderCounters& s = parts_->sender.counters();
    const PacketSocket& socket = parts_->sender.socket();
    const ControlCounters& c = parts_->port.counters();
    out.frames = {s.submitted.load(), s.delivered.load(), s.dropped.load(), socket.bytes()};
    out.packets = socket.packets();
    out.send_errors = socket.errors();
    out.injected_losses = s.injected_losses.load();
    out.injected_delays = s.injected_delays.load();
    read_resends(s, out);
    out.resends_denied = c.resends_denied.load();
    out.repeated_packets = s.repeated_packets.load();
    out.control_taken = c.control_taken.load();
    out.control_lost = c.control_lost.load();
    out.retries = c.retries.load();
    out.commands = c.datagrams.load();
    out.denied = c.denied.load();
    out.throttled = c.throttled.load();
    out.events_acknowledged = parts_->messages.acknowledged();
    out.events_lost = parts_->messages.lost();
    out.trigger_to_first_p50_ns = s.trigger_to_first.quantile_ns(0.5);
    out.trigger_to_first_p99_ns = s.trigger_to_first.quantile_ns(0.99);
    out.trigger_to_last_p50_ns = s.trigger_to_last.quantile_ns(0.5);
    out.trigger_to_last_p99_ns = s.trigger_to_last.quantile_ns(0.99);
    return out;
}

TransportStatistics GigeCamera::statistics() const {
    const auto us = [](std::int64_t ns) { return static_cast<double>(ns) / 1e3; };
    TransportStatistics s = Transport::statistics();
    const GigeCounters g = gige_counters();
    s.values.insert(s.values.end(), {{"packets", g.packets},
                                     {"send_errors", g.send_errors},
                                     {"injected_losses", g.injected_losses},
                                     {"injected_delays", g.injected_delays},
                                     {"resend_requests", g.resend_requests},
                                     {"resend_requests_denied", g.resends_denied},
                                     {"asked_packets", g.asked_packets},
                                     {"resent_packets", g.resent_packets},
                                     {"asked_before_sent", g.asked_before_sent},
                                     {"refused_packets", g.refused.sum()},
                                     {"repeated_packets", g.repeated_packets},
                                     {"events_acknowledged", g.events_acknowledged},
                                     {"events_lost", g.events_lost},
                                     {"control_taken", g.control_taken},
                                     {"control_lost", g.control_lost}});
    s.texts.push_back({"serial", settings_.serial});
    if (parts_) add_channels(parts_->port, parts_->sender, clock_.now(), s);
    s.groups = {{"refused_because",
                 {{"no_longer_kept", g.refused.no_longer_kept},
                  {"by_fault", g.refused.by_fault},
                  {"over_budget", g.refused.over_budget},
                  {"no_such_packet", g.refused.no_such_packet},
                  {"no_such_block", g.refused.no_such_block},
                  {"queue_full", g.refused.queue_full}}},
                {"fault_strikes", parts_ ? strikes_of(parts_->device.armed_faults())
                                         : std::vector<TransportStatistics::Value>{}},
                {"faults_struck", parts_ ? strikes_by_kind(parts_->device.armed_faults())
                                         : std::vector<TransportStatistics::Value>{}},
                {"commands",
                 {{"received", g.commands},
                  {"denied", g.denied},
                  {"repeated", g.retries},
                  {"throttled", g.throttled}}},
                {"events", {{"acknowledged", g.events_acknowledged}, {"lost", g.events_lost}}},
                {"trigger_to_first_packet_us",
                 {{"p50", us(g.trigger_to_first_p50_ns)}, {"p99", us(g.trigger_to_first_p99_ns)}}},
                {"trigger_to_last_packet_us",
                 {{"p50", us(g.trigger_to_last_p50_ns)}, {"p99", us(g.trigger_to_last_p99_ns)}}}};
    return s;
}

Heartbeats GigeCamera::heartbeats() const {
    if (!parts_) return {};
    return {&parts_->messages.heartbeat(), &parts_->sender.heartbeat(), &parts_->server.heartbeat()};
}

std::string GigeCamera::control_address() const {
    return parts_ ? fmt::format("{}:{}", address(), settings_.port) : std::string();
}

std::string GigeCamera::controller() const {
    return parts_ ? parts_->port.controller() : std::string();
}

bool GigeCamera::run_between_commands(const ControlWork& work) {
    return parts_ && parts_->server.run([&] { work(parts_->port.controller()); });
}

FaultRules* GigeCamera::fault_rules() noexcept {
    return parts_ ? &parts_->faults : nullptr;
}

DeviceFeatures* GigeCamera::device_features() noexcept {
    return parts_ ? &parts_->features : nullptr;
}

void GigeCamera::release_control() {
    if (parts_) parts_->server.release_control();
}

std::string GigeCamera::address() const {
    return parts_ ? dotted(parts_->network.address) : std::string();
}

} // namespace obscura::transports::gige
