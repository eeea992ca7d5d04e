// SPDX-License-Identifier: Apache-2.0
// The whole daemon inside the test, seen by an independent GigE Vision client (libaravis).
#include "core/clock.hpp"
#include "emulator/daemon/daemon.hpp"
#include "emulator/daemon/tai_reference.hpp"
#include "sync/inputs/udp_input.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/integration/event_socket.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/settings.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

namespace daemon_gige_test {

using namespace obscura;
using namespace obscura::test;

namespace {

std::uint64_t tai_now() {
    MonotonicClock clock;
    clock.set_tai_correction(emulator::TaiReference().refresh(0));
    return static_cast<std::uint64_t>(clock.now().ns + clock.tai_offset_ns());
}

/// A datagram as an edge at `tai_ns`.
void send_trigger(const std::string& address, std::uint16_t port, std::uint64_t tai_ns) {
    const auto message = sync::encode({0, static_cast<std::int64_t>(tai_ns)});
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    REQUIRE(inet_pton(AF_INET, address.c_str(), &to.sin_addr) == 1);
    const auto* where = reinterpret_cast<const sockaddr*>(&to);
    CHECK(sendto(fd, message.data(), message.size(), 0, where, sizeof to) ==
          static_cast<ssize_t>(message.size()));
    close(fd);
}

void listen_to(GigeClient& client, const EventSocket& events, const char* event) {
    client.set("GevMCPHostPort", std::int64_t{events.port()});
    client.set("EventSelector", event);
    client.set("EventNotification", "On");
}

} // namespace

TEST_CASE("a client hears of triggers that were missed") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(11);
    options.size = 128;
    options.rate_hz = 2000; // the exposure alone takes 5 ms
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    EventSocket events;
    listen_to(client, events, "FrameTriggerMissed");
    client.open_stream(4);
    const std::uint64_t begin = tai_now();
    client.execute("AcquisitionStart");
    std::uint64_t before = begin;
    for (int i = 0; i < 3; ++i) {
        const auto missed = events.receive(5000);
        REQUIRE(missed);
        CHECK(missed->id == 0x9004);
        CHECK(missed->block == 0);
        // Stamped with the edge that was missed, in the order in which they came; one whose acknowledgement
        // was late comes again.
        CHECK(missed->timestamp >= before - (i == 0 ? 1'000'000 : 0));
        CHECK(missed->timestamp < tai_now());
        before = missed->timestamp;
    }
    client.execute("AcquisitionStop");
    CHECK(daemon.camera().counters().missed_triggers >= 3);
}

TEST_CASE("further lines, counters and timers trigger the daemon's camera") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(31);
    options.size = 64;
    constexpr std::uint16_t line1 = 5002, line3 = 5003; // ports of an address of its own
    options.more = fmt::format("[trigger.line1]\nsource = \"udp\"\nlisten = \"{0}:{1}\"\n"
                               "[trigger.line3]\nsource = \"udp\"\nlisten = \"{0}:{2}\"\n",
                               options.address, line1, line3);
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.set("ExposureTime", 1000.0);
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerMode", "On");
    const auto edge = [&](std::uint16_t port) {
        const std::uint64_t t = tai_now();
        send_trigger(options.address, port, t);
        return t;
    };
    client.open_stream(6);
    // Takes the next frame, whose trigger has to be at `t`.
    const auto expect_frame_at = [&](std::uint64_t t) {
        const auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        // Give or take the reading of two clocks.
        const auto apart = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer.get()) - t);
        CHECK(std::abs(apart) < 50'000);
    };
    const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(40)); };

    client.set("TriggerSource", "Line3");
    client.execute("AcquisitionStart");
    edge(line1);
    expect_frame_at(edge(line3));
    client.execute("AcquisitionStop");

    client.set("CounterSelector", "Counter0");
    client.set("CounterEventSource", "Line1");
    client.set("CounterResetSource", "CounterEnd");
    client.set("CounterDuration", std::int64_t{2});
    client.set("TriggerSource", "Counter0End");
    client.execute("AcquisitionStart");
    for (int i = 0; i < 3; ++i) {
        edge(line1);
        pause();
        expect_frame_at(edge(line1));
        pause();
    }
    client.execute("AcquisitionStop");

    client.set("TimerSelector", "Timer1");
    client.set("TimerTriggerSource", "Line3");
    client.set("TimerDelay", 500.0);
    client.set("TimerDuration", 2500.0);
    client.set("TriggerSource", "Timer1End");
    client.execute("AcquisitionStart");
    expect_frame_at(edge(line3) + 3'000'000);
    CHECK(client.text("TimerStatus") == "TimerCompleted");
    client.execute("AcquisitionStop");
    client.set("LineSelector", "Line4");
    CHECK(client.text("LineMode") == "Output");
    client.set("LineSelector", "Line3");
    CHECK(client.text("LineMode") == "Input");
    client.set("TriggerSource", "Line3");
    CHECK_THROWS(client.set("TriggerActivation", "LevelHigh")); // datagrams are edges of one kind
    CHECK_THROWS(client.set("ExposureMode", "TriggerWidth"));
    CHECK(daemon.camera().counters().missed_triggers == 0);
}

