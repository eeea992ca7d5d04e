// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/settings.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/io/address_range.hpp"
#include "core/text/printable.hpp"
#include "transports/gige/device/preset_check.hpp"
#include "transports/gige/genicam/user_xml.hpp"
#include "transports/gige/gige.hpp"
#include "transports/gige/registers/register_bank.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace obscura::transports::gige {
namespace {

/// `limit`: size of the bootstrap register less one byte for the terminating zero.
void check_text(const config::ReadTable& table, std::string_view key, const std::string& text,
                std::size_t limit) {
    if (text.size() > limit || !is_register_text(text))
        table.refuse(key, fmt::format("allowed are at most {} printable ASCII characters", limit));
}

/// Checks the text only: whether the interface exists is checked at start.
void check_interface(const config::ReadTable& table, const GigeSettings& s) {
    const std::string& text = s.interface;
    if (text.empty()) {
        if (s.enabled)
            table.refuse("interface", "empty, the name or an IPv4 address of a network interface is wanted");
        return;
    }
    in_addr parsed{};
    if (text.find_first_not_of("0123456789.") == std::string::npos &&
        inet_pton(AF_INET, text.c_str(), &parsed) != 1)
        table.refuse("interface", fmt::format("\"{}\" is no IPv4 address like 192.168.7.2", printable(text)));
    else if (text.size() >= IFNAMSIZ ||
             std::any_of(text.begin(), text.end(), [](char c) { return c <= 0x20 || c == 0x7f || c == '/'; }))
        table.refuse(
            "interface",
            fmt::format(
                "\"{}\" is no name of a network interface: allowed are at most {} characters without blanks and slashes",
                printable(text), IFNAMSIZ - 1));
}

void check(const GigeSettings& s, const config::ReadTable& table) {
    check_text(table, "vendor", s.vendor, 31);
    check_text(table, "model", s.model, 31);
    check_text(table, "serial", s.serial, 15);
    check_text(table, "user_name", s.user_name, 15);
    if (!s.mac.empty() && !parse_mac(s.mac))
        table.refuse("mac",
                     fmt::format("\"{}\" is no hardware address, allowed six bytes like 02:4f:00:00:00:01",
                                 printable(s.mac)));
    if (s.packet_size % 4 != 0)
        table.refuse("packet_size", fmt::format("{} is not a multiple of 4", s.packet_size));
    if (s.heartbeat_timeout_ms > s.heartbeat_timeout_max_ms)
        table.refuse("heartbeat_timeout_ms", fmt::format("{} is above heartbeat_timeout_max_ms, {}",
                                                         s.heartbeat_timeout_ms, s.heartbeat_timeout_max_ms));
    check_interface(table, s);
    table.refuse_if_thrown("allow", [&] { (void)parse_address_ranges(s.allow); });
    if (s.xml.empty()) return;
    if (const std::string why = explain_invalid_xml(s.xml); !why.empty())
        table.refuse("xml", why);
    else if (const std::string bad = explain_invalid_values(s.xml, s.xml_values); !bad.empty())
        table.refuse("xml_values", bad);
}

void check(const FaultRule& rule, const config::ReadTable& table) {
    if (rule.last_frame != 0 && rule.last_frame < rule.first_frame)
        table.refuse("last", fmt::format("{} is before the first, {}", rule.last_frame, rule.first_frame));
    if (rule.fault == Fault::delay && !(rule.amount >= 0 && rule.amount <= 1e6))
        table.refuse("amount", fmt::format("{} us is no delay, allowed 0 to 1000000", rule.amount));
    if (rule.fault == Fault::wrong_block_id &&
        (rule.amount < 1 || rule.amount > 65535 || rule.amount != std::floor(rule.amount)))
        table.refuse("amount",
                     fmt::format("{} is no distance of block ids, allowed 1 to 65535", rule.amount));
}

} // namespace

