// SPDX-License-Identifier: Apache-2.0
// Wire format of GUD, the Generic USB Display protocol: plain data, encoders and validating decoders.
#pragma once

#include "core/camera/region.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// GUD version 1 as Linux's drivers/gpu/drm/gud defines it, host and device side. Little endian, packed.
/// Bytes come from a device (or, in the reference device, from a host) that may be broken or hostile: every
/// length is checked before it is used and every number is bounded. Decoders return an empty string, or the
/// reason why the bytes are refused, in which case their result is unspecified. Nothing here touches a
/// device.
namespace obscura::transports::gud {

constexpr std::uint16_t default_vendor_id = 0x1d50;
constexpr std::uint16_t default_product_id = 0x614d;
constexpr std::uint8_t protocol_version = 1;
constexpr std::uint32_t magic = 0x1d50614d;

/// bRequest of the vendor requests to the interface. `get_*` travel towards the host.
enum class Request : std::uint8_t {
    get_status = 0x00,
    get_descriptor = 0x01,
    get_formats = 0x40,
    get_properties = 0x41,
    get_connectors = 0x50,
    get_connector_properties = 0x51,
    get_tv_mode_values = 0x52,
    set_connector_force_detect = 0x53,
    get_connector_status = 0x54,
    get_connector_modes = 0x55,
    get_connector_edid = 0x56,
    set_buffer = 0x60,
    set_state_check = 0x61,
    set_state_commit = 0x62,
    set_controller_enable = 0x63,
    set_display_enable = 0x64,
    /// Obscura's extension, outside of what GUD and its kernel driver use; a plain device stalls it.
    get_frame_status = 0xC0,
};

/// The answer to get_status.
enum class Status : std::uint8_t {
    ok = 0,
    busy = 1,
    request_not_supported = 2,
    protocol_error = 3,
    invalid_parameter = 4,
    error = 5,
};
[[nodiscard]] std::string_view to_string(Status status);

enum class Format : std::uint8_t {
    r1 = 0x01,
    r8 = 0x08,
    xrgb1111 = 0x20,
    rgb332 = 0x30,
    rgb565 = 0x40,
    rgb888 = 0x50,
    xrgb8888 = 0x80,
    argb8888 = 0x81,
};
/// Name in GUD ("R8", "RGB888", ...); "0x.." for a format that GUD does not define.
[[nodiscard]] std::string to_string(Format format);
/// Bytes of one pixel; 0 for formats smaller than a byte and unknown ones.
[[nodiscard]] int bytes_per_pixel(Format format);

enum DescriptorFlag : std::uint32_t {
    status_on_set = 1u << 0, ///< the host asks for the status after every set request
    full_update = 1u << 1,   ///< the device takes whole frames only, without set_buffer
};
constexpr std::uint8_t compression_lz4 = 1u << 0;
constexpr std::uint32_t max_dimension = 16384; ///< largest width or height that this implementation accepts
constexpr std::uint64_t max_frame_bytes = 64u << 20;

/// get_descriptor, 30 bytes.
struct Descriptor {
    std::uint32_t flags = 0;
    std::uint8_t compression = 0;
    std::uint32_t max_buffer_size = 0; ///< bytes of one transfer before compression; 0: a whole frame
    std::uint32_t min_width = 0, max_width = 0, min_height = 0, max_height = 0;
};
constexpr std::size_t descriptor_size = 30;
[[nodiscard]] std::array<std::uint8_t, descriptor_size> encode(const Descriptor& descriptor);
[[nodiscard]] std::string decode(std::span<const std::uint8_t> bytes, Descriptor& descriptor);

/// One byte per format. Unknown formats are kept (a device may be newer than this code); duplicates and an
/// empty list are refused.
constexpr std::size_t max_formats = 32;
[[nodiscard]] std::string decode_formats(std::span<const std::uint8_t> bytes, std::vector<Format>& formats);

/// get_properties and get_connector_properties; unknown ids are legal.
struct Property {
    std::uint16_t id = 0;
    std::uint64_t value = 0;
};
constexpr std::size_t property_size = 10;
constexpr std::size_t max_properties = 32;
[[nodiscard]] std::string decode_properties(std::span<const std::uint8_t> bytes,
                                            std::vector<Property>& properties);

/// One entry of the answer to get_connectors.
struct Connector {
    /// 0 panel, 1 VGA, 2 composite, 3 S-video, 4 component, 5 DVI, 6 DisplayPort, 7 HDMI.
    std::uint8_t type = 0;
    std::uint32_t flags = 0;
};
constexpr std::size_t connector_size = 5;
constexpr std::size_t max_connectors = 32;
[[nodiscard]] std::array<std::uint8_t, connector_size> encode(const Connector& connector);
[[nodiscard]] std::string decode_connectors(std::span<const std::uint8_t> bytes,
                                            std::vector<Connector>& connectors);

/// The low two bits of get_connector_status; bit 7 reports a change.
enum class ConnectorStatus : std::uint8_t { disconnected = 0, connected = 1, unknown = 2 };
[[nodiscard]] std::string decode_connector_status(std::span<const std::uint8_t> bytes,
                                                  ConnectorStatus& status);

/// A display mode: dimensions in pixels, positions of the sync pulse after them. 24 bytes.
struct Mode {
    std::uint32_t clock_khz = 0;
    std::uint16_t hdisplay = 0, hsync_start = 0, hsync_end = 0, htotal = 0;
    std::uint16_t vdisplay = 0, vsync_start = 0, vsync_end = 0, vtotal = 0;
    std::uint32_t flags = 0;