TEST_CASE("a frame leaves when the chip would have read it, or as soon as it is rendered") {
    const bool fast = GENERATE(false, true);
    CAPTURE(fast);
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(fast ? 33 : 34);
    options.size = 64;
    options.rate_hz = 0.5;
    options.camera_more = fast ? "readout_timing = \"fast\"\n" : "";
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.set("ExposureTime", 1e6);
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerSource", "Software");
    client.open_stream(4);
    client.execute("AcquisitionStart");
    client.execute("TriggerSoftware");
    const auto buffer = client.next();
    const std::uint64_t arrived = tai_now();
    REQUIRE(buffer != nullptr);
    CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
    const std::uint64_t edge = arv_buffer_get_timestamp(buffer.get());
    CHECK((arrived < edge + 1'000'000'000) == fast); // a second of exposure
    const auto counters = daemon.camera().counters();
    CHECK(counters.late == 0);
}

TEST_CASE("a client hears of frames that could not be made in time") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(12);
    options.size = 512;
    options.rate_hz = 20;
    options.more = "[deadline]\npolicy = \"drop\"\n";
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    EventSocket events;
    listen_to(client, events, "Error");
    client.set("ExposureTime", 10.0); // the first row is due sooner than any renderer can be
    client.open_stream(4);
    client.execute("AcquisitionStart");
    const auto error = events.receive(5000);
    client.execute("AcquisitionStop");
    REQUIRE(error);
    CHECK(error->id == 0x9005);
    CHECK(error->block == 1);
    CHECK(daemon.camera().counters().late_dropped >= 1);
}

TEST_CASE("a binned frame of the detector is the whole one of the same trigger, put together") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(29);
    options.size = 128;
    options.rate_hz = 20;
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.set("PixelFormat", "Mono16");
    // Every acquisition begins with the same frames.
    const auto receive = [&] {
        std::vector<std::vector<int>> frames;
        client.open_stream(6);
        client.execute("AcquisitionStart");
        for (int i = 0; i < 3; ++i) {
            const auto buffer = client.next();
            REQUIRE(buffer != nullptr);
            REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            std::size_t bytes = 0;
            const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &bytes));
            std::vector<int>& pixels = frames.emplace_back();
            for (std::size_t at = 0; at + 1 < bytes; at += 2)
                pixels.push_back(data[at] | data[at + 1] << 8);
        }
        client.execute("AcquisitionStop");
        client.close_stream();
        return frames;
    };
    const auto whole = receive();
    REQUIRE(whole[0].size() == 128 * 128);
    CHECK(whole[0] != whole[1]);
    for (const auto& [x_size, y_size] : {std::pair{2, 1}, {2, 2}, {4, 4}})
        for (const char* mode : {"Sum", "Average"}) {
            CAPTURE(x_size, y_size, mode);
            client.set("BinningHorizontal", std::int64_t{x_size});
            client.set("BinningVertical", std::int64_t{y_size});
            client.set("BinningHorizontalMode", mode);
            client.set("BinningVerticalMode", mode);
            const auto binned = receive();
            for (std::size_t f = 0; f < binned.size(); ++f) {
                std::vector<int> expected;
                for (int y = 0; y < 128; y += y_size)
                    for (int x = 0; x < 128; x += x_size) {
                        int sum = 0;
                        for (int j = 0; j < y_size; ++j)
                            for (int i = 0; i < x_size; ++i)
                                sum += whole[f][static_cast<std::size_t>((y + j) * 128 + x + i)];
                        const int n = x_size * y_size;
                        expected.push_back(mode[0] == 'S' ? std::min(sum, 65535) : (2 * sum + n) / (2 * n));
                    }
                CHECK((binned[f] == expected));
            }
        }
}

