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

/// Section [gige]: network address, identity, stream and injected faults of the camera.
struct GigeSettings {
    static constexpr std::string_view kind = "gige";

    bool enabled = true;
    /// Interface name or one of its IPv4 addresses; any 127.x.y.z on loopback.
    std::string interface = "lo";
    std::int32_t port = 3956; ///< clients look for cameras on no other
    std::string vendor = "Obscura", model = "Obscura-1", serial = "OBS000001", user_name;
    std::string mac; ///< shown, see parse_mac(); empty: the interface's own
    /// Reset value of GevSCPSPacketSize; reduced to the interface's MTU.
    std::int32_t packet_size = 1500;
    std::int32_t heartbeat_timeout_ms = 3000;
    std::int32_t heartbeat_timeout_max_ms = 60'000;
    std::int32_t history_frames = 4; ///< frames of the pool kept for packet resend
    /// Room of the chunk TruthTable; above 0 frames carry truth tables.
    std::int32_t truth_entries = 0;
    /// Silence within a block after which its newest packet is sent again; 0: never. The default is half the
    /// packet timeout of Aravis: after that it asks for everything that is missing, after 100 ms it gives the
    /// block up.
    double keep_alive_ms = 10;
    double drop_percent = 0; ///< fault: payload packets withheld at first sending

    /// Reset value of DeviceLinkThroughputLimit. Receivers buffer a fraction of a frame, so packets are lost
    /// when the camera sends faster than they read; they are made for a gigabit link. 0: no limit.
    double throughput_limit_mbit_s = 1000;
    SendBackend backend = SendBackend::sendmmsg;
    /// Hosts whose requests are answered, see parse_address_ranges(); empty: all on the link.
    std::string allow;
    bool off_link = false;  ///< also answer sources behind a router
    bool read_only = false; ///< no client gets control
    /// GenICam file of a real camera that replaces the built-in description; empty: built-in.
    std::string xml;
    std::string xml_values;        ///< with `xml`: "Feature=value, ..." after reset
    std::string state_file;        ///< file of the user sets; empty: in memory only
    std::vector<FaultRule> faults; ///< in addition to drop_percent
};

/// "02:4f:00:00:00:01" as 48 bits; no value for any other text, for group addresses and for zero.
[[nodiscard]] std::optional<std::uint64_t> parse_mac(std::string_view text);

/// One element of [[gige.faults]].
[[nodiscard]] config::Section section_of(FaultRule& rule);
/// Section bound to `settings`. Its check reads the file `xml` unless that is empty.
[[nodiscard]] config::Section section_of(GigeSettings& settings);
/// Checks that the features of the file `xml` take `xml_values` on this camera.
void check_against(const GigeSettings& settings, const CameraFacts& camera, const config::ReadTable& table);
/// Address, serial number, hardware address and file for user sets.
[[nodiscard]] std::vector<Identity> identities_of(const GigeSettings& settings);
/// The history, the frame being sent and one waiting.
[[nodiscard]] std::size_t frames_held_by(const GigeSettings& settings);
/// A truth table of truth_entries, if above 0.
[[nodiscard]] KeptTruth truth_wanted_by(const GigeSettings& settings);
/// True: clients start and stop the acquisition.
[[nodiscard]] bool acquisition_controlled_by(const GigeSettings& settings);
/// A GigeCamera, not started.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const GigeSettings& settings,
                                                        const TransportContext& context);

} // namespace obscura::transports::gige
