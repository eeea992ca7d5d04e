// SPDX-License-Identifier: Apache-2.0
// The control port without sockets: one datagram in, its answer out, on a fresh device each time.
#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/io/temporary_name.hpp"
#include "core/philox.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/pattern_camera.hpp"
#include "tests/support/temp_folder.hpp"
#include "transports/gige/control/control_port.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/device/state_file.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace gige_control_test {

using namespace obscura;
using namespace obscura::transports::gige;
using Bytes = std::vector<std::uint8_t>;

namespace {

/// Stands in for the sender and notes what it was told.
struct NotedStream final : StreamPort {
    StreamConfig config;
    int begun = 0, aborted = 0, tests = 0;
    std::vector<ResendRequest> resends;

    bool begin(const StreamConfig& c) override {
        config = c;
        ++begun;
        return true;
    }
    void abort() noexcept override { ++aborted; }
    [[nodiscard]] bool idle() const noexcept override { return true; }
    bool wait_idle(std::int64_t) noexcept override { return true; }
    void resend(const ResendRequest& r) noexcept override { resends.push_back(r); }
    bool send_test_packet(const StreamConfig& c) noexcept override {
        config = c;
        ++tests;
        return true;
    }
    [[nodiscard]] std::uint16_t source_port() const noexcept override { return 4242; }
};

CameraLimits small_sensor() {
    CameraLimits l;
    l.sensor_width = 640;
    l.sensor_height = 480;
    return l;
}

NetworkInterface test_network() {
    NetworkInterface n;
    n.name = "eth9";
    n.address = 0xC0A80702; // 192.168.7.2
    n.mask = 0xFFFFFF00;
    n.broadcast = 0xC0A807FF;
    n.mac = 0x021122334455;
    return n;
}

constexpr Peer alice{0xC0A80705, 50000};
constexpr Peer bob{0xC0A80706, 50001};

/// A fresh device, and the words to talk to it.
struct Bench {
    FakeClock clock{Time{1'000'000'000'000}};
    test::PatternCamera camera{small_sensor(), 2};
    NotedStream stream;
    GigeSettings settings;
    MessageChannel messages{test_network()};
    Device device{settings, test_network(), camera, stream, messages, clock};
    ControlPort port{device, settings, test_network()};

    std::uint16_t id = 0;

    explicit Bench(GigeSettings s = {}) : settings(std::move(s)) {}

    Bytes send(const Bytes& d, Peer from = alice, bool broadcast = false) {
        const auto reply = port.handle(d, from, broadcast, clock.now());
        return {reply.begin(), reply.end()};
    }
    Bytes datagram(std::uint16_t command, const Bytes& payload, std::uint8_t flags = 1) {
        Bytes d(8);
        d[0] = 0x42;
        d[1] = flags;
        store_be16(&d[2], command);
        store_be16(&d[4], static_cast<std::uint16_t>(payload.size()));
        store_be16(&d[6], ++id);
        d.insert(d.end(), payload.begin(), payload.end());
        return d;
    }
    Bytes ask(std::uint16_t command, const Bytes& payload, Peer from = alice, std::uint8_t flags = 1) {
        return send(datagram(command, payload, flags), from);
    }
    Bytes read(std::uint32_t address, Peer from = alice) { return ask(0x80, words({address}), from); }
    int write(std::uint32_t address, std::uint32_t value, Peer from = alice) {
        return status(ask(0x82, words({address, value}), from));
    }
    Bytes read_memory(std::uint32_t address, std::uint32_t count, Peer from = alice) {
        return ask(0x84, words({address, count}), from);
    }
    int write_memory(std::uint32_t address, const Bytes& data, Peer from = alice) {
        Bytes p = words({address});
        p.insert(p.end(), data.begin(), data.end());
        return status(ask(0x86, p, from));
    }
    void take_control(Peer who = alice) {
        REQUIRE(write(reg::control_privilege, privilege::control, who) == 0);
    }
    void start() {
        take_control();
        REQUIRE(write(reg::stream_port, 5555) == 0);
        REQUIRE(write(address_of("AcquisitionStart"), 1) == 0);
    }
    static Bytes words(std::initializer_list<std::uint32_t> values) {
        Bytes b;
        for (const std::uint32_t v : values) {
            b.resize(b.size() + 4);
            store_be32(&b[b.size() - 4], v);
        }
        return b;
    }
    /// -1: no answer at all.
    static int status(const Bytes& reply) { return reply.empty() ? -1 : load_be16(reply.data()); }
    static std::uint32_t word(const Bytes& reply, std::size_t at = 0) { return load_be32(&reply.at(8 + at)); }
};

constexpr int silence = -1, ok = 0, not_implemented = 0x8001, invalid_parameter = 0x8002,
              invalid_address = 0x8003, write_protect = 0x8004, bad_alignment = 0x8005,
              access_denied = 0x8006, invalid_header = 0x800E;

} // namespace

TEST_CASE("Datagrams that are no commands are not answered") {
    const Bytes good = Bench().datagram(0x80, Bench::words({0}));
    for (std::size_t n = 0; n < 8; ++n) {
        CAPTURE(n);
        CHECK(Bench().send(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(n))).empty());
    }
    const auto changed = [&](std::size_t at, std::uint8_t value) {
        Bytes d = good;
        d[at] = value;
        return Bench::status(Bench().send(d));
    };
    CHECK(Bench::status(Bench().send(good)) == ok);
    CHECK(changed(0, 0x43) == silence); // key
    CHECK(changed(7, 0) == silence);    // id 0 is reserved
    CHECK(changed(3, 0x81) == silence); // acknowledges: two devices must not answer each other
    CHECK(changed(3, 0x03) == silence);
    CHECK(changed(3, 0x89) == silence);
    CHECK(Bench::status(Bench().send(good, alice, true)) == silence); // broadcast READREG
    CHECK(Bench::status(Bench().send(Bench().datagram(0x82, Bench::words({0xA00, 2})), alice, true)) ==
          silence);
    CHECK(Bench::status(Bench().send(Bench().datagram(0x7777, {}), alice, true)) == silence);
    CHECK(Bench::status(Bench().send(Bench().datagram(0x80, Bench::words({0}), 0))) ==
          silence); // no ack wanted
    CHECK(Bench::status(Bench().send(Bench().datagram(0x7776, {}, 0))) == silence);
    Bench b; // nor are broadcast writes run
    b.send(b.datagram(0x82, Bench::words({0xA00, 2}), 0), alice, true);
    CHECK_FALSE(b.port.controlled());
}