TEST_CASE("fault rules of the configuration strike the stream") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(13);
    options.size = 128;
    options.rate_hz = 40;
    options.more = "[[gige.faults]]\nkind = \"skip_frame\"\nfirst = 2\nlast = 6\nevery = 2\n"
                   "[[gige.faults]]\nkind = \"lose\"\npercent = 20\n";
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.open_stream(12);
    client.execute("AcquisitionStart");
    for (const std::uint64_t id : {1U, 3U, 5U, 7U, 8U}) {
        const auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        CHECK(arv_buffer_get_frame_id(buffer.get()) == id);
        CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
    }
    client.execute("AcquisitionStop");
    CHECK_THAT(daemon.statistics_json(), Catch::Matchers::ContainsSubstring("\"injected_losses\""));
}

TEST_CASE("the configuration knows every fault by the name that the camera has for it") {
    using namespace transports::gige;
    const TempFolder folder;
    for (std::size_t i = 0; i < fault_count; ++i) {
        DaemonOptions options;
        options.address = own_address(14);
        options.size = 64;
        options.more = fmt::format("[[gige.faults]]\nkind = \"{}\"\n", name_of(static_cast<Fault>(i)));
        const emulator::DaemonConfig config = emulator::load_config(write_configuration(folder, options));
        CHECK(config.transports.get<GigeSettings>().faults.at(0).fault == static_cast<Fault>(i));
        CHECK_NOTHROW(emulator::Daemon(config));
    }
}

TEST_CASE("a line camera of one row with tall pixels is served, and tells both pitches") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(22);
    options.size = 256;
    options.height = 1;
    options.rate_hz = 20;
    options.more = "[sensor]\npixel_pitch_um = 4\npixel_pitch_y_um = 80.5\n";
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    CHECK(client.integer("SensorHeight") == 1);
    CHECK(client.integer("Height") == 1);
    CHECK(std::abs(client.real("SensorPixelWidth") - 4) < 1e-9);
    CHECK(std::abs(client.real("SensorPixelHeight") - 80.5) < 1e-9);
    client.open_stream(4);
    client.execute("AcquisitionStart");
    for (int i = 0; i < 3; ++i) {
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        CHECK(arv_buffer_get_image_width(buffer.get()) == 256);
        CHECK(arv_buffer_get_image_height(buffer.get()) == 1);
        client.give_back(std::move(buffer));
    }
    client.execute("AcquisitionStop");
}

