// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/gige.hpp"

#include "core/log.hpp"
#include "transports/gige/channels/gvsp_sender.hpp"
#include "transports/gige/control/control_server.hpp"

#include <fmt/format.h>

namespace obscura::transports::gige {

namespace {

/// Settings of the control thread: one priority above the sender, because an acknowledge must not wait for
/// the end of a burst.
ThreadSettings control_thread(const ThreadSettings& sender) {
    return {sender.priority > 0 ? sender.priority + 1 : 0, sender.cores};
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
          server(port, network, clock, s.port, control_thread(context.thread)) {
        device.set_before_disk([this] { server.announce_disk(); });
        device.set_statistics([this] {
            const SenderCounters& c = sender.counters();
            return StreamStatistics{static_cast<std::uint32_t>(c.submitted.load()),
                                    static_cast<std::uint32_t>(c.delivered.load()),
                                    static_cast<std::uint32_t>(c.dropped.load()),
                                    static_cast<std::uint32_t>(c.resent_packets.load())};
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
    out.resend_requests = s.resend_requests.load();
    out.resent_packets = s.resent_packets.load();
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
                                     {"resend_requests", g.resend_requests},
                                     {"resent_packets", g.resent_packets},
                                     {"repeated_packets", g.repeated_packets},
                                     {"control_taken", g.control_taken},
                                     {"control_lost", g.control_lost}});
    s.groups = {{"trigger_to_first_packet_us",
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

void GigeCamera::release_control() {
    if (parts_) parts_->server.release_control();
}

std::string GigeCamera::address() const {
    return parts_ ? dotted(parts_->network.address) : std::string();
}

} // namespace obscura::transports::gige