TEST_CASE("Sound headers with wrong contents are answered with their status") {
    const auto ask = [](std::uint16_t command, const Bytes& payload, std::uint8_t flags = 1) {
        return Bench::status(Bench().ask(command, payload, alice, flags));
    };
    const auto w = [](std::initializer_list<std::uint32_t> v) { return Bench::words(v); };
    CHECK(ask(0x7776, {}) == not_implemented);
    CHECK(ask(0x00C0, {}) == not_implemented); // EVENT goes the other way
    CHECK(ask(0x0088, {}) == not_implemented); // only its acknowledge exists
    CHECK(ask(0x80, {}) == invalid_parameter);
    CHECK(ask(0x80, Bytes(3)) == invalid_parameter);
    CHECK(ask(0x80, Bytes(136 * 4)) == invalid_parameter); // one more than fits an answer
    CHECK(ask(0x80, Bytes(135 * 4)) == ok);
    CHECK(ask(0x80, w({2})) == bad_alignment);
    CHECK(ask(0x80, w({0xFFFFFFFC})) == invalid_address);
    CHECK(ask(0x80, w({0x7FFFFFF0})) == invalid_address);
    CHECK(ask(0x82, w({0xA00})) == invalid_parameter);
    CHECK(ask(0x82, {}) == invalid_parameter);
    CHECK(ask(0x82, Bytes(68 * 8)) == invalid_parameter);
    CHECK(ask(0x84, w({0})) == invalid_parameter);
    CHECK(ask(0x84, w({0, 0})) == invalid_parameter);
    CHECK(ask(0x84, w({0, 6})) == invalid_parameter);
    CHECK(ask(0x84, w({0, 540})) == invalid_parameter);
    CHECK(ask(0x84, w({0, 536})) == invalid_address); // sound, but there is a hole behind 0xF8
    CHECK(ask(0x84, w({reg::xml_url_first, 512})) == ok);
    CHECK(ask(0x84, w({1, 4})) == bad_alignment);
    CHECK(ask(0x84, w({0xFFFFFFFC, 8})) == invalid_address); // past 2^32
    CHECK(ask(0x84, w({0xFFFFFFFC, 536})) == invalid_address);
    CHECK(ask(0x84, w({xml_file_address + 0x100000, 512})) == invalid_address);
    CHECK(ask(0x86, {}) == invalid_parameter);
    CHECK(ask(0x86, w({0xA00})) == invalid_parameter);
    CHECK(ask(0x86, Bytes(4 + 540)) == invalid_parameter);
    CHECK(ask(0x86, w({2, 0})) == bad_alignment);
    CHECK(ask(0x04, Bytes(12)) == invalid_parameter);
    CHECK(ask(0x02, Bytes(4)) == invalid_parameter);
    CHECK(ask(0x100, Bytes(8)) == invalid_parameter);
    Bytes lying = Bench().datagram(0x86, Bench::words({0xA00, 2}));
    lying[5] = 0; // length field 0: killed other servers
    CHECK(Bench::status(Bench().send(lying)) == invalid_header);
    lying[4] = 0xFF;
    CHECK(Bench::status(Bench().send(lying)) == invalid_header);
    lying.resize(548 + 1000);
    CHECK(Bench::status(Bench().send(lying)) == invalid_header);
}

TEST_CASE("No answer is longer than 548 bytes, and acknowledges carry command, length and id") {
    Bench b;
    const Bytes reply = b.read_memory(xml_file_address, 536);
    REQUIRE(reply.size() == 8 + 4 + 536);
    CHECK(load_be16(&reply[2]) == 0x85);
    CHECK(load_be16(&reply[4]) == 540);
    CHECK(load_be16(&reply[6]) == b.id);
    CHECK(Bench::word(reply) == xml_file_address);
    CHECK(reply[12] == 'P'); // a zip archive begins with PK
    CHECK(reply[13] == 'K');
    CHECK(b.ask(0x80, Bytes(135 * 4)).size() == 8 + 135 * 4);
}

TEST_CASE("DISCOVERY tells who and where the device is, to one or to all") {
    Bench b;
    for (const bool broadcast : {false, true}) {
        const Bytes reply = b.send(b.datagram(0x02, {}), alice, broadcast);
        REQUIRE(reply.size() == 256);
        CHECK(load_be16(&reply[2]) == 0x03);
        CHECK(load_be16(&reply[8 + 0x0A]) == 0x0211); // MAC
        CHECK(load_be32(&reply[8 + 0x0C]) == 0x22334455);
        CHECK(load_be32(&reply[8 + 0x24]) == 0xC0A80702);
        CHECK(std::string(reinterpret_cast<const char*>(&reply[8 + 0x48])) == "Obscura");
        CHECK(std::string(reinterpret_cast<const char*>(&reply[8 + 0xD8])) == "OBS000001");
    }
}

TEST_CASE("FORCEIP is for the device with its MAC, and the camera stays where its host is") {
    const auto force = [](Bench& b, std::uint64_t mac, std::uint32_t ip, std::uint32_t mask,
                          bool broadcast = true) {
        Bytes p(56);
        store_be16(&p[2], static_cast<std::uint16_t>(mac >> 32));
        store_be32(&p[4], static_cast<std::uint32_t>(mac));
        store_be32(&p[20], ip);
        store_be32(&p[36], mask);
        return Bench::status(b.send(b.datagram(0x04, p), bob, broadcast));
    };
    const NetworkInterface n = test_network();
    Bench b;
    CHECK(force(b, n.mac + 1, n.address, n.mask) == silence);
    CHECK(force(b, n.mac, n.address, n.mask) == ok);
    CHECK(force(b, n.mac, 0, 0) == ok); // configure yourself as ever
    CHECK(force(b, n.mac, n.address, n.mask, false) == ok);
    CHECK(force(b, n.mac, n.address + 1, n.mask) == invalid_parameter);
    CHECK(force(b, n.mac, n.address, 0xFFFF0000) == invalid_parameter);
    CHECK(Bench::word(b.read(reg::current_ip)) == n.address);
    b.take_control();
    CHECK(force(b, n.mac, n.address, n.mask) == access_denied);
}

TEST_CASE("Only the controller may write") {
    Bench b;
    CHECK(b.write(address_of("Width"), 320) == access_denied); // no controlling application
    CHECK(b.write_memory(address_of("Width"), Bench::words({320})) == access_denied);
    b.take_control(alice);
    CHECK(b.write(address_of("Width"), 320, bob) == access_denied);
    CHECK(b.write_memory(address_of("Width"), Bench::words({320}), bob) == access_denied);
    // A control request must not smuggle another write along.
    CHECK(Bench::status(b.ask(0x82, Bench::words({0xA00, 2, address_of("Width"), 320}), bob)) ==
          access_denied);
    CHECK(Bench::word(b.read(address_of("Width"), bob)) == 640); // reading is free
    CHECK(b.write(address_of("Width"), 320, alice) == ok);
    CHECK(b.write(reg::control_privilege, 2, bob) == access_denied);
    CHECK(b.write(reg::control_privilege, 2, alice) == ok); // again by its owner
    CHECK(Bench::word(b.read(reg::primary_ip)) == alice.ip);
    CHECK(Bench::word(b.read(reg::primary_port)) == alice.port);
    CHECK(b.write(reg::control_privilege, 0, bob) == access_denied);
    CHECK(b.write(reg::control_privilege, 0, alice) == ok);
    CHECK(b.write(reg::control_privilege, 2, bob) == ok);
}

TEST_CASE("Exclusive control locks the others out of reading, but not out of discovery") {
    Bench b;
    CHECK(b.write(reg::control_privilege, 8) == invalid_parameter);
    CHECK(b.write(reg::control_privilege, privilege::exclusive) == ok);
    CHECK(Bench::status(b.read(0, bob)) == access_denied);
    CHECK(Bench::status(b.read_memory(0, 8, bob)) == access_denied);
    CHECK(Bench::status(b.send(b.datagram(0x02, {}), bob)) == ok);
    CHECK(Bench::status(b.read(0, alice)) == ok);
}