TEST_CASE("three cameras in one daemon, two of them on one trigger, are received at once") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(15);
    options.size = 128;
    options.rate_hz = 20;
    options.several = true;
    const std::vector<std::string> addresses{options.address, own_address(16), own_address(17)};
    options.more = fmt::format(R"(
[[camera]]
exposure_us = 2000
gige = {{ interface = "{}", serial = "LEFT", mac = "02:00:00:00:00:0a" }}
[[camera]]
exposure_us = 2000
gige = {{ interface = "{}", serial = "RIGHT", user_name = "right", mac = "02:00:00:00:00:0b" }}
view = {{ position_m = [-20000, 0, 0], boresight = [-1, 0, 0], up = [0, 0, 1] }}
[[camera]]
exposure_us = 2000
gige = {{ interface = "{}", serial = "SLOW" }}
[camera.trigger]
rate_hz = 9
[camera.sensor.readout]
width = 96
)",
                               addresses[0], addresses[1], addresses[2]);
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    CHECK(daemon.address() ==
          fmt::format("{}:3956 {}:3956 {}:3956", addresses[0], addresses[1], addresses[2]));

    std::vector<std::unique_ptr<GigeClient>> clients;
    for (const std::string& a : addresses)
        clients.push_back(std::make_unique<GigeClient>(a));
    CHECK(clients[0]->text("DeviceSerialNumber") == "LEFT");
    CHECK(clients[1]->text("DeviceSerialNumber") == "RIGHT");
    CHECK(clients[1]->text("DeviceUserID") == "right");
    CHECK(clients[2]->text("DeviceSerialNumber") == "SLOW");
    CHECK(clients[2]->integer("SensorWidth") == 96);
    std::vector<std::uint32_t> macs;
    for (const auto& client : clients) {
        guint32 low = 0;
        GError* error = nullptr;
        arv_device_read_register(client->device(), 0x0C, &low, &error);
        check(error, "MAC");
        macs.push_back(low);
    }
    CHECK(macs[0] == 0x0A);
    CHECK(macs[1] == 0x0B);
    CHECK(macs[2] != macs[0]);

    for (const auto& client : clients) {
        client->open_stream(12);
        client->execute("AcquisitionStart");
    }
    std::vector<std::vector<std::uint64_t>> stamps(3);
    std::vector<std::string> pictures(3);
    for (std::size_t c = 0; c < 3; ++c)
        for (std::uint64_t id = 1; id <= 10; ++id) {
            const auto buffer = clients[c]->next();
            REQUIRE(buffer != nullptr);
            REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            CHECK(arv_buffer_get_frame_id(buffer.get()) == id);
            stamps[c].push_back(arv_buffer_get_timestamp(buffer.get()));
            std::size_t bytes = 0;
            const void* data = arv_buffer_get_data(buffer.get(), &bytes);
            if (id == 1) pictures[c].assign(static_cast<const char*>(data), bytes);
        }
    for (const auto& client : clients)
        client->execute("AcquisitionStop");
    // The same edges, stamped alike: the second camera was started later, so it may have missed the first
    // few.
    const auto distance = [](std::uint64_t a, std::uint64_t b) { return a > b ? a - b : b - a; };
    int common = 0;
    for (const std::uint64_t a : stamps[0])
        for (const std::uint64_t b : stamps[1])
            common += distance(a, b) < 10'000;
    CHECK(common >= 5);
    for (std::size_t i = 1; i < 10; ++i)
        CHECK(distance(stamps[2][i] - stamps[2][i - 1], 111'111'111) < 30'000);
    CHECK((pictures[0] != pictures[1])); // they look in opposite directions
    CHECK(pictures[2].size() == 96U * 128 * 2);

    const auto statistics = nlohmann::json::parse(daemon.statistics_json());
    REQUIRE(statistics["cameras"].size() == 3);
    for (std::size_t c = 0; c < 3; ++c) {
        CHECK(statistics["cameras"][c]["address"] == addresses[c] + ":3956");
        CHECK(statistics["cameras"][c]["camera"]["frames"] >= 10);
    }
}

