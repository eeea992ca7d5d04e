// SPDX-License-Identifier: Apache-2.0
// The wire format against bytes laid out by hand from the protocol's tables, and against nonsense.
#include "core/philox.hpp"
#include "tests/support/catch.hpp"
#include "transports/stimulator/grey.hpp"
#include "transports/stimulator/gud.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace gud_test {

using namespace obscura;
using namespace obscura::transports;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Bytes = std::vector<std::uint8_t>;

namespace {

const Bytes descriptor_bytes{0x4d, 0x61, 0x50, 0x1d, 0x01, 0x03, 0x00, 0x00, 0x00, 0x01,
                             0x00, 0x10, 0x00, 0x00, 0x40, 0x01, 0x00, 0x00, 0x80, 0x07,
                             0x00, 0x00, 0xf0, 0x00, 0x00, 0x00, 0x38, 0x04, 0x00, 0x00};

// VESA DMT 0x23, 1280x1024 at 60 Hz.
const Bytes sxga_mode{0xe0, 0xa5, 0x01, 0x00, 0x00, 0x05, 0x30, 0x05, 0xa0, 0x05, 0x98, 0x06,
                      0x00, 0x04, 0x01, 0x04, 0x04, 0x04, 0x2a, 0x04, 0x00, 0x04, 0x00, 0x00};

Bytes edid_with_sxga() {
    Bytes edid(128, 0);
    std::fill(edid.begin() + 1, edid.begin() + 7, 0xFF);
    const Bytes timing{0x30, 0x2a, 0x00, 0x98, 0x51, 0x00, 0x2a, 0x40, 0x30,
                       0x70, 0x13, 0x00, 0x78, 0x2d, 0x11, 0x00, 0x00, 0x1e};
    std::copy(timing.begin(), timing.end(), edid.begin() + 54);
    edid[72 + 3] = 0xFC; // a text descriptor: no timing
    unsigned sum = 0;
    for (const auto b : edid)
        sum += b;
    edid[127] = static_cast<std::uint8_t>(256 - sum % 256);
    return edid;
}

} // namespace

TEST_CASE("A display descriptor is 30 little-endian bytes") {
    gud::Descriptor d;
    REQUIRE(gud::decode(descriptor_bytes, d).empty());
    CHECK(d.flags == (gud::status_on_set | gud::full_update));
    CHECK(d.compression == gud::compression_lz4);
    CHECK(d.max_buffer_size == 0x1000);
    CHECK(d.min_width == 320);
    CHECK(d.max_width == 1920);
    CHECK(d.min_height == 240);
    CHECK(d.max_height == 1080);
    const auto again = gud::encode(d);
    // The hand-made one has max_buffer_size at its place and nothing between the fields.
    CHECK(std::equal(again.begin(), again.end(), descriptor_bytes.begin(), descriptor_bytes.end()));
}

TEST_CASE("Descriptors that lie are refused with the reason") {
    gud::Descriptor d;
    for (std::size_t n = 0; n < 64; ++n) {
        Bytes bytes = descriptor_bytes;
        bytes.resize(n);
        CHECK(gud::decode(bytes, d).empty() == (n == 30));
    }
    const auto refused = [&](std::size_t at, std::uint8_t value) {
        Bytes bytes = descriptor_bytes;
        bytes[at] = value;
        return gud::decode(bytes, d);
    };
    CHECK_THAT(refused(0, 0), ContainsSubstring("begins with 0x1d506100 instead of 0x1d50614d"));
    CHECK_THAT(refused(4, 2), ContainsSubstring("version 2, allowed: 1"));
    CHECK_THAT(refused(21, 0x40), ContainsSubstring("320..1073743744 x 240..1080"));
    CHECK_THAT(refused(17, 0x80), ContainsSubstring("2147483968..1920"));
}

TEST_CASE("Lists have whole entries and a limit") {
    std::vector<gud::Format> formats;
    CHECK(gud::decode_formats(Bytes{0x08, 0x50, 0x80, 0x99}, formats).empty());
    CHECK(formats.size() == 4);
    CHECK(gud::to_string(formats[3]) == "0x99");
    CHECK_THAT(gud::decode_formats(Bytes{}, formats), ContainsSubstring("empty"));
    CHECK_THAT(gud::decode_formats(Bytes{8, 8}, formats), ContainsSubstring("R8 twice"));
    CHECK_THAT(gud::decode_formats(Bytes(33, 1), formats), ContainsSubstring("33 entries"));

    std::vector<gud::Property> properties;
    CHECK(gud::decode_properties(Bytes{}, properties).empty());
    REQUIRE(gud::decode_properties(Bytes{0x32, 0, 1, 2, 3, 4, 5, 6, 7, 0x80}, properties).empty());
    CHECK(properties[0].id == 50);
    CHECK(properties[0].value == 0x8007060504030201u);
    CHECK_THAT(gud::decode_properties(Bytes(11, 0), properties), ContainsSubstring("no multiple of 10"));

    std::vector<gud::Connector> connectors;
    REQUIRE(gud::decode_connectors(Bytes{7, 1, 0, 0, 0, 0, 0, 0, 0, 0}, connectors).empty());
    CHECK(connectors.size() == 2);
    CHECK(connectors[0].type == 7);
    CHECK_THAT(gud::decode_connectors(Bytes{}, connectors), ContainsSubstring("empty"));

    gud::ConnectorStatus status{};
    CHECK(gud::decode_connector_status(Bytes{0x81}, status).empty());
    CHECK(status == gud::ConnectorStatus::connected);
    CHECK_THAT(gud::decode_connector_status(Bytes{3}, status), ContainsSubstring("0x03"));
    CHECK_THAT(gud::decode_connector_status(Bytes{0x41}, status), ContainsSubstring("0x41"));
}