std::optional<std::uint64_t> parse_mac(std::string_view text) {
    if (text.size() != 17) return std::nullopt;
    std::uint64_t mac = 0;
    for (std::size_t i = 0; i < text.size(); i += 3) {
        unsigned byte = 0;
        const char* const end = text.data() + i + 2;
        const auto [stop, error] = std::from_chars(text.data() + i, end, byte, 16);
        if (error != std::errc{} || stop != end || (i + 2 < text.size() && text[i + 2] != ':'))
            return std::nullopt;
        mac = mac << 8 | byte;
    }
    // The lowest bit of the first byte marks group addresses.
    if (mac == 0 || (mac >> 40 & 1) != 0) return std::nullopt;
    return mac;
}

config::Section section_of(FaultRule& r) {
    using config::key;
    return {
        .name = "faults",
        .help = "One rule of fault injection. The same rules and seed strike the same packets in every run.",
        .keys =
            {
                key("kind", &r.fault)
                    .required()
                    .help(
                        "Kind of fault: in payload packets, in whole frames, or in the answers to commands"),
                key("percent", &r.percent)
                    .unit("%")
                    .range(0, 100)
                    .help(
                        "Share of the packets, frames or commands selected by the other keys that the fault strikes"),
                key("first", &r.first_frame)
                    .range(1, 9e15)
                    .help("First frame, counted since the client opened its stream; "
                          "for mute_control and heartbeat_loss first command, counted since the start"),
                key("last", &r.last_frame).range(0, 9e15).help("Last frame or command; 0: no end"),
                key("every", &r.every_frames)
                    .range(1, 9e15)
                    .help("Interval between struck frames or commands, counted from the first; 1: all"),
                key("burst_packets", &r.burst)
                    .range(1, 65536)
                    .help("Number of neighbouring packets that are struck together"),
                key("amount", &r.amount)
                    .range(-1e9, 1e9)
                    .help(
                        "delay, wrong_timestamp: by how many microseconds; wrong_block_id: by how much too high; "
                        "other kinds: no meaning"),
                key("seed", &r.seed)
                    .range(0, 9e15)
                    .help("Seed of the random choice by percent; 0: the daemon's seed"),
            },
        .check = [&r](const config::ReadTable& table) { check(r, table); },
    };
}

