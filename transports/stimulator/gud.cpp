// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/gud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <concepts>
#include <numeric>

namespace obscura::transports::gud {
namespace {

/// Encoder of consecutive little-endian integers.
class Writer {
public:
    explicit Writer(std::span<std::uint8_t> out) : out_(out) {}
    template<std::unsigned_integral T>
    Writer& put(T value) {
        assert(at_ + sizeof(T) <= out_.size());
        for (std::size_t i = 0; i < sizeof(T); ++i)
            out_[at_++] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
        return *this;
    }
    [[nodiscard]] bool full() const { return at_ == out_.size(); }

private:
    std::span<std::uint8_t> out_;
    std::size_t at_ = 0;
};

/// Decoder of consecutive little-endian integers; the caller has checked the length.
class Reader {
public:
    explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
    template<std::unsigned_integral T>
    Reader& get(T& value) {
        assert(at_ + sizeof(T) <= bytes_.size());
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < sizeof(T); ++i)
            sum |= static_cast<std::uint64_t>(bytes_[at_++]) << (8 * i);
        value = static_cast<T>(sum);
        return *this;
    }

private:
    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 0;
};

std::string explain_length(std::string_view what, std::size_t got, std::size_t wanted) {
    return got == wanted ? std::string() : fmt::format("{} has {} bytes instead of {}", what, got, wanted);
}

/// Checks the size of a list of records of `record` bytes each.
std::string explain_list(std::string_view what, std::size_t got, std::size_t record, std::size_t most) {
    if (got % record != 0)
        return fmt::format("{} has {} bytes, which is no multiple of {}", what, got, record);
    if (got / record > most) return fmt::format("{} has {} entries, more than {}", what, got / record, most);
    return {};
}

void put_mode(Writer& out, const Mode& m) {
    out.put(m.clock_khz).put(m.hdisplay).put(m.hsync_start).put(m.hsync_end).put(m.htotal);
    out.put(m.vdisplay).put(m.vsync_start).put(m.vsync_end).put(m.vtotal).put(m.flags);
}

void get_mode(Reader& in, Mode& m) {
    in.get(m.clock_khz).get(m.hdisplay).get(m.hsync_start).get(m.hsync_end).get(m.htotal);
    in.get(m.vdisplay).get(m.vsync_start).get(m.vsync_end).get(m.vtotal).get(m.flags);
}

std::string explain_mode(const Mode& m) {
    if (m.hdisplay == 0 || m.vdisplay == 0)
        return fmt::format("mode of {}x{} pixels", m.hdisplay, m.vdisplay);
    if (m.hdisplay > max_dimension || m.vdisplay > max_dimension)
        return fmt::format("mode of {}x{} pixels, more than {} a side", m.hdisplay, m.vdisplay,
                           max_dimension);
    const bool ordered = m.hdisplay <= m.hsync_start && m.hsync_start <= m.hsync_end &&
                         m.hsync_end <= m.htotal && m.vdisplay <= m.vsync_start &&
                         m.vsync_start <= m.vsync_end && m.vsync_end <= m.vtotal;
    if (!ordered)
        return fmt::format("mode of {}x{} pixels with sync pulses out of order", m.hdisplay, m.vdisplay);
    return {};
}

} // namespace

std::string_view to_string(Status status) {
    switch (status) {
    case Status::ok:
        return "ok";
    case Status::busy:
        return "busy";
    case Status::request_not_supported:
        return "request not supported";
    case Status::protocol_error:
        return "protocol error";
    case Status::invalid_parameter:
        return "invalid parameter";
    case Status::error:
        return "error";
    }
    return "unknown status";
}

std::string to_string(Format format) {
    switch (format) {
    case Format::r1:
        return "R1";
    case Format::r8:
        return "R8";
    case Format::xrgb1111:
        return "XRGB1111";
    case Format::rgb332:
        return "RGB332";
    case Format::rgb565:
        return "RGB565";
    case Format::rgb888:
        return "RGB888";
    case Format::xrgb8888:
        return "XRGB8888";
    case Format::argb8888:
        return "ARGB8888";
    }
    return fmt::format("0x{:02x}", static_cast<unsigned>(format));
}