TEST_CASE("Writes are validated, and a refused one changes nothing") {
    const struct {
        std::uint32_t address, value;
        int expected;
    } probes[] = {
        {address_of("Width"), 100'000, invalid_parameter},
        {address_of("Width"), 0xFFFFFFFF, invalid_parameter},
        {address_of("Width"), 0, invalid_parameter},
        {address_of("Width"), 320, ok},
        {address_of("OffsetX"), 1, invalid_parameter}, // the whole width is in use
        {address_of("PixelFormat"), 0x12345678, invalid_parameter},
        {address_of("PixelFormat"), 0x01080001, ok},
        {address_of("AcquisitionMode"), 3, invalid_parameter},
        {address_of("TriggerMode"), 2, invalid_parameter},
        {address_of("TriggerSource"), trigger_source_count, invalid_parameter},
        {address_of("TriggerActivation"), trigger_activation_count, invalid_parameter},
        {address_of("ExposureMode"), 0, invalid_parameter},
        {address_of("ExposureMode"), 3, invalid_parameter},
        {address_of("ExposureTime"), 0, invalid_parameter},
        {address_of("ExposureTime"), 0xFFFFFFFF, invalid_parameter},
        {address_of("Gain"), 0xFFFFFFFF, invalid_parameter}, // -0.001 dB
        {address_of("Gain"), 6000, ok},
        {address_of("AcquisitionFrameRate"), 0, invalid_parameter},
        {address_of("AcquisitionStart"), 2, invalid_parameter},
        {address_of("PayloadSize"), 1, write_protect},
        {0x0, 1, write_protect},
        {xml_file_address, 1, write_protect},
        {0x9FFC, 1, invalid_address},
        {2, 1, bad_alignment},
        {reg::stream_packet_size, 36, invalid_parameter},   // made another server spin for ever
        {reg::stream_packet_size, 9000, invalid_parameter}, // MTU 1500
        {reg::stream_packet_size, 1501, invalid_parameter},
        {reg::stream_packet_size, 0x00010000 | 1500, invalid_parameter},
        {reg::stream_packet_size, 1500, ok},
        {reg::stream_packet_size, 576, ok},
        {reg::stream_port, 0x00010000 | 5000, invalid_parameter}, // there is one interface
        {reg::stream_port, 5000, ok},
        {reg::stream_packet_delay, 0xFFFFFFFF, invalid_parameter},
        {reg::stream_destination, 0x08080808, invalid_parameter}, // off link
        {reg::stream_destination, 0xC0A80763, ok},
        {reg::stream_destination, 0xEF010101, ok}, // multicast
        {reg::heartbeat_timeout, 499, invalid_parameter},
        {reg::heartbeat_timeout, 500, ok},
        {reg::timestamp_control, 0, invalid_parameter},
        {reg::timestamp_control, 4, invalid_parameter},
        {reg::gvcp_configuration, 1, invalid_parameter},          // heartbeat cannot be disabled
        {reg::gvcp_configuration, 0x00080000, invalid_parameter}, // PTP, which is not there
        {reg::link_configuration, 1, write_protect},
        {reg::ptp_selected_profile, 1, write_protect},
        {reg::gvsp_configuration, 1, invalid_parameter},
        {reg::gvsp_configuration, 0x40000000, ok},
    };
    for (const auto& p : probes) {
        CAPTURE(p.address, p.value);
        // READREG/WRITEREG and READMEM/WRITEMEM have the same effects.
        Bench by_register, by_memory;
        by_register.take_control();
        by_memory.take_control();
        const CameraSettings before = by_register.camera.settings();
        CHECK(by_register.write(p.address, p.value) == p.expected);
        CHECK(by_memory.write_memory(p.address, Bench::words({p.value})) == p.expected);
        CHECK(by_register.camera.settings() == by_memory.camera.settings());
        if (p.expected != ok) CHECK(by_register.camera.settings() == before);
        if (p.address % 4 == 0) {
            const Bytes a = by_register.read(p.address), m = by_memory.read_memory(p.address, 4);
            CHECK(Bench::status(a) == Bench::status(m));
            if (Bench::status(a) == ok) CHECK(Bench::word(a) == Bench::word(m, 4));
        }
    }
}

TEST_CASE("Concatenated commands stop at the first error and say where") {
    Bench b;
    b.take_control();
    const Bytes written = b.ask(
        0x82, Bench::words({address_of("Width"), 320, address_of("Height"), 9999, address_of("Gain"), 1000}));
    CHECK(Bench::status(written) == invalid_parameter);
    CHECK(Bench::word(written) == 1);
    CHECK(b.camera.settings().region.width == 320);
    CHECK(b.camera.settings().gain_db == 0);
    CHECK(Bench::word(b.ask(0x82, Bench::words({address_of("Width"), 100, address_of("Gain"), 1000}))) == 2);

    const Bytes read = b.ask(
        0x80, Bench::words({address_of("Width"), address_of("Height"), 0xFFFFFFF0, address_of("Gain")}));
    CHECK(Bench::status(read) == invalid_address);
    REQUIRE(read.size() == 8 + 8); // what was read before the error
    CHECK(Bench::word(read) == 100);
    CHECK(Bench::word(read, 4) == 480);

    // WRITEMEM over several registers: bytes done.
    const Bytes memory = b.ask(0x86, Bench::words({address_of("Width"), 64, 9999, 0}));
    CHECK(Bench::status(memory) == invalid_parameter);
    CHECK(Bench::word(memory) == 4);
    CHECK(b.camera.settings().region.width == 64);
    CHECK(Bench::word(b.ask(0x86, Bench::words({address_of("Width"), 96, 48, 10, 20}))) == 16);
    CHECK(b.camera.settings().region == Region{10, 20, 96, 48});
}

TEST_CASE("Image format and stream are locked while streaming") {
    Bench b;
    b.start();
    for (const std::uint32_t locked :
         {address_of("Width"), address_of("Height"), address_of("PixelFormat"), address_of("AcquisitionMode"),
          reg::stream_packet_delay, reg::stream_destination, reg::gvsp_configuration}) {
        CAPTURE(locked);
        CHECK(b.write(locked, Bench::word(b.read(locked))) == write_protect);
    }
    CHECK(b.write(reg::stream_packet_size, 576) == write_protect);
    CHECK(b.write(address_of("ExposureTime"), 5000) == ok);
    CHECK(b.write(address_of("Gain"), 5000) == ok);
    CHECK(b.write(address_of("AcquisitionStart"), 1) == ok); // twice changes nothing
    CHECK(b.stream.begun == 1);
    CHECK(b.write(address_of("AcquisitionStop"), 1) == ok);
    CHECK(b.write(address_of("Width"), 320) == ok);
}

TEST_CASE("The stream gets what the registers say") {
    Bench b;
    b.take_control();
    CHECK(b.write(reg::stream_destination, 0xC0A80763) == ok);
    CHECK(b.write(reg::stream_packet_delay, 1234) == ok);
    CHECK(b.write(reg::stream_packet_size, 0x40000000 | 1400) == ok);
    CHECK(b.write(reg::gvsp_configuration, 0x40000000) == ok);
    CHECK(b.write(address_of("PixelFormat"), 0x01080001) == ok);
    CHECK(b.write(reg::stream_port, 5555) == ok);
    CHECK(b.write(address_of("AcquisitionStart"), 1) == ok);
    const StreamConfig& c = b.stream.config;
    CHECK(c.destination_ip == 0xC0A80763);
    CHECK(c.destination_port == 5555);
    CHECK(c.packet_size == 1400);
    CHECK(c.do_not_fragment);
    CHECK(c.extended_ids);
    CHECK(c.packet_delay_ns == 1234);
    CHECK(c.payload.packs_pixels);
    CHECK(Bench::word(b.read(address_of("PayloadSize"))) == 640 * 480);
    CHECK(Bench::word(b.read(reg::stream_source_port)) == 4242);
    // Closing the port ends the acquisition.
    CHECK(b.write(reg::stream_port, 0) == ok);
    CHECK_FALSE(b.camera.acquiring());
}

TEST_CASE("A test packet is fired at the given size, and only with somewhere to go") {
    Bench b;
    b.take_control();
    CHECK(b.write(reg::stream_packet_size, 0x80000000 | 1000) == ok);
    CHECK(b.stream.tests == 0);
    CHECK(b.write(reg::stream_port, 5555) == ok);
    CHECK(b.write(reg::stream_packet_size, 0xC0000000 | 1200) == ok);
    CHECK(b.stream.tests == 1);
    CHECK(b.stream.config.packet_size == 1200);
    CHECK(b.stream.config.destination_ip == alice.ip);                          // GevSCDA 0: the controller
    CHECK(Bench::word(b.read(reg::stream_packet_size)) == (0x40000000 | 1200)); // the fire bit reads 0
}

TEST_CASE("A client that takes control finds a camera that does not acquire") {
    Bench b;
    b.camera.acquisition_start(); // as calls of the daemon do
    CHECK(b.write(address_of("AcquisitionMode"), 0) == access_denied);
    CHECK(b.camera.acquiring());
    CHECK(b.write(reg::control_privilege, 2) == ok);
    CHECK_FALSE(b.camera.acquiring());
    CHECK(b.write(address_of("AcquisitionMode"), 0) == ok);
    CHECK(b.write(reg::control_privilege, 2) == ok); // again: no second stop
}

TEST_CASE("The heartbeat is the controller's alone and runs out by the clock") {
    Bench b;
    b.start();
    const Time granted = b.clock.now();
    CHECK(b.port.deadline() == granted + 3 * ns_per_s);
    b.clock.advance(2 * ns_per_s);
    b.read(reg::control_privilege, bob); // no third party keeps a dead controller alive
    CHECK(b.port.deadline() == granted + 3 * ns_per_s);
    b.write(address_of("Gain"), 1000); // any command of the controller counts
    CHECK(b.port.deadline() == granted + 5 * ns_per_s);
    b.clock.advance(3 * ns_per_s - 1);
    b.port.on_timer(b.clock.now());
    CHECK(b.port.controlled());
    CHECK(b.camera.acquiring());
    b.clock.advance(1);
    b.port.on_timer(b.clock.now());
    CHECK_FALSE(b.port.controlled());
    CHECK_FALSE(b.camera.acquiring());
    CHECK(b.port.counters().control_lost == 1);
    CHECK(Bench::word(b.read(reg::stream_port)) == 0);
    CHECK(b.camera.settings().gain_db == 1); // features stay
    CHECK(b.write(address_of("Gain"), 2000) == access_denied);
    CHECK(b.write(reg::control_privilege, 2, bob) == ok);
}

TEST_CASE("A heartbeat time-out is its controller's alone and has a maximum") {
    Bench b;
    const auto timeout = [&b] { return Bench::word(b.read(reg::heartbeat_timeout)); };
    const auto maximum = [&b] { return Bench::word(b.read(address_of("GevHeartbeatTimeoutMax"))); };
    b.take_control();
    CHECK(maximum() == 60'000);
    CHECK(b.write(reg::heartbeat_timeout, 60'001) == invalid_parameter);
    CHECK(b.write(reg::heartbeat_timeout, 60'000) == ok);
    CHECK(b.write(reg::control_privilege, 2) == ok); // asking again for what it has changes nothing
    CHECK(timeout() == 60'000);

    SECTION("control is given up") {
        CHECK(b.write(reg::control_privilege, 0) == ok);
    }
    SECTION("control is lost") {
        b.clock.advance(60 * ns_per_s);
        b.port.on_timer(b.clock.now());
        CHECK_FALSE(b.port.controlled());
    }
    SECTION("control is taken away on the camera's side") {
        b.port.release("has lost control");
        CHECK(timeout() == 3000); // without waiting for the next controller
    }
    SECTION("control is handed over") {
        CHECK(b.write(reg::switchover_key, 77) == ok);
        CHECK(b.write(reg::control_privilege, 2 | 4) == ok);
        CHECK(timeout() == 60'000);
    }
    CHECK(b.write(reg::control_privilege, 77 << 16 | 2, bob) == ok);
    CHECK(timeout() == 3000);
    CHECK(b.port.deadline() == b.clock.now() + 3 * ns_per_s);

    GigeSettings patient;
    patient.heartbeat_timeout_max_ms = 86'400'000;
    Bench debugging(patient);
    debugging.take_control();
    CHECK(debugging.write(reg::heartbeat_timeout, 86'400'000) == ok);
}

TEST_CASE("Text registers take printable ASCII only") {
    Bench b;
    b.take_control();
    const auto write_name = [&b](std::string name) {
        name.resize(16);
        return b.write_memory(reg::user_name, Bytes(name.begin(), name.end()));
    };
    CHECK(write_name(R"(a "b" \c ~)") == ok);
    for (const char* const bad : {"x\n0xa150 0x3039", "tab\t", "\x1b[2J", "caf\xc3\xa9", "del\x7f"}) {
        CHECK(write_name(bad) == invalid_parameter);
        CHECK(b.device.registers().text(reg::user_name) == R"(a "b" \c ~)");
    }
}

TEST_CASE("A repeated request is answered again but run once") {
    Bench b;
    b.take_control();
    CHECK(b.write(address_of("TriggerMode"), 1) == ok);
    CHECK(b.write(address_of("TriggerSource"), 0) == ok);
    CHECK(b.write(reg::stream_port, 5555) == ok);
    CHECK(b.write(address_of("AcquisitionStart"), 1) == ok);
    const Bytes once = b.datagram(0x82, Bench::words({address_of("TriggerSoftware"), 1}));
    const Bytes first = b.send(once);
    CHECK(b.send(once) == first);
    CHECK(b.send(once) == first);
    CHECK(b.camera.triggers() == 1);
    CHECK(b.port.counters().retries == 2);
    b.ask(0x82, Bench::words({address_of("TriggerSoftware"), 1})); // the next id is a new command
    CHECK(b.camera.triggers() == 2);
}

TEST_CASE("Repeated answers count towards what an address may be sent") {
    Bench b;
    b.take_control();
    const Bytes request = b.datagram(0x84, Bench::words({reg::xml_url_first, 512}));
    std::size_t bytes = 0;
    for (int i = 0; i < 10'000; ++i) // an address can be forged, and takes control as any other
        bytes += b.send(request).size();
    CHECK(b.port.counters().retries == 9'999);
    CHECK(bytes > 950'000);
    CHECK(bytes <= 1'000'000);
}

TEST_CASE("PACKETRESEND is served for controller and receiver, in both id formats") {
    Bench b;
    b.start();
    const Bytes standard = b.datagram(0x40, Bench::words({7, 3, 9}), 0);
    CHECK(b.send(standard).empty());
    REQUIRE(b.stream.resends.size() == 1);
    CHECK(b.stream.resends[0].block_id == 7);
    CHECK(b.stream.resends[0].first == 3);
    CHECK(b.stream.resends[0].last == 9);
    CHECK(b.stream.resends[0].trusted); // the controller's own socket
    b.send(b.datagram(0x40, Bench::words({7, 3, 0xFFFFFF}), 0),
           Peer{alice.ip, 5555}); // from the stream's socket
    REQUIRE(b.stream.resends.size() == 2);
    CHECK(b.stream.resends[1].last == 0xFFFFFFFF);
    CHECK(b.stream.resends[1].trusted);
    b.send(b.datagram(0x40, Bench::words({0, 1, 2, 5, 6}), 0x10));
    REQUIRE(b.stream.resends.size() == 3);
    CHECK(b.stream.resends[2].extended);
    CHECK(b.stream.resends[2].block_id == 0x500000006);
    b.send(b.datagram(0x40, Bench::words({0, 0x1000001, 0x1000002, 5, 6}), 0x10)); // ids of 32 bits
    REQUIRE(b.stream.resends.size() == 4);
    CHECK(b.stream.resends[3].first == 0x1000001);
    CHECK(b.stream.resends[3].last == 0x1000002);
    b.stream.resends.pop_back();
    // From another socket of that host: only as far as no other source goes short for it.
    b.send(standard, Peer{alice.ip, 61234});
    REQUIRE(b.stream.resends.size() == 4);
    CHECK_FALSE(b.stream.resends[3].trusted);
    // Not: another client, another channel, a range upside down, block 0, the wrong length.
    b.send(b.datagram(0x40, Bench::words({7, 3, 9}), 0), bob);
    b.send(b.datagram(0x40, Bench::words({0x10007, 3, 9}), 0));
    b.send(b.datagram(0x40, Bench::words({7, 9, 3}), 0));
    b.send(b.datagram(0x40, Bench::words({0, 3, 9}), 0));
    b.send(b.datagram(0x40, Bench::words({7, 3}), 0));
    b.send(b.datagram(0x40, Bench::words({7, 3, 9}), 0x10));
    CHECK(b.stream.resends.size() == 4);
}

TEST_CASE("ACTION triggers when keys and mask agree") {
    Bench b;
    b.take_control();
    CHECK(b.write(reg::action_device_key, 0x11) == ok);
    CHECK(b.write(reg::action_groups, 0x22) == ok);
    CHECK(b.write(reg::action_groups + 4, 0x0F) == ok);
    CHECK(b.write(address_of("TriggerMode"), 1) == ok);
    CHECK(b.write(address_of("TriggerSource"), 2) == ok);
    CHECK(b.write(address_of("AcquisitionStart"), 1) == ok);
    const auto fire = [&](std::uint32_t device, std::uint32_t group, std::uint32_t mask) {
        return Bench::status(b.send(b.datagram(0x100, Bench::words({device, group, mask})), bob, true));
    };
    CHECK(fire(0x12, 0x22, 1) == silence);
    CHECK(fire(0x11, 0x23, 1) == silence);
    CHECK(fire(0x11, 0x22, 0x10) == silence);
    CHECK(b.camera.triggers() == 0);
    CHECK(fire(0x11, 0x22, 0x18) == ok);
    CHECK(b.camera.triggers() == 1);
}

TEST_CASE("Scheduled actions fire at their instant, in the scheduling clock") {
    Bench b;
    b.clock.set_tai_offset_ns(5'000'000'000'000'000);
    b.take_control();
    CHECK(b.write(reg::action_groups + 4, 1) == ok);
    CHECK(b.write(address_of("TriggerMode"), 1) == ok);
    CHECK(b.write(address_of("TriggerSource"), 2) == ok);
    CHECK(b.write(address_of("AcquisitionStart"), 1) == ok);
    const auto schedule = [&](std::int64_t ahead_ns) {
        const auto t = static_cast<std::uint64_t>(b.clock.now().ns + b.clock.tai_offset_ns() + ahead_ns);
        return Bench::status(b.send(b.datagram(
            0x100,
            Bench::words({0, 0, 1, static_cast<std::uint32_t>(t >> 32), static_cast<std::uint32_t>(t)}),
            0x81)));
    };
    const Time start = b.clock.now();
    CHECK(schedule(2000) == ok);
    CHECK(schedule(1000) == ok);
    CHECK(b.port.deadline() == start + 1000);
    b.clock.advance(999);
    b.port.on_timer(b.clock.now());
    CHECK(b.camera.triggers() == 0);
    b.clock.advance(1);
    b.port.on_timer(b.clock.now());
    CHECK(b.camera.triggers() == 1);
    b.clock.advance(1000);
    b.port.on_timer(b.clock.now());
    CHECK(b.camera.triggers() == 2);
    CHECK(schedule(-1) == 0x8016); // ACTION_LATE
    CHECK(schedule(INT64_MAX - b.clock.now().ns - b.clock.tai_offset_ns()) == invalid_parameter); // 2262
    CHECK(b.camera.triggers() == 2);
    for (int i = 0; i < 16; ++i)
        CHECK(schedule(1'000'000 + i) == ok);
    CHECK(schedule(5'000'000) == 0x8015); // OVERFLOW
}

TEST_CASE("Status codes of later versions can be switched off") {
    Bench b;
    b.clock.set_tai_offset_ns(5'000'000'000'000'000); // so that a small number of ns is long ago
    CHECK((Bench::word(b.read(reg::gvcp_capability)) & 0x00440000) == 0x00440000);
    CHECK(Bench::word(b.read(reg::gvcp_configuration)) == 0x40006); // on, and PENDING_ACK
    b.take_control();
    CHECK(b.write(reg::action_groups + 4, 1) == ok);
    const auto late = [&] {
        return Bench::status(b.send(b.datagram(0x100, Bench::words({0, 0, 1, 0, 1}), 0x81)));
    };
    auto lying = b.datagram(0x80, Bench::words({reg::version}));
    lying[5] = 8; // bytes of payload, there are 4
    CHECK(late() == 0x8016);
    CHECK(Bench::status(b.send(lying)) == invalid_header);
    CHECK(b.write(reg::gvcp_configuration, 0x4) == ok);
    CHECK(late() == 0x8FFF);
    CHECK(Bench::status(b.send(lying)) == invalid_header);
    CHECK(b.write(reg::gvcp_configuration, 0x40000) == ok);
    CHECK(late() == 0x8016);
    CHECK(Bench::status(b.send(lying)) == 0x8FFF);

    // Status codes of resend requests.
    const StatusCodes all, none{false, false}, first{true, false};
    for (const Status s : {Status::packet_not_yet_available, Status::packet_removed}) {
        CHECK(all.shown(s) == s);
        CHECK(first.shown(s) == Status::packet_unavailable);
        CHECK(none.shown(s) == Status::error);
    }
    CHECK(first.shown(Status::packet_unavailable) == Status::packet_unavailable);
    CHECK(none.shown(Status::packet_unavailable) == Status::error);
    CHECK(none.shown(Status::busy) == Status::busy); // there from the beginning
}

TEST_CASE("An action without a controller counts only when that was allowed") {
    Bench b;
    b.take_control();
    CHECK(b.write(reg::action_groups + 4, 1) == ok);
    CHECK(b.write(reg::gvcp_configuration, 8) == ok);
    CHECK(b.write(reg::control_privilege, 0) == ok);
    const auto fire = [&] { return Bench::status(b.send(b.datagram(0x100, Bench::words({0, 0, 1})), bob)); };
    CHECK(fire() == ok);
    b.take_control();
    CHECK(b.write(reg::gvcp_configuration, 0) == ok);
    CHECK(b.write(reg::control_privilege, 0) == ok);
    CHECK(fire() == silence);
}

TEST_CASE("Control switches over to who knows the key, when the controller allows it") {
    Bench b;
    b.take_control(alice);
    CHECK(b.write(reg::switchover_key, 0x10000) == invalid_parameter);
    CHECK(b.write(reg::switchover_key, 0xBEEF) == ok);
    CHECK(Bench::word(b.read(reg::switchover_key)) == 0); // not for reading
    CHECK(b.write(reg::control_privilege, 0xBEEF0002, bob) == access_denied);
    CHECK(b.write(reg::control_privilege, 6) == ok);
    CHECK(b.write(reg::control_privilege, 0xBEE00002, bob) == access_denied);
    CHECK(b.write(reg::control_privilege, 0xBEEF0000, bob) == access_denied); // to release is not to take
    CHECK(b.write(reg::control_privilege, 0xBEEF0002, bob) == ok);
    CHECK(Bench::word(b.read(reg::primary_ip)) == bob.ip);
    CHECK(b.write(address_of("Gain"), 1000, alice) == access_denied);
    CHECK(b.write(address_of("Gain"), 1000, bob) == ok);
}

TEST_CASE("A slow command is announced with PENDING_ACK and answered in the end") {
    Bench b;
    b.take_control();
    const Bytes pending = b.ask(0x82, Bench::words({address_of("TestPendingAck"), 800}));
    CHECK(Bench::status(pending) == ok);
    CHECK(load_be16(&pending[2]) == 0x89);
    CHECK(load_be16(&pending[10]) > 800);
    const std::uint16_t id = load_be16(&pending[6]);
    Peer to;
    CHECK(b.port.take_due_reply(b.clock.now(), to).empty());
    CHECK(b.port.deadline() == b.clock.now() + 800 * ns_per_ms);
    CHECK(Bench::status(b.read(0)) == ok); // others are served meanwhile
    b.clock.advance(800 * ns_per_ms);
    const auto late = b.port.take_due_reply(b.clock.now(), to);
    REQUIRE(late.size() == 12);
    CHECK(to == alice);
    CHECK(load_be16(late.data() + 2) == 0x83);
    CHECK(load_be16(late.data() + 6) == id);
    CHECK(b.port.take_due_reply(b.clock.now(), to).empty());
}

TEST_CASE("Without PENDING_ACK a slow command is answered in the end only") {
    Bench b;
    b.take_control();
    CHECK(b.write(reg::gvcp_configuration, 0) == ok);
    CHECK(b.ask(0x82, Bench::words({address_of("TestPendingAck"), 800})).empty());
    b.clock.advance(800 * ns_per_ms);
    Peer to;
    CHECK(b.port.take_due_reply(b.clock.now(), to).size() == 12);
}

TEST_CASE("Bootstrap registers tell of IEEE 1588 where it is watched") {
    constexpr std::uint32_t ieee1588 = 0x00080000, extended = 0x00010000;
    Bench b;
    b.take_control();
    CHECK(Bench::word(b.read(reg::gvcp_capability)) == 0xD876006F); // all but IEEE 1588
    CHECK(Bench::word(b.read(reg::ptp_status)) == static_cast<std::uint32_t>(PtpState::disabled));
    CHECK(Bench::word(b.read(reg::ptp_supported_profiles)) == 0);
    PtpStatus status;
    status.state = PtpState::slave;
    b.device.set_ptp([&] { return status; });
    CHECK(Bench::word(b.read(reg::gvcp_capability)) == (0xD876006F | ieee1588 | extended));
    CHECK(Bench::word(b.read(reg::ptp_status)) == 9);
    status.state = PtpState::listening;
    CHECK(Bench::word(b.read(reg::ptp_status)) == 4);
    CHECK(Bench::word(b.read(reg::ptp_extended_capability)) == 0x80000000);
    CHECK(Bench::word(b.read(reg::ptp_supported_profiles)) == 0x80000000);
    CHECK(Bench::word(b.read(reg::ptp_selected_profile)) == 0);
    // It is on and stays on: the clock is steered from outside.
    CHECK(Bench::word(b.read(reg::gvcp_configuration)) == (ieee1588 | 0x40006));
    CHECK(b.write(reg::gvcp_configuration, 2) == invalid_parameter);
    CHECK(b.write(reg::gvcp_configuration, ieee1588 | 2) == ok);
    CHECK(Bench::word(b.read(reg::link_capability)) == 1);
    CHECK(Bench::word(b.read(reg::link_configuration)) == 0);
}

TEST_CASE("Unknown senders get no answer, known ones their share of answers") {
    Bench b;
    const Peer routed{0x08080808, 50000};
    CHECK(Bench::status(b.send(b.datagram(0x02, {}), routed)) == silence);
    GigeSettings far;
    far.off_link = true;
    CHECK(Bench::status(Bench(far).send(b.datagram(0x02, {}), routed)) == ok);
    GigeSettings listed;
    listed.allow = "192.168.7.4/31";
    CHECK(Bench::status(Bench(listed).send(b.datagram(0x02, {}), alice)) == ok);
    CHECK(Bench::status(Bench(listed).send(b.datagram(0x02, {}), bob)) == silence);
    GigeSettings quiet;
    quiet.read_only = true;
    Bench reader(quiet);
    CHECK(Bench::status(reader.read(0)) == ok);
    CHECK(reader.write(reg::control_privilege, 2) == access_denied);

    // 1 MB at once, then 4 MB/s.
    std::size_t bytes = 0;
    for (int i = 0; i < 10'000; ++i)
        bytes += b.send(b.datagram(0x02, {}), bob).size();
    CHECK(bytes > 950'000);
    CHECK(bytes <= 1'000'000);
    CHECK(Bench::status(b.send(b.datagram(0x02, {}), alice)) == ok); // others are not held up
    b.clock.advance(100 * ns_per_ms);
    bytes = 0;
    for (int i = 0; i < 10'000; ++i)
        bytes += b.send(b.datagram(0x02, {}), bob).size();
    CHECK(bytes > 380'000);
    CHECK(bytes <= 400'000);
}

TEST_CASE("User sets bring settings back, also after a restart") {
    const std::string file = "/tmp/gige_state_" + std::to_string(getpid());
    GigeSettings s;
    s.state_file = file;
    {
        Bench b(s);
        b.take_control();
        CHECK(b.write(address_of("Width"), 320) == ok);
        CHECK(b.write(address_of("OffsetX"), 100) == ok);
        CHECK(b.write(address_of("Gain"), 6000) == ok);
        CHECK(b.write_memory(reg::user_name, {'n', 'a', 'm', 'e', 0, 0, 0, 0}) == ok);
        CHECK(b.write(address_of("UserSetSave"), 1) == write_protect); // the default set is not for saving
        CHECK(b.write(address_of("UserSetSelector"), 1) == ok);
        CHECK(b.write(address_of("UserSetSave"), 1) == ok);
        CHECK(b.write(address_of("UserSetDefault"), 1) == ok);
        CHECK(b.write(address_of("UserSetSelector"), 0) == ok);
        CHECK(b.write(address_of("UserSetLoad"), 1) == ok);
        CHECK(b.camera.settings().region == Region{0, 0, 640, 480});
        CHECK(b.camera.settings().gain_db == 0);
    }
    {
        Bench b(s);
        CHECK(b.camera.settings().region == Region{100, 0, 320, 480});
        CHECK(b.camera.settings().gain_db == 6);
        CHECK(b.device.registers().text(reg::user_name) == "name");
        b.take_control();
        CHECK(b.write(address_of("DeviceReset"), 1) == ok);
        CHECK(b.camera.settings().region == Region{0, 0, 640, 480});
    }
    std::remove(file.c_str());
}

TEST_CASE("A camera's name is kept as soon as it is written") {
    const test::TempFolder folder;
    GigeSettings s;
    s.state_file = (folder.path() / "state").string();
    {
        Bench b(s);
        b.take_control();
        CHECK(b.write_memory(reg::user_name, {'n', 'a', 'm', 'e', 0, 0, 0, 0}) == ok);
    }
    CHECK(Bench(s).device.registers().text(reg::user_name) == "name");
}

TEST_CASE("What a state file says is escaped, checked and validated") {
    const test::TempFolder folder;
    const std::string file = (folder.path() / "state").string();
    const DeviceState state{R"(a "b" \c)", 1, {{0xA150, 12345}, {0xA154, 0xFFFFFFFF}}};
    REQUIRE(write_state(file, state).empty());
    DeviceState read;
    CHECK(read_state(file, read).empty());
    CHECK(read == state);
    const std::string good = test::text_of(file);

    // Version 1 had exposure times in 10 ns: 123.45 us, and of Region1 0.5 us. The checksum is that of zlib.
    std::ofstream(file)
        << "version = 1\ndevice_user_id = \"a\"\nuser_set_default = 1\nuser_set_1 = [ # register, "
           "word\n    [0xa150, 0x3039],\n    [0xa154, 0xffffffff],\n    [0xb054, 0x32],\n]\n"
           "checksum = \"fed33f8f\"\n";
    CHECK(read_state(file, read).empty());
    CHECK(read.user_set_1 == std::vector<SavedWord>{{0xA150, 123}, {0xA154, 0xFFFFFFFF}, {0xB054, 1}});

    const auto refused = [&](const std::string& text) {
        std::ofstream(file) << text;
        DeviceState untouched{"old", 0, {}};
        const std::string why = read_state(file, untouched);
        CHECK(untouched == DeviceState{"old", 0, {}});
        return why;
    };
    std::string changed = good;
    changed[changed.find("0x3039")] = '1';
    CHECK(refused(changed) == "damaged or changed by hand: its checksum does not match");
    CHECK(refused(good + "# more\n") == "damaged or changed by hand: its checksum does not match");
    for (std::size_t n = 0; n < good.size(); ++n)
        CHECK_FALSE(refused(good.substr(0, n)).empty());
    CHECK(refused("name x\ndefault 1\n0xa150 0x3039\n") == "not a state file of this version");
    CHECK(refused("") == "not a state file of this version");
    CHECK(refused(std::string(1 << 20, '\n')) == "larger than 65536 bytes, no state file");
    CHECK(read_state(folder.path().string(), read) == "not a regular file");
    const std::string pipe = (folder.path() / "pipe").string();
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    CHECK(read_state(pipe, read) == "not a regular file");
    CHECK(read_state((folder.path() / "none").string(), read).empty());
    CHECK(read == DeviceState{});
    CHECK_FALSE(write_state((folder.path() / "none" / "state").string(), state).empty());
    // A link under the name of the next temporary file, names count up, is not followed.
    const std::string victim = folder.write("victim", "precious");
    const std::string name = temporary_beside(file).string();
    const std::size_t digits = name.rfind('.', name.size() - 5) + 1;
    const std::string next = std::to_string(std::stoul(name.substr(digits)) + 1);
    std::filesystem::create_symlink(victim, name.substr(0, digits) + next + ".tmp");
    CHECK(write_state(file, state) == "cannot be written: File exists");
    CHECK(test::text_of(victim) == "precious");
    CHECK(write_state(file, state).empty());
}

TEST_CASE("A command writes the state file once at most, and only for a change") {
    const test::TempFolder folder;
    const int watch = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    REQUIRE(inotify_add_watch(watch, folder.path().c_str(), IN_MOVED_TO) >= 0);
    const auto writes = [&] {
        std::size_t n = 0;
        std::array<char, 65536> events;
        for (ssize_t bytes = 0; (bytes = read(watch, events.data(), events.size())) > 0;)
            for (ssize_t at = 0; at < bytes; ++n) {
                inotify_event event{};
                std::memcpy(&event, events.data() + at, sizeof event);
                at += static_cast<ssize_t>(sizeof event + event.len);
            }
        return n;
    };
    GigeSettings s;
    s.state_file = (folder.path() / "state").string();
    Bench b(s);
    b.take_control();
    Bytes many;
    for (std::uint32_t i = 0; i < 67; ++i) {
        const Bytes entry = Bench::words({reg::user_name + i % 4 * 4, 0x41414141 + i % 26});
        many.insert(many.end(), entry.begin(), entry.end());
    }
    CHECK(Bench::status(b.ask(0x82, many)) == ok);
    CHECK(writes() == 1);
    CHECK(Bench::status(b.ask(0x82, many)) == ok);
    CHECK(writes() == 0);
    CHECK(b.write(address_of("UserSetSelector"), 1) == ok);
    Bytes saves;
    for (int i = 0; i < 67; ++i) {
        const Bytes entry = Bench::words({address_of("UserSetSave"), 1});
        saves.insert(saves.end(), entry.begin(), entry.end());
    }
    CHECK(Bench::status(b.ask(0x82, saves)) == ok);
    CHECK(writes() == 1);
    REQUIRE(std::remove(s.state_file.c_str()) == 0);
    CHECK(b.write(address_of("UserSetSave"), 1) == ok); // what is gone is written again
    CHECK(writes() == 1);
    close(watch);
}

TEST_CASE("A state file that is not the camera's is left as it is") {
    const test::TempFolder folder;
    GigeSettings s;
    s.state_file = (folder.path() / "state").string();
    const std::string foreign = "notes of another program\n";
    std::ofstream(s.state_file) << foreign;
    Bench b(s);
    b.take_control();
    CHECK(b.write(address_of("UserSetSelector"), 1) == ok);
    CHECK(b.write(address_of("UserSetSave"), 1) == static_cast<int>(Status::error));
    CHECK(b.write_memory(reg::user_name, {'n', 'a', 'm', 'e', 0, 0, 0, 0}) == ok);
    CHECK(test::text_of(s.state_file) == foreign);
}

TEST_CASE("Words of a state file pass the same checks as a client's") {
    const test::TempFolder folder;
    GigeSettings s;
    s.state_file = (folder.path() / "state").string();
    const std::uint32_t too_wide = 100'000;
    REQUIRE(write_state(s.state_file, {"x",
                                       1,
                                       {{address_of("Width"), too_wide},
                                        {address_of("Gain"), 6000},
                                        {reg::stream_destination, 0x01020304},
                                        {0xFFFFFFFC, 1}}})
                .empty());
    Bench b(s);
    CHECK(b.camera.settings().region.width == 640);
    CHECK(b.camera.settings().gain_db == 6);
    CHECK(b.device.registers().peek(reg::stream_destination) == 0); // no part of user sets
}

TEST_CASE("Faults strike the same packets in every run, as often as they should") {
    FaultRule rule;
    rule.fault = Fault::lose;
    rule.seed = 1;
    rule.percent = 1;
    rule.first_frame = 3;
    rule.last_frame = 102;
    FaultInjector injector, again;
    injector.set_rules({rule});
    again.set_rules({rule});
    int struck = 0;
    for (std::uint64_t frame = 1; frame <= 200; ++frame)
        for (std::uint32_t packet = 1; packet <= 1000; ++packet) {
            const bool hit = injector.strikes(Fault::lose, frame, packet) != nullptr;
            REQUIRE(hit == (again.strikes(Fault::lose, frame, packet) != nullptr));
            if (frame < 3 || frame > 102) REQUIRE_FALSE(hit);
            struck += hit;
        }
    CHECK(struck > 1000 - 4 * 32); // 100 000 draws at 1 %, standard deviation 31.5
    CHECK(struck < 1000 + 4 * 32);
    CHECK(injector.strikes(Fault::corrupt, 50, 1) == nullptr);
    rule.burst = 50;
    injector.set_rules({rule});
    int runs = 0;
    for (std::uint32_t packet = 0; packet < 100'000; packet += 50) {
        const bool hit = injector.strikes(Fault::lose, 3, packet) != nullptr;
        runs += hit;
        for (std::uint32_t k = 1; k < 50; ++k)
            REQUIRE((injector.strikes(Fault::lose, 3, packet + k) != nullptr) == hit);
    }
    CHECK(runs > 5);
    CHECK(runs < 45);
    for (std::size_t i = 0; i < fault_count; ++i)
        CHECK(enum_named<Fault>(name_of(static_cast<Fault>(i))) == static_cast<Fault>(i));
}

TEST_CASE("Features and calls show and change one list of fault rules") {
    GigeSettings s;
    s.drop_percent = 1;
    s.faults = {{.fault = Fault::corrupt, .percent = 5, .first_frame = 10}};
    Bench b(s);
    b.take_control();
    const auto percent = [&](Fault f) {
        return Bench::word(b.read(address_of("FaultPercent", static_cast<std::uint32_t>(f))));
    };
    const auto set = [&](const char* feature, Fault f, std::uint32_t word) {
        return b.write(address_of(feature, static_cast<std::uint32_t>(f)), word);
    };
    const auto armed = [&] { return b.device.armed_faults().all(); };
    REQUIRE(armed().size() == 2);
    CHECK(armed()[0].label == "rule_1_corrupt");
    CHECK(percent(Fault::corrupt) == 0); // of the configuration, and in a window
    CHECK(percent(Fault::lose) == 0);

    CHECK(set("FaultAmount", Fault::delay, 250) == ok);
    CHECK(set("FaultPercent", Fault::delay, 12'500) == ok);
    CHECK(set("FaultPercent", Fault::delay, 100'001) == invalid_parameter);
    REQUIRE(armed().size() == 3);
    CHECK(armed()[2].rule.percent == 12.5);
    CHECK(armed()[2].rule.amount == 250);
    CHECK(armed()[2].origin == FaultOrigin::feature);

    // A call replaces all but what is there already, and its plain rules are the features.
    *armed()[1].rule.struck = 7;
    b.device.arm_faults({{.fault = Fault::lose, .percent = 1},
                         {.fault = Fault::wrong_timestamp, .percent = 2, .amount = 30},
                         {.fault = Fault::wrong_timestamp, .percent = 50, .amount = -30},
                         {.fault = Fault::skip_frame, .percent = 3, .every_frames = 2}});
    REQUIRE(armed().size() == 4);
    CHECK(armed()[0].label == "drop_percent");
    CHECK(armed()[0].struck() == 7);
    CHECK(percent(Fault::delay) == 0);
    CHECK(percent(Fault::wrong_timestamp) == 2000);
    CHECK(Bench::word(
              b.read(address_of("FaultAmount", static_cast<std::uint32_t>(Fault::wrong_timestamp)))) == 30);
    CHECK(percent(Fault::skip_frame) == 0); // features cannot say it
    CHECK(Bench::word(b.read(address_of("FaultStruck", static_cast<std::uint32_t>(Fault::lose)))) == 7);
    CHECK(set("FaultPercent", Fault::wrong_timestamp, 4000) == ok);
    CHECK(armed()[1].rule.percent == 4);
    CHECK(set("FaultPercent", Fault::wrong_timestamp, 0) == ok);
    REQUIRE(armed().size() == 3);
    CHECK(armed()[1].rule.amount == -30);
    // What strikes is the list.
    CHECK(b.device.control_faults().strikes(Fault::skip_frame, 2) == nullptr);
    b.device.arm_faults({});
    CHECK(armed().empty());
    CHECK_FALSE(b.device.control_faults().any());
}

TEST_CASE("Control faults that TestControl shows end with control, others do not") {
    Bench b;
    b.take_control();
    b.device.arm_faults({{.fault = Fault::heartbeat_loss},
                         {.fault = Fault::mute_control, .first_frame = 1'000'000},
                         {.fault = Fault::lose, .percent = 2}});
    b.device.control_lost();
    REQUIRE(b.device.armed_faults().all().size() == 2);
    CHECK(b.device.armed_faults().all()[0].rule.fault == Fault::mute_control);
}

TEST_CASE("Time stamps are TAI, latched whole, and restart at a reset") {
    Bench b;
    b.clock.set_tai_offset_ns(5'000'000'000'000'000'000);
    b.take_control();
    CHECK(b.write(reg::timestamp_control, 2) == ok);
    const auto latched = [&] {
        return std::uint64_t{Bench::word(b.read(reg::timestamp_high))} << 32 |
               Bench::word(b.read(reg::timestamp_low));
    };
    const auto expected = static_cast<std::uint64_t>(b.clock.now().ns + 5'000'000'000'000'000'000);
    CHECK(latched() == expected);
    b.clock.advance(1000);
    CHECK(latched() == expected);
    CHECK(b.write(reg::timestamp_control, 3) == ok); // latch, then reset
    CHECK(latched() == expected + 1000);
    b.clock.advance(77);
    CHECK(b.write(reg::timestamp_control, 2) == ok);
    CHECK(latched() == 77);
    // Stamps of a stream have one origin.
    CHECK(b.write(reg::stream_port, 5555) == ok);
    CHECK(b.write(address_of("AcquisitionStart"), 1) == ok);
    CHECK(b.write(reg::timestamp_control, 1) == write_protect);
    CHECK(b.write(reg::timestamp_control, 2) == ok);
}

TEST_CASE("100 000 random and damaged datagrams neither crash the device nor get control of it") {
    Bench b;
    b.take_control(alice);
    const std::vector<Bytes> seeds = {
        b.datagram(0x02, {}),
        b.datagram(0x80, Bench::words({0xA00, 0x938})),
        b.datagram(0x82, Bench::words({0xA00, 2, address_of("Width"), 64})),
        b.datagram(0x84, Bench::words({0x200, 512})),
        b.datagram(0x86, Bench::words({0xE8, 0x41414141, 0, 0, 0})),
        b.datagram(0x40, Bench::words({1, 0, 0xFFFFFF}), 0),
        b.datagram(0x100, Bench::words({1, 2, 3})),
        b.datagram(0x04, Bytes(56)),
    };
    std::uint32_t n = 0;
    const auto random = [&n] { return philox4x32({n++, 0, 0, 7}, {1, 2})[0]; };
    std::size_t longest = 0, answers = 0;
    for (int i = 0; i < 100'000; ++i) {
        Bytes d;
        if (random() % 4 == 0) {
            d.resize(random() % 600);
            for (auto& byte : d)
                byte = static_cast<std::uint8_t>(random());
            if (!d.empty()) d[0] = 0x42;
        } else {
            d = seeds[random() % seeds.size()];
            for (std::uint32_t k = random() % 4; k > 0; --k)
                d[random() % d.size()] = static_cast<std::uint8_t>(random());
            if (random() % 8 == 0) d.resize(random() % 560);
        }
        const Bytes reply = b.send(d, random() % 2 == 0 ? alice : bob, random() % 8 == 0);
        longest = std::max(longest, reply.size());
        answers += !reply.empty();
        REQUIRE(explain_invalid(b.camera.settings(), b.camera.limits()).empty());
    }
    CHECK(longest <= 548);
    CHECK(answers > 10'000);
    CHECK(Bench::status(b.read(0, bob)) == ok); // still there
}

TEST_CASE("Histogram quantiles are right to a bin of 6 %") {
    LatencyHistogram h;
    CHECK(h.quantile_ns(0.5) == 0);
    for (int i = 1; i <= 1000; ++i)
        h.add(i * 1000);
    CHECK(h.quantile_ns(0.5) >= 500'000);
    CHECK(h.quantile_ns(0.5) <= 532'000);
    CHECK(h.quantile_ns(0.99) >= 990'000);
    CHECK(h.quantile_ns(1.0) == 1'000'000);
    h.add(-5);
    CHECK(h.quantile_ns(0.0001) == 0);
}

} // namespace gige_control_test
