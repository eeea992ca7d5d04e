// SPDX-License-Identifier: Apache-2.0
// Numbers of the control protocol (GVCP): commands, flags, status codes and bootstrap register addresses.
#pragma once

#include <cstddef>
#include <cstdint>

namespace obscura::transports::gige {

constexpr std::uint16_t gvcp_port = 3956;
constexpr std::uint8_t gvcp_key = 0x42;
constexpr std::size_t gvcp_header_bytes = 8;
/// 576 bytes, which every IPv4 host accepts, less the headers of IP, UDP and GVCP.
constexpr std::size_t gvcp_max_payload = 540;
constexpr std::size_t gvcp_max_datagram = gvcp_header_bytes + gvcp_max_payload;
constexpr std::size_t gvcp_max_memory = 536; ///< data bytes of one READMEM or WRITEMEM

namespace gvcp_flag {
constexpr std::uint8_t ack_required = 0x01;
constexpr std::uint8_t extended_ids = 0x10;          ///< PACKETRESEND with 64-bit block ids
constexpr std::uint8_t broadcast_ack_allowed = 0x10; ///< DISCOVERY, FORCEIP
constexpr std::uint8_t scheduled = 0x80;             ///< ACTION with a time of execution
} // namespace gvcp_flag

/// Command codes; the acknowledge of a command is its code plus one.
enum class Command : std::uint16_t {
    discovery = 0x0002,
    force_ip = 0x0004,
    packet_resend = 0x0040,
    read_register = 0x0080,
    write_register = 0x0082,
    read_memory = 0x0084,
    write_memory = 0x0086,
    pending_ack = 0x0088, ///< only its acknowledge, 0x0089, exists
    event = 0x00C0,
    event_data = 0x00C2,
    action = 0x0100,
};

enum class Status : std::uint16_t {
    success = 0x0000,
    packet_resend = 0x0100, ///< GVSP standard header: this packet is sent again
    not_implemented = 0x8001,
    invalid_parameter = 0x8002,
    invalid_address = 0x8003,
    write_protect = 0x8004,
    bad_alignment = 0x8005,
    access_denied = 0x8006,
    busy = 0x8007,
    packet_unavailable = 0x800C,
    invalid_header = 0x800E,
    packet_not_yet_available = 0x8010,
    packet_removed = 0x8012,
    no_reference_time = 0x8013,
    overflow = 0x8015,
    action_late = 0x8016,
    error = 0x8FFF,
};

/// Status codes that a client has enabled in the GVCP configuration register: those added by versions 1.1 and
/// 2.0 of the protocol. Disabled ones are replaced by the codes used before.
struct StatusCodes {
    bool v1_1 = true, v2_0 = true;