int bytes_per_pixel(Format format) {
    switch (format) {
    case Format::r8:
    case Format::rgb332:
        return 1;
    case Format::rgb565:
        return 2;
    case Format::rgb888:
        return 3;
    case Format::xrgb8888:
    case Format::argb8888:
        return 4;
    case Format::r1:
    case Format::xrgb1111:
        break;
    }
    return 0;
}

std::array<std::uint8_t, descriptor_size> encode(const Descriptor& d) {
    std::array<std::uint8_t, descriptor_size> bytes{};
    Writer out(bytes);
    out.put(magic).put(protocol_version).put(d.flags).put(d.compression).put(d.max_buffer_size);
    out.put(d.min_width).put(d.max_width).put(d.min_height).put(d.max_height);
    assert(out.full());
    return bytes;
}

std::string decode(std::span<const std::uint8_t> bytes, Descriptor& d) {
    if (auto why = explain_length("display descriptor", bytes.size(), descriptor_size); !why.empty())
        return why;
    std::uint32_t got_magic = 0;
    std::uint8_t version = 0;
    Reader in(bytes);
    in.get(got_magic).get(version).get(d.flags).get(d.compression).get(d.max_buffer_size);
    in.get(d.min_width).get(d.max_width).get(d.min_height).get(d.max_height);
    if (got_magic != magic)
        return fmt::format("display descriptor begins with 0x{:08x} instead of 0x{:08x}", got_magic, magic);
    if (version != protocol_version)
        return fmt::format("display descriptor is of version {}, allowed: {}", version, protocol_version);
    if (d.max_width == 0 || d.max_height == 0 || d.min_width > d.max_width || d.min_height > d.max_height ||
        d.max_width > max_dimension || d.max_height > max_dimension)
        return fmt::format("display descriptor claims {}..{} x {}..{} pixels, allowed: 1..{} a side",
                           d.min_width, d.max_width, d.min_height, d.max_height, max_dimension);
    return {};
}

std::string decode_formats(std::span<const std::uint8_t> bytes, std::vector<Format>& formats) {
    if (bytes.empty()) return "format list is empty";
    if (auto why = explain_list("format list", bytes.size(), 1, max_formats); !why.empty()) return why;
    formats.clear();
    for (const std::uint8_t byte : bytes) {
        const auto format = static_cast<Format>(byte);
        if (std::find(formats.begin(), formats.end(), format) != formats.end())
            return fmt::format("format list names {} twice", to_string(format));
        formats.push_back(format);
    }
    return {};
}

std::string decode_properties(std::span<const std::uint8_t> bytes, std::vector<Property>& properties) {
    if (auto why = explain_list("property list", bytes.size(), property_size, max_properties); !why.empty())
        return why;
    properties.resize(bytes.size() / property_size);
    Reader in(bytes);
    for (Property& p : properties)
        in.get(p.id).get(p.value);
    return {};
}

std::array<std::uint8_t, connector_size> encode(const Connector& connector) {
    std::array<std::uint8_t, connector_size> bytes{};
    Writer(bytes).put(connector.type).put(connector.flags);
    return bytes;
}

std::string decode_connectors(std::span<const std::uint8_t> bytes, std::vector<Connector>& connectors) {
    if (bytes.empty()) return "connector list is empty";
    if (auto why = explain_list("connector list", bytes.size(), connector_size, max_connectors); !why.empty())
        return why;
    connectors.resize(bytes.size() / connector_size);
    Reader in(bytes);
    for (Connector& c : connectors)
        in.get(c.type).get(c.flags);
    return {};
}