TEST_CASE("the configuration of several cameras may be reloaded as far as their common trigger goes") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(18);
    options.size = 64;
    options.several = true;
    options.more = fmt::format("[[camera]]\ngige = {{ interface = \"{}\", serial = \"A\" }}\n"
                               "[[camera]]\ngige = {{ interface = \"{}\", serial = \"B\" }}\n",
                               own_address(18), own_address(19));
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    options.rate_hz = 50;
    CHECK(daemon.reload(emulator::load_config(write_configuration(folder, options))).empty());
    options.more.replace(options.more.find("\"B\""), 3, "\"C\"");
    CHECK(daemon.reload(emulator::load_config(write_configuration(folder, options))) ==
          "camera[1].gige.serial cannot change while running; restart for that");
    options.more.erase(options.more.rfind("[[camera]]"));
    CHECK_THAT(daemon.reload(emulator::load_config(write_configuration(folder, options))),
               Catch::Matchers::ContainsSubstring("camera[1].gige.interface"));
}

TEST_CASE("the run word of the noise comes with every frame") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(41);
    options.size = 64;
    options.rate_hz = 20;
    options.run = GENERATE(as<std::int64_t>(), 0xC0FFEE01, -1); // the first does not fit a signed word
    CAPTURE(options.run);
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.set("AcquisitionMode", "MultiFrame");
    client.set("AcquisitionFrameCount", std::int64_t{2});
    client.set_flag("ChunkModeActive", true);
    client.set("ChunkSelector", "GroundTruth");
    client.set_flag("ChunkEnable", true);
    client.set_flag("GevSCCFGExtendedChunkData", true);
    client.open_stream(4);
    const Object<ArvChunkParser> parser(arv_camera_create_chunk_parser(client.camera()));
    std::vector<std::int64_t> words;
    for (int acquisition = 0; acquisition < 2; ++acquisition) {
        client.execute("AcquisitionStart");
        for (int frame = 0; frame < 2; ++frame) {
            auto buffer = client.next();
            REQUIRE(buffer != nullptr);
            REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            GError* error = nullptr;
            words.push_back(
                arv_chunk_parser_get_integer_value(parser.get(), buffer.get(), "ChunkSceneRun", &error));
            check(error, "ChunkSceneRun");
            client.give_back(std::move(buffer));
        }
        client.execute("AcquisitionStop");
    }
    // Chosen: every acquisition has it. Random: each acquisition has the word after that of the one before.
    const std::int64_t first = options.run >= 0 ? options.run : words[0];
    const std::int64_t second = options.run >= 0 ? first : (first + 1) & 0xFFFFFFFF;
    CHECK(words == std::vector{first, first, second, second});
    CHECK(words[0] >= 0);
    const auto json = nlohmann::json::parse(daemon.statistics_json());
    CHECK(json["camera"]["run"] == words.back());
}

TEST_CASE("without a PTP daemon the Ptp features say so") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(20);
    options.size = 64;
    options.more = fmt::format("[ptp]\nenabled = true\nsocket = \"{}\"\n", (folder.path() / "none").string());
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    CHECK(client.text("PtpStatus") == "Disconnected");
    CHECK(client.text("PtpServoStatus") == "Unknown");
    client.execute("PtpDataSetLatch");
    CHECK(client.integer("PtpOffsetFromMaster") == 0);
    CHECK(client.integer("PtpClockAccuracy") == 0xFE);
    CHECK_THROWS(client.set("PtpStatus", "Slave"));
}

TEST_CASE("a client lets the camera find the exposure itself") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(16);
    options.size = 128;
    options.rate_hz = 20;
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.set("ExposureTime", 20.0);
    client.set("ExposureAutoPercentile", 100.0); // a star in the dark is all there is to see
    client.set("ExposureAutoTarget", 70.0);
    client.set("ExposureAuto", "Once");
    CHECK_THROWS(client.set("ExposureTime", 30.0)); // it is the camera's now
    client.open_stream(8);
    client.execute("AcquisitionStart");
    const auto brightest = [&] {
        const auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        std::size_t bytes = 0;
        const auto* data = static_cast<const std::uint16_t*>(arv_buffer_get_data(buffer.get(), &bytes));
        const std::uint16_t dn = *std::max_element(data, data + bytes / 2);
        arv_stream_push_buffer(client.stream(), ARV_BUFFER(g_object_ref(buffer.get())));
        return dn;
    };
    const std::uint16_t before = brightest();
    int frames = 1;
    for (; client.text("ExposureAuto") == "Once" && frames < 40; ++frames)
        brightest();
    CHECK(client.text("ExposureAuto") == "Off");
    CHECK(client.real("ExposureTime") > 30.0);
    for (int i = 0; i < 3; ++i) // what was on its way
        brightest();
    CHECK(brightest() > before);
    client.set("ExposureTime", 30.0);
    CHECK(client.real("ExposureTime") == 30.0);
    client.execute("AcquisitionStop");
}