TEST_CASE("Modes carry VESA timings") {
    std::vector<gud::Mode> modes;
    REQUIRE(gud::decode_modes(sxga_mode, modes).empty());
    REQUIRE(modes.size() == 1);
    CHECK(modes[0].hdisplay == 1280);
    CHECK(modes[0].vtotal == 1066);
    CHECK(modes[0].preferred());
    CHECK_THAT(modes[0].refresh_hz(), WithinAbs(60.02, 0.005)); // the standard's own figure
    const auto again = gud::encode(modes[0]);
    CHECK(std::equal(again.begin(), again.end(), sxga_mode.begin(), sxga_mode.end()));

    std::vector<gud::Mode> from_edid;
    REQUIRE(gud::decode_edid_modes(edid_with_sxga(), from_edid).empty());
    REQUIRE(from_edid.size() == 1);
    CHECK(from_edid[0] == modes[0]);

    Bytes broken = edid_with_sxga();
    broken[60] ^= 1;
    CHECK_THAT(gud::decode_edid_modes(broken, from_edid), ContainsSubstring("checksum"));
    broken.resize(127);
    CHECK_THAT(gud::decode_edid_modes(broken, from_edid), ContainsSubstring("127 bytes"));
    CHECK(gud::decode_edid_modes({}, from_edid).empty());
    CHECK(from_edid.empty());

    Bytes backwards = sxga_mode;
    backwards[7] = 0; // hsync_start 48 < hdisplay
    CHECK_THAT(gud::decode_modes(backwards, modes), ContainsSubstring("entry 0"));
    CHECK_THAT(gud::decode_modes(Bytes(24, 0), modes), ContainsSubstring("0x0"));
}

TEST_CASE("A buffer request must lie on the screen and have the right length") {
    gud::SetBuffer b;
    b.x = 32, b.y = 16, b.width = 64, b.height = 33, b.length = 64 * 33;
    b.compression = 1, b.compressed_length = 0x0102;
    const auto bytes = gud::encode(b);
    const Bytes expected{32, 0, 0, 0, 16, 0, 0, 0, 64, 0, 0, 0, 33, 0, 0, 0, 0x40, 0x08, 0, 0, 1, 2, 1, 0, 0};
    CHECK(std::equal(bytes.begin(), bytes.end(), expected.begin(), expected.end()));
    gud::SetBuffer got;
    CHECK(gud::decode(bytes, 96, 49, gud::Format::r8, got).empty());
    CHECK(got.transfer_length() == 0x0102);
    CHECK_THAT(gud::decode(bytes, 95, 49, gud::Format::r8, got),
               ContainsSubstring("not on the 95x49 screen"));
    CHECK_THAT(gud::decode(bytes, 96, 49, gud::Format::rgb888, got), ContainsSubstring("need 6336"));
    b.x = 0xFFFFFFFF, b.width = 2; // wraps to 1 in 32 bits
    CHECK_THAT(gud::decode(gud::encode(b), 96, 49, gud::Format::r8, got), ContainsSubstring("not on the"));
    b.x = 0, b.width = 64, b.compressed_length = 64 * 33 + 1;
    CHECK_THAT(gud::decode(gud::encode(b), 96, 49, gud::Format::r8, got), ContainsSubstring("compressed"));
    b.compressed_length = 5, b.compression = 2;
    CHECK_THAT(gud::decode(gud::encode(b), 96, 49, gud::Format::r8, got), ContainsSubstring("compression 2"));
}

TEST_CASE("State and frame status survive the wire") {
    gud::State s;
    std::vector<gud::Mode> modes;
    REQUIRE(gud::decode_modes(sxga_mode, modes).empty());
    s.mode = modes[0];
    s.format = gud::Format::xrgb8888;
    s.connector = 3;
    auto encoded = gud::encode(s);
    Bytes bytes(encoded.begin(), encoded.end());
    CHECK(bytes[24] == 0x80);
    CHECK(bytes[25] == 3);
    bytes.resize(36, 9);
    gud::State got;
    std::vector<gud::Property> properties;
    REQUIRE(gud::decode(bytes, got, properties).empty());
    CHECK(got.mode == s.mode);
    CHECK(properties.size() == 1);
    bytes.resize(35);
    CHECK_FALSE(gud::decode(bytes, got, properties).empty());

    const gud::FrameStatus status{10, 9, 1, 0x0102030405060708, 7, 8};
    gud::FrameStatus back;
    REQUIRE(gud::decode(gud::encode(status), back).empty());
    CHECK(back.last_received_ns == status.last_received_ns);
    CHECK_THAT(gud::decode(gud::encode(gud::FrameStatus{1, 2, 0, 0, 0, 0}), back),
               ContainsSubstring("2 updates shown"));
}