    [[nodiscard]] constexpr Status shown(Status s) const noexcept {
        if (!v2_0 && (s == Status::packet_not_yet_available || s == Status::packet_removed))
            s = Status::packet_unavailable;
        if (!v2_0 && (s == Status::no_reference_time || s == Status::overflow || s == Status::action_late))
            return Status::error;
        if (!v1_1 && (s == Status::packet_unavailable || s == Status::invalid_header)) return Status::error;
        return s;
    }
};

/// Addresses of the bootstrap registers this device has.
namespace reg {
constexpr std::uint32_t version = 0x0000;
constexpr std::uint32_t device_mode = 0x0004;
constexpr std::uint32_t mac_high = 0x0008;
constexpr std::uint32_t mac_low = 0x000C;
constexpr std::uint32_t ip_options = 0x0010;
constexpr std::uint32_t ip_current = 0x0014;
constexpr std::uint32_t current_ip = 0x0024;
constexpr std::uint32_t current_mask = 0x0034;
constexpr std::uint32_t current_gateway = 0x0044;
constexpr std::uint32_t manufacturer = 0x0048;
constexpr std::uint32_t model = 0x0068;
constexpr std::uint32_t device_version = 0x0088;
constexpr std::uint32_t manufacturer_info = 0x00A8;
constexpr std::uint32_t serial = 0x00D8;
constexpr std::uint32_t user_name = 0x00E8;
/// A DISCOVERY acknowledge holds the registers below this address.
constexpr std::uint32_t discovery_bytes = 0x00F8;
constexpr std::uint32_t xml_url_first = 0x0200;
constexpr std::uint32_t xml_url_second = 0x0400;
constexpr std::uint32_t interface_count = 0x0600;
constexpr std::uint32_t persistent_ip = 0x064C;
constexpr std::uint32_t persistent_mask = 0x065C;
constexpr std::uint32_t persistent_gateway = 0x066C;
constexpr std::uint32_t link_speed = 0x0670;
constexpr std::uint32_t message_channels = 0x0900;
constexpr std::uint32_t stream_channels = 0x0904;
constexpr std::uint32_t action_signals = 0x0908;
constexpr std::uint32_t action_device_key = 0x090C;
constexpr std::uint32_t active_links = 0x0910;
constexpr std::uint32_t gvsp_capability = 0x092C;
constexpr std::uint32_t message_capability = 0x0930;
constexpr std::uint32_t gvcp_capability = 0x0934;
constexpr std::uint32_t heartbeat_timeout = 0x0938;
constexpr std::uint32_t tick_frequency_high = 0x093C;
constexpr std::uint32_t tick_frequency_low = 0x0940;
constexpr std::uint32_t timestamp_control = 0x0944;
constexpr std::uint32_t timestamp_high = 0x0948;
constexpr std::uint32_t timestamp_low = 0x094C;
constexpr std::uint32_t discovery_ack_delay = 0x0950;
constexpr std::uint32_t gvcp_configuration = 0x0954;
constexpr std::uint32_t pending_timeout = 0x0958;
constexpr std::uint32_t switchover_key = 0x095C;
constexpr std::uint32_t gvsp_configuration = 0x0960;
constexpr std::uint32_t link_capability = 0x0964;
constexpr std::uint32_t link_configuration = 0x0968;
constexpr std::uint32_t ptp_status = 0x096C; // IEEE 1588
constexpr std::uint32_t ptp_extended_capability = 0x0974;
constexpr std::uint32_t ptp_supported_profiles = 0x0978;
constexpr std::uint32_t ptp_selected_profile = 0x097C;
constexpr std::uint32_t control_privilege = 0x0A00;
constexpr std::uint32_t primary_port = 0x0A04;
constexpr std::uint32_t primary_ip = 0x0A14;
constexpr std::uint32_t action_queue_size = 0x0970;
constexpr std::uint32_t message_port = 0x0B00;         // MCP
constexpr std::uint32_t message_destination = 0x0B10;  // MCDA
constexpr std::uint32_t message_timeout = 0x0B14;      // MCTT
constexpr std::uint32_t message_retries = 0x0B18;      // MCRC
constexpr std::uint32_t message_source_port = 0x0B1C;  // MCSP
constexpr std::uint32_t stream_port = 0x0D00;          // SCP
constexpr std::uint32_t stream_packet_size = 0x0D04;   // SCPS
constexpr std::uint32_t stream_packet_delay = 0x0D08;  // SCPD
constexpr std::uint32_t stream_destination = 0x0D18;   // SCDA
constexpr std::uint32_t stream_source_port = 0x0D1C;   // SCSP
constexpr std::uint32_t stream_capability = 0x0D20;    // SCC
constexpr std::uint32_t stream_configuration = 0x0D24; // SCCFG
constexpr std::uint32_t manifest = 0x9000;
constexpr std::uint32_t action_groups = 0x9800; ///< 16 bytes each: key, mask
} // namespace reg

/// DeviceMode (reg::device_mode): class transmitter is 0.
namespace device_mode {
constexpr std::uint32_t big_endian = 0x80000000;
constexpr std::uint32_t utf_8 = 0x00000001;
} // namespace device_mode

/// Sources of the IP address: supported ones in reg::ip_options, enabled ones in reg::ip_current.
namespace ip_configuration {
constexpr std::uint32_t persistent = 0x1;
constexpr std::uint32_t link_local = 0x4;
} // namespace ip_configuration

/// Optional functions of the device (reg::gvcp_capability).
namespace gvcp_capability {
constexpr std::uint32_t user_name = 0x80000000;
constexpr std::uint32_t serial_number = 0x40000000;
constexpr std::uint32_t link_speed = 0x10000000;
constexpr std::uint32_t primary_application = 0x08000000; ///< port and address registers
constexpr std::uint32_t status_codes_1_1 = 0x00400000;
constexpr std::uint32_t switchover = 0x00200000;
constexpr std::uint32_t unconditional_action = 0x00100000;
constexpr std::uint32_t ieee1588 = 0x00080000;
constexpr std::uint32_t status_codes_2_0 = 0x00040000;
constexpr std::uint32_t scheduled_action = 0x00020000;
constexpr std::uint32_t ieee1588_extended = 0x00010000;
constexpr std::uint32_t action = 0x00000040;
constexpr std::uint32_t pending_ack = 0x00000020;
constexpr std::uint32_t event = 0x00000008;
constexpr std::uint32_t packet_resend = 0x00000004;
constexpr std::uint32_t write_memory = 0x00000002;
constexpr std::uint32_t concatenation = 0x00000001; ///< of several reads or writes in one command
} // namespace gvcp_capability

/// Optional functions that are enabled (reg::gvcp_configuration).
namespace gvcp_configuration {
constexpr std::uint32_t ieee1588 = 0x00080000;
constexpr std::uint32_t status_codes_2_0 = 0x00040000;
constexpr std::uint32_t unconditional_action = 0x00000008;
constexpr std::uint32_t status_codes_1_1 = 0x00000004;
constexpr std::uint32_t pending_ack = 0x00000002;
} // namespace gvcp_configuration

/// Optional functions of all stream channels (reg::gvsp_capability), and those that are enabled
/// (reg::gvsp_configuration).
namespace gvsp_capability {
constexpr std::uint32_t source_port = 0x80000000; ///< reg::stream_source_port
constexpr std::uint32_t short_block_ids = 0x40000000;
} // namespace gvsp_capability
namespace gvsp_configuration {
constexpr std::uint32_t extended_ids = 0x40000000;
} // namespace gvsp_configuration

/// Optional functions of all message channels (reg::message_capability).
namespace message_capability {
constexpr std::uint32_t source_port = 0x80000000; ///< reg::message_source_port
} // namespace message_capability

/// reg::link_capability.
namespace link_capability {
constexpr std::uint32_t single_link = 1;
} // namespace link_capability

/// reg::ptp_extended_capability and reg::ptp_supported_profiles.
namespace ptp_capability {
constexpr std::uint32_t profile_registers = 0x80000000;
constexpr std::uint32_t default_profile = 0x80000000; ///< of IEEE 1588
} // namespace ptp_capability

/// Bits of the timestamp control register.
namespace timestamp_control {
constexpr std::uint32_t reset = 1;
constexpr std::uint32_t latch = 2;
} // namespace timestamp_control

/// Bits of reg::stream_packet_size above the size itself (SCPS).
namespace scps {
constexpr std::uint32_t fire_test_packet = 0x80000000;
constexpr std::uint32_t do_not_fragment = 0x40000000;
} // namespace scps

/// reg::stream_capability and reg::stream_configuration (SCC, SCCFG).
namespace sccfg {
constexpr std::uint32_t multipart = 0x40;
constexpr std::uint32_t chunk_in_image = 0x01;
} // namespace sccfg

/// Bits of the control channel privilege register.
namespace privilege {
constexpr std::uint32_t exclusive = 1;
constexpr std::uint32_t control = 2;
constexpr std::uint32_t switchover_enable = 4;
} // namespace privilege

} // namespace obscura::transports::gige
