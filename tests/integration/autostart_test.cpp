// SPDX-License-Identifier: Apache-2.0
// A daemon that acquires by itself (daemon.autostart) and clients that take its camera for a while.
#include "emulator/daemon/daemon.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

namespace autostart_test {

using namespace obscura;
using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;

namespace {

DaemonOptions options_at(int number) {
    DaemonOptions options;
    options.address = own_address(number);
    options.size = 64;
    options.rate_hz = 20;
    options.daemon_more = "autostart = true\n";
    return options;
}

/// Waits for `good`, 20 s at most.
template<typename Condition>
bool comes_true(const Condition& good) {
    for (int i = 0; i < 2000; ++i) {
        if (good()) return true;
        std::this_thread::sleep_for(10ms);
    }
    return good();
}

/// Without a receiver the frames count as dropped.
bool acquires(emulator::Daemon& daemon) {
    const std::uint64_t before = daemon.camera().counters().triggers;
    return comes_true([&] { return daemon.camera().counters().triggers > before + 2; });
}

/// Takes control of the camera at `address` and says nothing more.
class SilentController {
public:
    explicit SilentController(const std::string& address) : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(3956);
        REQUIRE(inet_pton(AF_INET, address.c_str(), &to.sin_addr) == 1);
        // WRITEREG: control first, without which the other register cannot be written.
        write(to, {0x42, 1, 0, 0x82, 0, 8, 0, 1, 0, 0, 0x0A, 0x00, 0, 0, 0, 2});       // GevCCP
        write(to, {0x42, 1, 0, 0x82, 0, 8, 0, 2, 0, 0, 0x09, 0x38, 0, 0, 0x01, 0xF4}); // 500 ms
    }
    ~SilentController() { close(fd_); }
    SilentController(const SilentController&) = delete;
    SilentController& operator=(const SilentController&) = delete;

private:
    void write(const sockaddr_in& to, const std::array<std::uint8_t, 16>& command) const {
        REQUIRE(sendto(fd_, command.data(), command.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                       sizeof to) == static_cast<ssize_t>(command.size()));
        std::array<std::uint8_t, 64> answer{};
        REQUIRE(recv(fd_, answer.data(), answer.size(), 0) >= 8);
        REQUIRE((answer[0] == 0 && answer[1] == 0)); // status
    }

    int fd_;
};

std::size_t files_below(const std::filesystem::path& folder) {
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        files += entry.is_regular_file() && entry.path().extension() == ".raw" ? 1 : 0;
    return files;
}

} // namespace

TEST_CASE("a client that takes control finds a camera that it can set up") {
    const TempFolder folder;
    const DaemonOptions options = options_at(1);
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    CHECK(acquires(daemon));
    const CameraSettings own = daemon.camera().settings();
    for (int round = 0; round < 2; ++round) {
        CAPTURE(round);
        {
            GigeClient client(options.address);
            CHECK_FALSE(daemon.camera().acquiring());
            CHECK(client.integer("TLParamsLocked") == 0);
            client.set("PixelFormat", "Mono8");
            client.set("Width", std::int64_t{32});
            client.set("ExposureTime", 200.0);
            client.set_flag("ChunkModeActive", true);
            client.set("AcquisitionMode", "SingleFrame");
            client.set("TriggerSelector", "FrameStart");
            client.set("TriggerSource", "Software");
            client.open_stream(4);
            client.execute("AcquisitionStart");
            client.execute("TriggerSoftware");
            const auto buffer = client.next(10'000);
            REQUIRE(buffer != nullptr);
            CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            CHECK(arv_buffer_get_frame_id(buffer.get()) == 1);
            CHECK(arv_buffer_get_image_width(buffer.get()) == 32);
            CHECK(daemon.camera().settings() != own);
        } // leaves: GevCCP becomes 0
        REQUIRE(comes_true([&] { return daemon.camera().acquiring(); }));
        CHECK(daemon.camera().settings() == own);
        CHECK(acquires(daemon));
    }
    const auto statistics = nlohmann::json::parse(daemon.statistics_json());
    CHECK(statistics["transports"]["gige"]["control_taken"] == 2);
    CHECK(statistics["transports"]["gige"]["control_lost"] == 0);
    daemon.stop();
    CHECK_FALSE(daemon.camera().acquiring());
}

TEST_CASE("when the heartbeat of a client dies, the daemon acquires by itself again") {
    const TempFolder folder;
    DaemonOptions options = options_at(2);
    options.frames_folder = (folder.path() / "frames").string();
    std::filesystem::create_directory(options.frames_folder);
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const auto frames_come = [&] {
        const std::size_t before = files_below(options.frames_folder);
        return comes_true([&] { return files_below(options.frames_folder) > before + 2; });
    };
    CHECK(frames_come());
    {
        const SilentController client(options.address);
        CHECK(comes_true(
            [&] { return daemon.process().err().find("has taken control") != std::string::npos; }));
        CHECK(comes_true(
            [&] { return daemon.process().err().find("has been silent for 500 ms") != std::string::npos; }));
        CHECK(frames_come());
    }
    {
        // Taken away from a client that holds it.
        GigeClient holder(options.address);
        CHECK(holder.integer("TLParamsLocked") == 0);
        daemon.process().send(SIGUSR2);
        CHECK(frames_come());
    }
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(30s) == 0);
    const std::string log = daemon.process().err();
    CHECK_THAT(log, ContainsSubstring("autostart: client 127.0.0.1:"));
    CHECK_THAT(log, ContainsSubstring("the daemon's acquisition on " + options.address +
                                      ":3956 stops until it leaves"));
    CHECK_THAT(log, ContainsSubstring(":3956 runs again with the settings of its start"));
    const auto statistics = nlohmann::json::parse(daemon.statistics());
    CHECK(statistics["transports"]["gige"]["control_taken"] == 2);
    CHECK(statistics["transports"]["gige"]["control_lost"] == 1);
}