TEST_CASE("No bytes whatever upset a decoder, and what it accepts is within bounds") {
    std::vector<gud::Format> formats;
    std::vector<gud::Property> properties;
    std::vector<gud::Connector> connectors;
    std::vector<gud::Mode> modes;
    for (std::uint32_t round = 0; round < 20000; ++round) {
        const auto head = philox4x32({round, 0, 0, 0}, {1, 2});
        // Half are random, half are good messages with a few bytes changed.
        Bytes bytes = head[0] % 4 == 0   ? descriptor_bytes
                      : head[0] % 4 == 1 ? sxga_mode
                      : head[0] % 8 == 2 ? edid_with_sxga()
                                         : Bytes(head[1] % 200);
        for (std::uint32_t i = 0; i < (head[0] % 4 > 1 && head[0] % 8 != 2 ? bytes.size() : head[2] % 4);
             ++i) {
            const auto r = philox4x32({round, i, 1, 0}, {1, 2});
            if (!bytes.empty())
                bytes[head[0] % 4 > 1 ? i : r[1] % bytes.size()] = static_cast<std::uint8_t>(r[0]);
        }
        gud::Descriptor d;
        if (gud::decode(bytes, d).empty()) {
            REQUIRE(d.max_width <= gud::max_dimension);
            REQUIRE(d.min_width <= d.max_width);
        }
        if (gud::decode_formats(bytes, formats).empty()) REQUIRE(formats.size() == bytes.size());
        if (gud::decode_properties(bytes, properties).empty())
            REQUIRE(properties.size() <= gud::max_properties);
        if (gud::decode_connectors(bytes, connectors).empty()) REQUIRE(!connectors.empty());
        if (gud::decode_modes(bytes, modes).empty())
            for (const gud::Mode& m : modes)
                REQUIRE((m.hdisplay > 0 && m.vdisplay > 0 && m.htotal >= m.hdisplay));
        if (gud::decode_edid_modes(bytes, modes).empty()) REQUIRE(modes.size() <= 4);
        gud::SetBuffer b;
        if (gud::decode(bytes, 640, 480, gud::Format::r8, b).empty())
            REQUIRE((b.x + b.width <= 640 && b.y + b.height <= 480));
        gud::State s;
        (void)gud::decode(bytes, s, properties);
        gud::FrameStatus f;
        (void)gud::decode(bytes, f);
        gud::ConnectorStatus c{};
        (void)gud::decode_connector_status(bytes, c);
    }
}

TEST_CASE("Grey levels become pixels") {
    const std::vector<std::uint16_t> levels{0, 1, 2, 3, 255};
    Bytes out(20);
    pack_levels(gud::Format::r8, GreyCoding::equal, levels, out);
    CHECK(Bytes(out.begin(), out.begin() + 5) == Bytes{0, 1, 2, 3, 255});
    pack_levels(gud::Format::rgb888, GreyCoding::equal, levels, out);
    CHECK(Bytes(out.begin() + 12, out.begin() + 15) == Bytes{255, 255, 255});

    CHECK(grey_levels(gud::Format::r8, GreyCoding::equal) == 256);
    CHECK(grey_levels(gud::Format::r8, GreyCoding::sum) == 0);
    CHECK(grey_levels(gud::Format::xrgb8888, GreyCoding::sum) == 766);
    CHECK(grey_levels(gud::Format::rgb888, GreyCoding::high_low) == 65536);
    CHECK(grey_levels(gud::Format::rgb565, GreyCoding::equal) == 0);

    // The channels of `sum` add up to the level and are never more than one apart.
    for (std::uint16_t level = 0; level < 766; ++level) {
        pack_levels(gud::Format::xrgb8888, GreyCoding::sum, std::span(&level, 1), out);
        REQUIRE(out[0] + out[1] + out[2] == level);
        REQUIRE(std::max({out[0], out[1], out[2]}) - std::min({out[0], out[1], out[2]}) <= 1);
        REQUIRE(out[3] == 0);
    }
    const std::uint16_t level = 0xABCD;
    pack_levels(gud::Format::xrgb8888, GreyCoding::high_low, std::span(&level, 1), out);
    CHECK(Bytes(out.begin(), out.begin() + 4) == Bytes{0, 0xCD, 0xAB, 0}); // blue, green, red, unused
}

} // namespace gud_test