std::string decode_connector_status(std::span<const std::uint8_t> bytes, ConnectorStatus& status) {
    if (auto why = explain_length("connector status", bytes.size(), 1); !why.empty()) return why;
    const std::uint8_t value = bytes[0] & 3u;
    if (value > 2 || (bytes[0] & 0x7Cu) != 0)
        return fmt::format("connector status is 0x{:02x}, allowed: 0, 1, 2, and 0x80 added", bytes[0]);
    status = static_cast<ConnectorStatus>(value);
    return {};
}

double Mode::refresh_hz() const {
    const double pixels = static_cast<double>(htotal) * vtotal;
    return pixels > 0 ? clock_khz * 1000.0 / pixels : 0;
}

std::array<std::uint8_t, mode_size> encode(const Mode& mode) {
    std::array<std::uint8_t, mode_size> bytes{};
    Writer out(bytes);
    put_mode(out, mode);
    assert(out.full());
    return bytes;
}

std::string decode_modes(std::span<const std::uint8_t> bytes, std::vector<Mode>& modes) {
    if (auto why = explain_list("mode list", bytes.size(), mode_size, max_modes); !why.empty()) return why;
    modes.resize(bytes.size() / mode_size);
    Reader in(bytes);
    for (std::size_t i = 0; i < modes.size(); ++i) {
        get_mode(in, modes[i]);
        if (auto why = explain_mode(modes[i]); !why.empty())
            return fmt::format("entry {} of the mode list: {}", i, why);
    }
    return {};
}

std::string decode_edid_modes(std::span<const std::uint8_t> bytes, std::vector<Mode>& modes) {
    modes.clear();
    if (bytes.empty()) return {};
    if (bytes.size() % 128 != 0 || bytes.size() > max_edid_size)
        return fmt::format("EDID has {} bytes, allowed: multiples of 128 up to {}", bytes.size(),
                           max_edid_size);
    constexpr std::array<std::uint8_t, 8> header{0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0};
    if (!std::equal(header.begin(), header.end(), bytes.begin()))
        return "EDID does not begin with its header";
    const unsigned sum = std::accumulate(bytes.begin(), bytes.begin() + 128, 0u);
    if ((sum & 0xFFu) != 0) return "EDID has a wrong checksum";
    for (std::size_t at = 54; at + 18 <= 126; at += 18) {
        const auto byte = [&](std::size_t i) { return static_cast<unsigned>(bytes[at + i]); };
        const unsigned clock_10khz = byte(0) | byte(1) << 8;
        if (clock_10khz == 0) continue; // a text descriptor, no timing
        const unsigned h_active = byte(2) | (byte(4) & 0xF0u) << 4;
        const unsigned h_blank = byte(3) | (byte(4) & 0x0Fu) << 8;
        const unsigned v_active = byte(5) | (byte(7) & 0xF0u) << 4;
        const unsigned v_blank = byte(6) | (byte(7) & 0x0Fu) << 8;
        const unsigned h_front = byte(8) | (byte(11) & 0xC0u) << 2;
        const unsigned h_sync = byte(9) | (byte(11) & 0x30u) << 4;
        const unsigned v_front = byte(10) >> 4 | (byte(11) & 0x0Cu) << 2;
        const unsigned v_sync = (byte(10) & 0x0Fu) | (byte(11) & 0x03u) << 4;
        Mode m;
        m.clock_khz = clock_10khz * 10;
        m.hdisplay = static_cast<std::uint16_t>(h_active);
        m.hsync_start = static_cast<std::uint16_t>(h_active + h_front);
        m.hsync_end = static_cast<std::uint16_t>(h_active + h_front + h_sync);
        m.htotal = static_cast<std::uint16_t>(h_active + h_blank);
        m.vdisplay = static_cast<std::uint16_t>(v_active);
        m.vsync_start = static_cast<std::uint16_t>(v_active + v_front);
        m.vsync_end = static_cast<std::uint16_t>(v_active + v_front + v_sync);
        m.vtotal = static_cast<std::uint16_t>(v_active + v_blank);
        if (modes.empty()) m.flags |= 1u << 10; // the first timing is the preferred one
        if (auto why = explain_mode(m); !why.empty()) return "EDID: " + why;
        modes.push_back(m);
    }
    return {};
}