    bool operator==(const Mode&) const = default;
    [[nodiscard]] bool preferred() const { return (flags & (1u << 10)) != 0; }
    /// Refresh rate in Hz; 0 if the mode does not define it.
    [[nodiscard]] double refresh_hz() const;
};
constexpr std::size_t mode_size = 24;
constexpr std::size_t max_modes = 128;
[[nodiscard]] std::array<std::uint8_t, mode_size> encode(const Mode& mode);
/// Modes without pixels or with negative blanking are refused; an empty list is legal.
[[nodiscard]] std::string decode_modes(std::span<const std::uint8_t> bytes, std::vector<Mode>& modes);
/// The detailed timings of an EDID base block, for devices that list no modes. VESA E-EDID A.2, section 3.10.
/// An empty EDID gives no modes.
constexpr std::size_t max_edid_size = 2048;
[[nodiscard]] std::string decode_edid_modes(std::span<const std::uint8_t> bytes, std::vector<Mode>& modes);

/// set_buffer: content of the bulk transfer that follows. 25 bytes.
struct SetBuffer {
    std::uint32_t x = 0, y = 0, width = 0, height = 0;
    std::uint32_t length = 0;            ///< bytes before compression
    std::uint8_t compression = 0;        ///< 0 or compression_lz4
    std::uint32_t compressed_length = 0; ///< bytes of the transfer if compressed, else 0

    [[nodiscard]] std::uint32_t transfer_length() const {
        return compression != 0 ? compressed_length : length;
    }
};
constexpr std::size_t set_buffer_size = 25;
[[nodiscard]] std::array<std::uint8_t, set_buffer_size> encode(const SetBuffer& buffer);
/// Device side: also checks the rectangle against a screen of `width` x `height` pixels in `format`.
[[nodiscard]] std::string decode(std::span<const std::uint8_t> bytes, std::uint32_t width,
                                 std::uint32_t height, Format format, SetBuffer& buffer);

/// set_state_check: mode requested by the host. 26 bytes and the properties.
struct State {
    Mode mode;
    Format format = Format::r8;
    std::uint8_t connector = 0;
};
constexpr std::size_t state_size = 26;
[[nodiscard]] std::array<std::uint8_t, state_size> encode(const State& state);
[[nodiscard]] std::string decode(std::span<const std::uint8_t> bytes, State& state,
                                 std::vector<Property>& properties);

/// get_frame_status, 36 bytes: Obscura's extension. Times are by the device's clock in ns; `now_ns` is the
/// time of the answer, so that a host can relate the clocks by the middle of the round trip.
struct FrameStatus {
    std::uint32_t received = 0; ///< updates received completely
    std::uint32_t shown = 0;    ///< updates shown on the screen
    std::uint32_t errors = 0;   ///< updates refused or broken
    std::uint64_t last_received_ns = 0;
    std::uint64_t last_shown_ns = 0;
    std::uint64_t now_ns = 0;
};
constexpr std::size_t frame_status_size = 36;
[[nodiscard]] std::array<std::uint8_t, frame_status_size> encode(const FrameStatus& status);
[[nodiscard]] std::string decode(std::span<const std::uint8_t> bytes, FrameStatus& status);

} // namespace obscura::transports::gud