TEST_CASE("a client takes bursts, and frames that wait for an exposure trigger") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(17);
    options.size = 64;
    options.rate_hz = 20;
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    GigeClient client(options.address);
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerMode", "Off");
    client.set("AcquisitionFrameRate", 50.0);
    client.set("TriggerSelector", "FrameBurstStart");
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Software");
    client.set("AcquisitionBurstFrameCount", std::int64_t{4});
    client.open_stream(8);
    client.execute("AcquisitionStart");
    CHECK_THROWS(client.set("AcquisitionBurstFrameCount", std::int64_t{2})); // locked while streaming
    CHECK(client.next(200) == nullptr);
    client.execute("TriggerSoftware");
    std::uint64_t before = 0;
    for (std::uint64_t id = 1; id <= 4; ++id) {
        const auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        CHECK(arv_buffer_get_frame_id(buffer.get()) == id);
        const std::uint64_t at = arv_buffer_get_timestamp(buffer.get());
        // Whole periods, but for how well the offset to TAI is known at each frame.
        if (id > 1) CHECK((at - before + 100'000) % 20'000'000 < 200'000);
        before = at;
    }
    CHECK(client.next(200) == nullptr); // no fifth
    client.execute("AcquisitionStop");
    client.set("TriggerMode", "Off");

    client.set("TriggerSelector", "ExposureStart");
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Software");
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Software");
    client.execute("AcquisitionStart");
    client.execute("TriggerSoftware"); // ready
    CHECK(client.next(200) == nullptr);
    client.set("TriggerSelector", "ExposureStart");
    client.execute("TriggerSoftware");
    CHECK(client.next() != nullptr);
    client.execute("TriggerSoftware"); // nothing is ready
    CHECK(client.next(200) == nullptr);
    client.execute("AcquisitionStop");
}

TEST_CASE("obscura release takes control away from a client that holds the camera") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(21);
    options.size = 64;
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const auto release = [&](const std::string& name, pid_t pid) {
        return std::make_unique<ChildProcess>(folder.path(), name,
                                              std::vector<std::string>{OBSCURA_BINARY_DIR "/tools/obscura",
                                                                       "release", "--pid",
                                                                       std::to_string(pid)});
    };
    {
        GigeClient holder(options.address);
        holder.set("GevHeartbeatTimeout", std::int64_t{60'000});
        const auto in_control = [&holder] {
            return arv_gv_device_is_controller(ARV_GV_DEVICE(holder.device())) != 0;
        };
        CHECK(in_control());
        const auto released = release("release", daemon.process().pid());
        CHECK(released->wait(std::chrono::seconds(30)) == 0);
        // Aravis reads the privilege once a second.
        for (int i = 0; i < 2400 && in_control(); ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        CHECK_FALSE(in_control());
        GigeClient next(options.address);
        CHECK(next.integer("GevHeartbeatTimeout") == 3000);
    }
    const auto nonsense = release("nonsense", getpid());
    CHECK(nonsense->wait(std::chrono::seconds(30)) == 69);
    CHECK_THAT(nonsense->err(), Catch::Matchers::ContainsSubstring("is no running obscurad"));
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(std::chrono::seconds(30)) == 0);
    CHECK_THAT(daemon.process().err(),
               Catch::Matchers::ContainsSubstring("SIGUSR2: clients lose control of the cameras"));
}

} // namespace daemon_gige_test