TEST_CASE("obscura grab takes frames of a daemon that acquires by itself, twice in a row") {
    const TempFolder folder;
    DaemonOptions options = options_at(3);
    options.frames_folder = (folder.path() / "frames").string();
    std::filesystem::create_directory(options.frames_folder);
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    for (int round = 0; round < 2; ++round) {
        CAPTURE(round);
        ChildProcess grab(folder.path(), fmt::format("grab{}", round),
                          {OBSCURA_BINARY_DIR "/tools/obscura", "grab", "--address", options.address,
                           "--frames", "5", "--timeout", "30", "--json"});
        const auto status = grab.wait(60s);
        INFO(grab.out() << grab.err() << daemon.process().err());
        REQUIRE(status == 0);
        CHECK(nlohmann::json::parse(grab.out())["frames"] == 5);
    }
    const std::size_t before = files_below(options.frames_folder);
    CHECK(comes_true([&] { return files_below(options.frames_folder) > before + 5; }));
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(30s) == 0);
}

TEST_CASE("the daemon's own settings are those of its start: the user set that it loads then") {
    const TempFolder folder;
    DaemonOptions options = options_at(4);
    options.gige_more = "state_file = \"" + (folder.path() / "state").string() + "\"\n";
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    {
        GigeClient client(options.address);
        client.set("ExposureTime", 300.0);
        client.set("UserSetSelector", "UserSet1");
        client.execute("UserSetSave");
        client.set("UserSetDefault", "UserSet1");
        client.set("ExposureTime", 400.0);
    }
    REQUIRE(comes_true([&] { return daemon.camera().acquiring(); }));
    CHECK(daemon.camera().settings().exposure_ns == 300'000);
    CHECK(acquires(daemon));
}

TEST_CASE("settings return behind another camera's description, too") {
    const TempFolder folder;
    DaemonOptions options = options_at(6);
    options.gige_more = "xml = \"" OBSCURA_SOURCE_DIR "/tests/support/flight_camera.xml\"\n";
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    {
        GigeClient client(options.address);
        client.set("Width", std::int64_t{32});
        CHECK(daemon.camera().settings().region.width == 32);
    }
    REQUIRE(comes_true([&] { return daemon.camera().acquiring(); }));
    GigeClient next(options.address);
    CHECK(next.integer("Width") == 64);
}

TEST_CASE("without autostart a camera keeps what its client has set and waits") {
    const TempFolder folder;
    DaemonOptions options = options_at(5);
    options.daemon_more.clear();
    emulator::Daemon daemon(emulator::load_config(write_configuration(folder, options)));
    daemon.start();
    {
        GigeClient client(options.address);
        client.set("ExposureTime", 200.0);
    }
    GigeClient next(options.address);
    CHECK(next.real("ExposureTime") == 200.0);
    CHECK_FALSE(daemon.camera().acquiring());
}

} // namespace autostart_test
