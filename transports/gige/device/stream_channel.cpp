// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/stream_channel.hpp"

#include "transports/gige/device/accessors.hpp"
#include "transports/gige/device/regions.hpp"

namespace obscura::transports::gige {
namespace {

/// How long AcquisitionStop waits for the block in progress.
constexpr std::int64_t stop_timeout_ns = 2 * ns_per_s;

} // namespace

bool multipart(const DeviceContext& d) {
    return (d.bank.peek(reg::stream_configuration) & sccfg::multipart) != 0;
}

std::uint32_t chunk_selection(const DeviceContext& d) {
    std::uint32_t selection = 0;
    if (stored(d, "ChunkModeActive") != 0)
        for (std::uint32_t i = 0; i < chunk_count; ++i)
            selection |= stored(d, "ChunkEnable", i) << i;
    return selection;
}

StatusCodes status_codes(const DeviceContext& d) {
    const std::uint32_t wanted = d.bank.peek(reg::gvcp_configuration);
    return {(wanted & gvcp_configuration::status_codes_1_1) != 0,
            (wanted & gvcp_configuration::status_codes_2_0) != 0};
}

StreamConfig stream_config(const DeviceContext& d) {
    StreamConfig c;
    c.status_codes = status_codes(d);
    c.destination_ip = d.bank.peek(reg::stream_destination);
    if (c.destination_ip == 0) c.destination_ip = d.controller_ip;
    c.destination_port = static_cast<std::uint16_t>(d.bank.peek(reg::stream_port));
    const std::uint32_t packet_size = d.bank.peek(reg::stream_packet_size);
    c.packet_size = packet_size & 0xFFFF;
    c.do_not_fragment = (packet_size & scps::do_not_fragment) != 0;
    const std::uint32_t configuration = d.bank.peek(reg::stream_configuration);
    c.payload.multipart = (configuration & sccfg::multipart) != 0;
    c.chunk_in_image = (configuration & sccfg::chunk_in_image) != 0;
    // The standard headers have no room for the number of parts.
    c.extended_ids =
        c.payload.multipart || (d.bank.peek(reg::gvsp_configuration) & gvsp_configuration::extended_ids) != 0;
    c.packet_delay_ns = d.bank.peek(reg::stream_packet_delay);
    if (stored(d, "DeviceLinkThroughputLimitMode") != 0)
        c.throughput_limit = stored(d, "DeviceLinkThroughputLimit");
    c.payload.timestamp_origin_ns = d.timestamp_origin_ns;
    c.payload.chunks = chunk_selection(d);
    c.payload.binning = d.binning;
    c.payload.truth_entries = static_cast<std::uint32_t>(d.settings.truth_entries);
    for (std::uint32_t i = 0, request = 0; i < region_count(d); ++i)
        if (i == 0 || d.regions[i].enabled) c.payload.regions[request++] = static_cast<std::uint8_t>(i);
    c.faults = d.faults;
    const PixelFormat format = d.control.settings().pixel_format;
    // Frames hold 16-bit words; these formats send them unchanged, unless the ADC is deeper.
    const int format_bits = format == PixelFormat::mono10   ? 10
                            : format == PixelFormat::mono12 ? 12
                            : format == PixelFormat::mono14 ? 14
                            : format == PixelFormat::mono16 ? 16
                                                            : 0;
    c.payload.packs_pixels = d.limits.adc_bits > format_bits;
    c.payload.max_width = d.limits.sensor_width;
    c.payload.max_height = d.limits.rows_max > 0 ? d.limits.rows_max : d.limits.sensor_height;
    c.payload.max_image_bytes = std::size_t{2} * static_cast<std::size_t>(c.payload.max_width) *
                                static_cast<std::size_t>(c.payload.max_height);
    return c;
}

Status acquisition_start(DeviceContext& d) {
    if (d.control.acquiring()) return Status::success; // SFNC: starting twice changes nothing
    // Receivers take a block id lower than the last for a late packet, so ids continue as long as the channel
    // stays open.
    StreamConfig config = stream_config(d);
    config.continue_blocks = !d.channel_fresh;
    if (!d.stream.begin(config)) return Status::busy;
    d.channel_fresh = false;
    if (d.control.acquisition_start()) return Status::success;
    d.stream.abort();
    return Status::busy;
}

Status acquisition_stop(DeviceContext& d) {
    // Wait for the current block to leave before the answer: its remaining packets would reach the port of
    // the next stream, whose receiver would then take every new block for a late one.
    d.stream.abort();
    d.control.acquisition_stop(true);
    return d.stream.wait_idle(stop_timeout_ns) ? Status::success : Status::busy;
}

Status check_destination(const DeviceContext& d, std::uint32_t ip) {
    const bool good = ip == 0 || ip == d.controller_ip || d.network.on_link(ip) || is_multicast(ip);
    return good ? Status::success : Status::invalid_parameter;
}

Status write_stream_port(DeviceContext& d, std::uint32_t value) {
    // Bits 16-19 number the network interface; there is one.
    if (value > 0xFFFF) return Status::invalid_parameter;
    if (value == d.bank.peek(reg::stream_port)) return Status::success;
    const bool acquiring = d.control.acquiring();
    if (acquiring) {
        d.stream.abort();
        if (value == 0) {
            d.control.acquisition_stop(true);
            d.stream.wait_idle(stop_timeout_ns);
        }
    }
    d.bank.poke(reg::stream_port, value);
    d.channel_fresh = true;
    if (acquiring && value != 0 && !d.stream.begin(stream_config(d))) return Status::busy;
    return Status::success;
}

Status write_packet_size(DeviceContext& d, std::uint32_t value) {
    const std::uint32_t size = value & 0xFFFF;
    const std::uint32_t flags = value & ~0xFFFFU;
    const std::uint32_t kept = d.bank.peek(reg::stream_packet_size);
    if ((flags & ~(scps::fire_test_packet | scps::do_not_fragment)) != 0) return Status::invalid_parameter;
    if (size < packet_size_min || size > d.packet_size_max || size % 4 != 0) return Status::invalid_parameter;
    if (d.control.acquiring() && (value & ~scps::fire_test_packet) != kept) return Status::write_protect;
    d.bank.poke(reg::stream_packet_size, value & ~scps::fire_test_packet);
    if ((flags & scps::fire_test_packet) != 0) {
        const StreamConfig config = stream_config(d);
        if (config.destination_port != 0 && config.destination_ip != 0) d.stream.send_test_packet(config);
    }
    return Status::success;
}

} // namespace obscura::transports::gige