config::Section section_of(GigeSettings& s) {
    using config::key;
    return {
        .name = GigeSettings::kind,
        .help = "Transport that makes the daemon a GigE Vision camera: GVCP control and GVSP stream.",
        .keys =
            {
                key("enabled", &s.enabled).help("Serve the frames as a GigE Vision camera"),
                key("interface", &s.interface)
                    .help("Network interface of the camera: its name or one of its IPv4 addresses"),
                key("port", &s.port)
                    .range(1, 65535)
                    .help("UDP port of GVCP; clients look for cameras on 3956"),
                key("vendor", &s.vendor).help("DeviceVendorName, at most 31 characters"),
                key("model", &s.model).help("DeviceModelName, at most 31 characters"),
                key("serial", &s.serial).help("DeviceSerialNumber, at most 15 characters"),
                key("user_name", &s.user_name).help("DeviceUserID, at most 15 characters"),
                key("mac", &s.mac)
                    .help(
                        "Hardware address to show, like \"02:4f:00:00:00:01\"; "
                        "empty: the interface's own, or one made from the address where several cameras share an interface"),
                key("packet_size", &s.packet_size)
                    .unit("bytes")
                    .range(576, 16260)
                    .help("GevSCPSPacketSize after reset: "
                          "IP, UDP and GVSP headers and data; not above the interface's MTU"),
                key("heartbeat_timeout_ms", &s.heartbeat_timeout_ms)
                    .unit("ms")
                    .range(500, 600000)
                    .help("GevHeartbeatTimeout of a new controller"),
                key("heartbeat_timeout_max_ms", &s.heartbeat_timeout_max_ms)
                    .unit("ms")
                    .range(500, 86400000)
                    .help(
                        "Largest GevHeartbeatTimeout that a controller may set: for as long the camera stays locked when the controller vanishes"),
                key("history_frames", &s.history_frames)
                    .range(1, 64)
                    .help("Number of frames kept for packet resend"),
                key("truth_entries", &s.truth_entries)
                    .range(0, 4096)
                    .help(
                        "Room of the chunk TruthTable in entries of 160 bytes: where bodies, landmarks, stars, limbs and terminators are in the pixels of each frame (docs/truth.md); "
                        "0: none"),
                key("keep_alive_ms", &s.keep_alive_ms)
                    .unit("ms")
                    .range(0, 10000)
                    .help(
                        "Time within a frame after which, if rows are late, its newest packet is sent once more, so that receivers do not give the frame up; "
                        "0: never"),
                key("drop_percent", &s.drop_percent)
                    .unit("%")
                    .range(0, 100)
                    .help("Injected fault: share of payload packets withheld when first sent"),
                key("throughput_limit_mbit_s", &s.throughput_limit_mbit_s)
                    .unit("Mbit/s")
                    .range(0, 100000)
                    .help(
                        "DeviceLinkThroughputLimit after reset: the pace of the packets; 0: none, for receivers that keep up"),
                key("backend", &s.backend)
                    .help(
                        "How packets reach the kernel: batches, one by one, super-packets (UDP segmentation offload), or super-packets only towards a real network card"),
                key("allow", &s.allow)
                    .help(
                        "Hosts that may talk to the camera, like \"192.168.7.0/24, 192.168.8.4\"; empty: all on the link"),
                key("off_link", &s.off_link).help("Also answer hosts behind a router"),
                key("read_only", &s.read_only).help("Refuse control to all clients; they may read only"),
                key("xml", config::Path{&s.xml, true, true})
                    .help(
                        "GenICam file of a real camera, XML or a zip archive of it, that replaces the built-in description; "
                        "its features are bound by SFNC name; empty: built-in"),
                key("xml_values", &s.xml_values)
                    .help(
                        "With xml: values of other features after reset, like \"HeaterSetPoint=20, SerialText=FM-03\""),
                key("state_file", config::Path{&s.state_file, false, true})
                    .help("File in which user sets are kept; empty: in memory only"),
            },
        .lists = {config::list<FaultRule>(
            "faults", "Injected faults: each [[gige.faults]] is one rule, and all rules apply at once.",
            s.faults, section_of)},
        .check = [&s](const config::ReadTable& table) { check(s, table); },
    };
}

void check_against(const GigeSettings& s, const CameraFacts& camera, const config::ReadTable& table) {
    if (s.xml.empty() || s.xml_values.empty()) return;
    table.mistakes().collect([&] {
        if (const std::string why = explain_refused_values(s, camera); !why.empty())
            table.refuse("xml_values", why);
    });
}

std::vector<Identity> identities_of(const GigeSettings& s) {
    std::vector<Identity> all{
        {"interface", fmt::format("{}:{}", s.interface, s.port), s.interface, "address"},
        {"serial", s.serial, s.serial, "serial number"},
    };
    if (const auto mac = parse_mac(s.mac))
        all.push_back({"mac", fmt::format("{:012x}", *mac), s.mac, "hardware address"});
    if (!s.state_file.empty())
        all.push_back({"state_file", s.state_file, s.state_file, "file for user sets"});
    return all;
}

std::size_t frames_held_by(const GigeSettings& s) {
    return static_cast<std::size_t>(s.history_frames) + 2;
}

KeptTruth truth_wanted_by(const GigeSettings& s) {
    return {.scene_entries = static_cast<std::size_t>(s.truth_entries)};
}

bool acquisition_controlled_by(const GigeSettings& /*settings*/) {
    return true;
}

std::unique_ptr<Transport> make_transport(const GigeSettings& s, const TransportContext& context) {
    return std::make_unique<GigeCamera>(s, context.control, context.clock,
                                        GigeContext{.thread = context.transmit,
                                                    .seed = context.seed,
                                                    .ptp_status = context.ptp_status,
                                                    .control_listener = context.control_listener});
}

} // namespace obscura::transports::gige