std::array<std::uint8_t, set_buffer_size> encode(const SetBuffer& b) {
    std::array<std::uint8_t, set_buffer_size> bytes{};
    Writer out(bytes);
    out.put(b.x)
        .put(b.y)
        .put(b.width)
        .put(b.height)
        .put(b.length)
        .put(b.compression)
        .put(b.compressed_length);
    assert(out.full());
    return bytes;
}

std::string decode(std::span<const std::uint8_t> bytes, std::uint32_t width, std::uint32_t height,
                   Format format, SetBuffer& b) {
    if (auto why = explain_length("buffer request", bytes.size(), set_buffer_size); !why.empty()) return why;
    Reader in(bytes);
    in.get(b.x).get(b.y).get(b.width).get(b.height).get(b.length).get(b.compression).get(b.compressed_length);
    // Compute in 64 bits, so that a rectangle near 2^32 does not wrap around into the screen.
    if (b.width == 0 || b.height == 0 || std::uint64_t{b.x} + b.width > width ||
        std::uint64_t{b.y} + b.height > height)
        return fmt::format("buffer request for {}x{} pixels at {},{}, which is not on the {}x{} screen",
                           b.width, b.height, b.x, b.y, width, height);
    const std::uint64_t expected =
        std::uint64_t{b.width} * b.height * static_cast<unsigned>(bytes_per_pixel(format));
    if (b.length != expected)
        return fmt::format("buffer request of {} bytes for {}x{} pixels of {}, which need {}", b.length,
                           b.width, b.height, to_string(format), expected);
    if (b.compression != 0 && b.compression != compression_lz4)
        return fmt::format("buffer request with compression {}, allowed: 0, {}", b.compression,
                           compression_lz4);
    if (b.compression != 0 && (b.compressed_length == 0 || b.compressed_length > b.length))
        return fmt::format("buffer request of {} compressed bytes for {} plain ones", b.compressed_length,
                           b.length);
    return {};
}

std::array<std::uint8_t, state_size> encode(const State& state) {
    std::array<std::uint8_t, state_size> bytes{};
    Writer out(bytes);
    put_mode(out, state.mode);
    out.put(static_cast<std::uint8_t>(state.format)).put(state.connector);
    assert(out.full());
    return bytes;
}

std::string decode(std::span<const std::uint8_t> bytes, State& state, std::vector<Property>& properties) {
    if (bytes.size() < state_size)
        return fmt::format("state request has {} bytes, fewer than {}", bytes.size(), state_size);
    Reader in(bytes);
    get_mode(in, state.mode);
    std::uint8_t format = 0;
    in.get(format).get(state.connector);
    state.format = static_cast<Format>(format);
    if (auto why = explain_mode(state.mode); !why.empty()) return why;
    return decode_properties(bytes.subspan(state_size), properties);
}

std::array<std::uint8_t, frame_status_size> encode(const FrameStatus& s) {
    std::array<std::uint8_t, frame_status_size> bytes{};
    Writer out(bytes);
    out.put(s.received).put(s.shown).put(s.errors);
    out.put(s.last_received_ns).put(s.last_shown_ns).put(s.now_ns);
    assert(out.full());
    return bytes;
}

std::string decode(std::span<const std::uint8_t> bytes, FrameStatus& s) {
    if (auto why = explain_length("frame status", bytes.size(), frame_status_size); !why.empty()) return why;
    Reader in(bytes);
    in.get(s.received).get(s.shown).get(s.errors);
    in.get(s.last_received_ns).get(s.last_shown_ns).get(s.now_ns);
    if (s.shown > s.received)
        return fmt::format("frame status has {} updates shown but only {} received", s.shown, s.received);
    return {};
}

} // namespace obscura::transports::gud
