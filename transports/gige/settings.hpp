// SPDX-License-Identifier: Apache-2.0
// Settings of a GigE Vision camera: section [gige] with [[gige.faults]], their checks and the maker.
#pragma once

#include "transports/gige/wire/fault.hpp"
#include "transports/gige/wire/send_backend.hpp"
#include "transports/transport_settings.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports::gige {

/// Section [gige]: where the camera is found, what it says of itself, and how it sends.
struct GigeSettings {
    static constexpr std::string_view kind = "gige";

    bool enabled = true;
    std::string interface = "lo"; ///< interface name or one of its IPv4 addresses; any 127.x.y.z on loopback
    std::int32_t port = 3956;     ///< clients know no other
    std::string vendor = "Obscura", model = "Obscura-1", serial = "OBS000001", user_name;
    std::string mac; ///< hardware address to show, see parse_mac(); empty: the interface's own
    std::int32_t packet_size = 1500; ///< reset value of GevSCPSPacketSize; taken down to the interface's MTU
    std::int32_t heartbeat_timeout_ms = 3000;
    std::int32_t history_frames = 4; ///< frames kept for packet resend; each holds a frame of the pool
    double drop_percent = 0;         ///< fault: payload packets left out on purpose at first sending

    /// Reset value of DeviceLinkThroughputLimit. Receivers have room for a fraction of a frame, so a camera
    /// that sends faster than they read loses packets; a gigabit is what they are used to. 0: no limit.
    double throughput_limit_mbit_s = 1000;
    SendBackend backend = SendBackend::sendmmsg;
    std::string allow;      ///< hosts that may talk to the camera, see parse_ranges(); empty: all on the link
    bool off_link = false;  ///< also answer sources behind a router
    bool read_only = false; ///< no client gets control
    std::string xml;        ///< GenICam file of a real camera to be shown in place of our own; empty: our own
    std::string xml_values; ///< with `xml`: "Feature=value, ..." after reset
    std::string state_file; ///< where user sets are kept; empty: in memory only
    std::vector<FaultRule> faults; ///< beside drop_percent
};

/// "02:4f:00:00:00:01" as 48 bits; nothing for anything else, for group addresses and for zero.
[[nodiscard]] std::optional<std::uint64_t> parse_mac(std::string_view text);

/// One element of [[gige.faults]].
[[nodiscard]] config::Section section_of(FaultRule& rule);
/// The check reads the file `xml`, if there is one.
[[nodiscard]] config::Section section_of(GigeSettings& settings);
/// Address, serial number, hardware address and file for user sets.
[[nodiscard]] std::vector<Identity> identities_of(const GigeSettings& settings);
/// The history, the frame in work and one waiting.
[[nodiscard]] std::size_t frames_held_by(const GigeSettings& settings);
/// Always: clients start and stop it.
[[nodiscard]] bool acquisition_controlled_by(const GigeSettings& settings);
/// A GigeCamera, not started.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const GigeSettings& settings,
                                                        const TransportContext& context);

} // namespace obscura::transports::gige
