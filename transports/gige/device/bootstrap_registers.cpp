// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/bootstrap_registers.hpp"

#include "transports/gige/device/action_queue.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/device/stream_channel.hpp"
#include "transports/gige/device/user_sets.hpp"

#include <algorithm>
#include <string_view>

namespace obscura::transports::gige {
namespace {

/// DeviceVersion.
constexpr const char* device_version = OBSCURA_VERSION;
constexpr std::uint32_t ns_ticks_per_s = 1'000'000'000;

void constant(DeviceContext& d, std::string_view name, std::uint32_t address, std::uint32_t value) {
    d.bank.add({.name = name, .address = address, .reset = value});
}

void reserved(DeviceContext& d, std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t a = from; a < to; a += 4)
        constant(d, "Reserved", a, 0);
}

void add_identity(DeviceContext& d) {
    constant(d, "Version", reg::version, 0x00020000);
    constant(d, "DeviceMode", reg::device_mode, device_mode::big_endian | device_mode::utf_8);
    const auto text = [&d](std::string_view name, std::string_view value) -> Register& {
        const Feature& f = feature(name);
        return d.bank.add_string(f.name, f.address, f.bytes, f.access, value);
    };
    text("DeviceVendorName", d.settings.vendor);
    text("DeviceModelName", d.settings.model);
    text("DeviceVersion", device_version);
    text("DeviceManufacturerInfo", "Camera emulator");
    text("DeviceSerialNumber", d.settings.serial);
    text("DeviceUserID", d.settings.user_name).written = [&d] { d.state_changed = true; };
}

void add_network(DeviceContext& d) {
    constant(d, "MACHigh", reg::mac_high, static_cast<std::uint32_t>(d.network.mac >> 32));
    constant(d, "MACLow", reg::mac_low, static_cast<std::uint32_t>(d.network.mac));
    // The host's own configuration decides; to GVCP that looks like a persistent address.
    constexpr std::uint32_t host_decides = ip_configuration::link_local | ip_configuration::persistent;
    constant(d, "IPOptions", reg::ip_options, host_decides);
    constant(d, "IPCurrent", reg::ip_current, host_decides);
    reserved(d, 0x18, reg::current_ip);
    constant(d, "CurrentIPAddress", reg::current_ip, d.network.address);
    reserved(d, 0x28, reg::current_mask);
    constant(d, "CurrentSubnetMask", reg::current_mask, d.network.mask);
    reserved(d, 0x38, reg::current_gateway);
    constant(d, "CurrentDefaultGateway", reg::current_gateway, 0);
    constant(d, "InterfaceCount", reg::interface_count, 1);
    reserved(d, 0x640, reg::persistent_ip);
    constant(d, "PersistentIPAddress", reg::persistent_ip, d.network.address);
    reserved(d, 0x650, reg::persistent_mask);
    constant(d, "PersistentSubnetMask", reg::persistent_mask, d.network.mask);
    reserved(d, 0x660, reg::persistent_gateway);
    constant(d, "PersistentDefaultGateway", reg::persistent_gateway, 0);
    constant(d, "LinkSpeed", reg::link_speed, d.network.speed_mbit_s);
}

Status write_gvcp_configuration(DeviceContext& d, std::uint32_t value) {
    using namespace gvcp_configuration;
    constexpr std::uint32_t choices =
        pending_ack | status_codes_1_1 | unconditional_action | status_codes_2_0;
    // The configuration, not the client, enables PTP: a daemon outside this process steers the clock.
    if ((value & ~choices) != (d.ptp ? ieee1588 : 0U)) return Status::invalid_parameter;
    d.bank.poke(reg::gvcp_configuration, value);
    return Status::success;
}

void add_capabilities(DeviceContext& d) {
    constant(d, "MessageChannelCount", reg::message_channels, 1);
    constant(d, "StreamChannelCount", reg::stream_channels, 1);
    constant(d, "ActionSignalCount", reg::action_signals, action_group_count);
    constant(d, "ActiveLinkCount", reg::active_links, 1);
    constant(d, "StreamCapability", reg::gvsp_capability,
             gvsp_capability::source_port | gvsp_capability::short_block_ids);
    constant(d, "MessageCapability", reg::message_capability, message_capability::source_port);
    d.bank.add({.name = "GVCPCapability", .address = reg::gvcp_capability, .read = [&d] {
                    using namespace gvcp_capability;
                    constexpr std::uint32_t always =
                        user_name | serial_number | link_speed | primary_application | status_codes_1_1 |
                        switchover | unconditional_action | status_codes_2_0 | scheduled_action | action |
                        pending_ack | event | packet_resend | write_memory | concatenation;
                    return always | (d.ptp ? ieee1588 | ieee1588_extended : 0U);
                }});
    constant(d, "GevTimestampTickFrequencyHigh", reg::tick_frequency_high, 0);
    constant(d, "GevTimestampTickFrequency", reg::tick_frequency_low, ns_ticks_per_s);
    constant(d, "DiscoveryAckDelay", reg::discovery_ack_delay, 0);
    d.bank.add({.name = "GVCPConfiguration",
                .address = reg::gvcp_configuration,
                .access = Access::read_write,
                .reset = gvcp_configuration::pending_ack | gvcp_configuration::status_codes_1_1 |
                         gvcp_configuration::status_codes_2_0,
                .read =
                    [&d] {
                        return d.bank.peek(reg::gvcp_configuration) |
                               (d.ptp ? gvcp_configuration::ieee1588 : 0U);
                    },
                .write = [&d](std::uint32_t value) { return write_gvcp_configuration(d, value); }});
    constant(d, "PhysicalLinkCapability", reg::link_capability, link_capability::single_link);
    constexpr std::uint32_t single_link_configuration = 0;
    constant(d, "PhysicalLinkConfiguration", reg::link_configuration, single_link_configuration);

    constant(d, "ScheduledActionQueueSize", reg::action_queue_size, DeviceContext::action_queue_size);
    constant(d, "PendingTimeout", reg::pending_timeout, 1000);
    d.bank.add({.name = "GevGVSPExtendedIDMode",
                .address = reg::gvsp_configuration,
                .access = Access::read_write,
                .locked_while_streaming = true,
                .write = [&d](std::uint32_t value) {
                    if ((value & ~gvsp_configuration::extended_ids) != 0) return Status::invalid_parameter;
                    d.bank.poke(reg::gvsp_configuration, value);
                    return Status::success;
                }});
    constant(d, "ManifestTable", reg::manifest, 0);
}

Status write_timestamp_control(DeviceContext& d, std::uint32_t value) {
    using namespace timestamp_control;
    if (value == 0 || (value & ~(reset | latch)) != 0) return Status::invalid_parameter;
    if ((value & reset) != 0 && d.control.acquiring()) return Status::write_protect;
    const Time now = d.clock.now();
    if ((value & latch) != 0) d.timestamp_latched = device_time(d, now);
    if ((value & reset) != 0) d.timestamp_origin_ns = now.ns + d.clock.tai_offset_ns();
    return Status::success;
}

void add_timestamps(DeviceContext& d) {
    d.bank.add({.name = "GevTimestampControl",
                .address = reg::timestamp_control,
                .access = Access::write_only,
                .write = [&d](std::uint32_t value) { return write_timestamp_control(d, value); }});
    d.bank.add({.name = "GevTimestampValueHigh", .address = reg::timestamp_high, .read = [&d] {
                    return static_cast<std::uint32_t>(d.timestamp_latched >> 32);
                }});
    d.bank.add({.name = "GevTimestampValueLow", .address = reg::timestamp_low, .read = [&d] {
                    return static_cast<std::uint32_t>(d.timestamp_latched);
                }});
}

Status write_stream_configuration(DeviceContext& d, std::uint32_t value) {
    if ((value & ~(sccfg::multipart | sccfg::chunk_in_image)) != 0) return Status::invalid_parameter;
    if ((value & sccfg::multipart) != 0 && d.binning.active()) return Status::write_protect;
    d.bank.poke(reg::stream_configuration, value);
    return Status::success;
}

void add_stream(DeviceContext& d) {
    d.bank.add({.name = "GevSCPHostPort",
                .address = reg::stream_port,
                .access = Access::read_write,
                .write = [&d](std::uint32_t value) { return write_stream_port(d, value); }});
    const auto initial =
        std::clamp(static_cast<std::uint32_t>(d.settings.packet_size), packet_size_min, d.packet_size_max);
    d.bank.add({.name = "GevSCPSPacketSize",
                .address = reg::stream_packet_size,
                .access = Access::read_write,
                .reset = scps::do_not_fragment | initial / 4 * 4,
                .write = [&d](std::uint32_t value) { return write_packet_size(d, value); }});
    d.bank.add({.name = "GevSCPD",
                .address = reg::stream_packet_delay,
                .access = Access::read_write,
                .locked_while_streaming = true,
                .saved = true,
                .maximum = largest_word(feature("GevSCPD"))});
    reserved(d, 0xD0C, reg::stream_destination);
    d.bank.add({.name = "GevSCDA",
                .address = reg::stream_destination,
                .access = Access::read_write,
                .locked_while_streaming = true,
                .write = [&d](std::uint32_t ip) {
                    if (check_destination(d, ip) != Status::success) return Status::invalid_parameter;
                    d.bank.poke(reg::stream_destination, ip);
                    return Status::success;
                }});
    d.bank.add({.name = "GevSCSP", .address = reg::stream_source_port, .read = [&d] {
                    return std::uint32_t{d.stream.source_port()};
                }});
    constant(d, "GevSCC", reg::stream_capability, sccfg::multipart | sccfg::chunk_in_image);
    d.bank.add({.name = "GevSCCFG",
                .address = reg::stream_configuration,
                .access = Access::read_write,
                .locked_while_streaming = true,
                .reset = sccfg::chunk_in_image,
                .write = [&d](std::uint32_t value) { return write_stream_configuration(d, value); }});
}

void add_messages(DeviceContext& d) {
    const auto channel = [&d](std::string_view name, std::uint32_t address, std::uint32_t reset,
                              std::uint32_t maximum) {
        d.bank.add({.name = name,
                    .address = address,
                    .access = Access::read_write,
                    .reset = reset,
                    .maximum = maximum,
                    .written = [&d] { configure_messages(d); }});
    };
    channel("GevMCPHostPort", reg::message_port, 0, 0xFFFF);
    reserved(d, reg::message_port + 4, reg::message_destination);
    d.bank.add({.name = "GevMCDA",
                .address = reg::message_destination,
                .access = Access::read_write,
                .write =
                    [&d](std::uint32_t ip) {
                        if (check_destination(d, ip) != Status::success || is_multicast(ip))
                            return Status::invalid_parameter;
                        d.bank.poke(reg::message_destination, ip);
                        return Status::success;
                    },
                .written = [&d] { configure_messages(d); }});
    channel("GevMCTT", reg::message_timeout, 300, 10'000);
    channel("GevMCRC", reg::message_retries, 3, 10);
    d.bank.add({.name = "GevMCSP", .address = reg::message_source_port, .read = [&d] {
                    return std::uint32_t{d.messages.source_port()};
                }});
}

void add_actions(DeviceContext& d) {
    d.bank.add({.name = "ActionDeviceKey", .address = reg::action_device_key, .access = Access::read_write});
    for (std::uint32_t i = 0; i < action_group_count; ++i) {
        const std::uint32_t base = reg::action_groups + 16 * i;
        d.bank.add({.name = "ActionGroupKey", .address = base, .access = Access::read_write});
        d.bank.add({.name = "ActionGroupMask", .address = base + 4, .access = Access::read_write});
    }
}

void add_ptp(DeviceContext& d) {
    d.bank.add({.name = "GevIEEE1588Status", .address = reg::ptp_status, .read = [&d] {
                    return static_cast<std::uint32_t>(d.ptp ? d.ptp().state : PtpState::disabled);
                }});
    const auto add_with_ptp = [&d](std::string_view name, std::uint32_t address, std::uint32_t value) {
        d.bank.add({.name = name, .address = address, .read = [&d, value] { return d.ptp ? value : 0U; }});
    };
    add_with_ptp("GevIEEE1588ExtendedCapability", reg::ptp_extended_capability,
                 ptp_capability::profile_registers);
    add_with_ptp("GevIEEE1588SupportedProfiles", reg::ptp_supported_profiles,
                 ptp_capability::default_profile);
    constant(d, "GevIEEE1588SelectedProfile", reg::ptp_selected_profile, 0);
}

} // namespace

void configure_messages(DeviceContext& d) {
    MessageConfig c;
    c.destination_port = static_cast<std::uint16_t>(d.bank.peek(reg::message_port));
    c.destination_ip = d.bank.peek(reg::message_destination);
    if (c.destination_ip == 0) c.destination_ip = d.controller_ip;
    c.timeout_ms = d.bank.peek(reg::message_timeout);
    c.retries = d.bank.peek(reg::message_retries);
    d.messages.configure(c);
}

void add_bootstrap_registers(DeviceContext& d) {
    add_identity(d);
    add_network(d);
    add_capabilities(d);
    add_timestamps(d);
    add_stream(d);
    add_messages(d);
    add_actions(d);
    add_ptp(d);
}

} // namespace obscura::transports::gige
