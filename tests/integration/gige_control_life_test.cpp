// SPDX-License-Identifier: Apache-2.0
// The life of a controller on real sockets and clocks: heartbeat, retries, who may and who may not.
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/gige_bench.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/gige.hpp"
#include "transports/gige/wire/gvcp.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <iostream>
#include <optional>
#include <thread>
#include <vector>

namespace gige_control_life_test {

using namespace obscura;
using namespace obscura::test;
using namespace obscura::transports::gige;
using SteadyClock = std::chrono::steady_clock;

namespace {

const std::string address = own_loopback_address();

struct Bench : GigeBench {
    explicit Bench(GigeSettings settings = {}) : GigeBench(limits(), at(std::move(settings))) {}
    static CameraLimits limits() {
        CameraLimits l;
        l.sensor_width = l.sensor_height = 64;
        return l;
    }
    static GigeSettings at(GigeSettings s) {
        s.interface = address;
        return s;
    }
};

/// A control application by hand; `from` is its own loopback address.
class Application {
public:
    explicit Application(const std::string& from = "127.0.0.1") : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
        sockaddr_in own{};
        own.sin_family = AF_INET;
        inet_pton(AF_INET, from.c_str(), &own.sin_addr);
        REQUIRE(bind(fd_, reinterpret_cast<sockaddr*>(&own), sizeof own) == 0);
        to_.sin_family = AF_INET;
        to_.sin_port = htons(3956);
        inet_pton(AF_INET, address.c_str(), &to_.sin_addr);
    }
    ~Application() { close(fd_); }
    Application(const Application&) = delete;
    Application& operator=(const Application&) = delete;

    /// Status of the acknowledge, nothing when none comes. `words` are big-endian payload words.
    std::optional<std::uint16_t> send(Command command, const std::vector<std::uint32_t>& words,
                                      int timeout_ms = 2000, std::optional<std::uint16_t> id = {}) {
        const std::uint16_t request = id.value_or(++request_);
        const auto code = static_cast<std::uint16_t>(command);
        std::vector<std::uint8_t> d{0x42, 1};
        for (const std::uint16_t half : {code, static_cast<std::uint16_t>(4 * words.size()), request}) {
            d.push_back(static_cast<std::uint8_t>(half >> 8));
            d.push_back(static_cast<std::uint8_t>(half));
        }
        for (const std::uint32_t word : words)
            for (int shift = 24; shift >= 0; shift -= 8)
                d.push_back(static_cast<std::uint8_t>(word >> shift));
        sendto(fd_, d.data(), d.size(), 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_);
        const timeval timeout{timeout_ms / 1000, timeout_ms % 1000 * 1000};
        setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
        for (std::uint8_t a[600]; recv(fd_, a, sizeof a, 0) >= 8;) {
            if ((a[6] << 8 | a[7]) != request) continue;
            value = static_cast<std::uint32_t>(a[8]) << 24 | static_cast<std::uint32_t>(a[9]) << 16 |
                    static_cast<std::uint32_t>(a[10]) << 8 | a[11];
            return static_cast<std::uint16_t>(a[0] << 8 | a[1]);
        }
        return {};
    }
    std::optional<std::uint16_t> write(std::uint32_t r, std::uint32_t v) {
        return send(Command::write_register, {r, v});
    }
    std::optional<std::uint16_t> read(std::uint32_t r) { return send(Command::read_register, {r}); }
    std::uint32_t value = 0; ///< first word of the last acknowledge

private:
    int fd_;
    sockaddr_in to_{};
    std::uint16_t request_ = 0;
};

constexpr auto denied = static_cast<std::uint16_t>(Status::access_denied);

} // namespace

TEST_CASE("a silent controller loses control after 3.0 s, whoever else asks meanwhile") {
    Bench bench;
    Application controller, onlooker;
    const auto asked = SteadyClock::now();
    REQUIRE(controller.write(reg::control_privilege, privilege::control) == 0);
    const auto seconds = [&] { return std::chrono::duration<double>(SteadyClock::now() - asked).count(); };
    // Between the last look that shows a controller and the first that does not.
    double still = 0, gone = 0;
    while (gone == 0 && seconds() < 60) {
        const double before = seconds();
        REQUIRE(onlooker.read(reg::control_privilege) == 0);
        (onlooker.value != 0 ? still : gone) = onlooker.value != 0 ? before : seconds();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    std::cout << "control lost between " << still << " s and " << gone << " s\n";
    // Not before, and the onlooker does not keep it; how soon after is a matter of the machine's load.
    CHECK(gone >= 3.0);
    CHECK(bench.camera.gige_counters().control_lost == 1);
}

TEST_CASE("commands of any kind keep control alive") {
    GigeSettings settings;
    settings.heartbeat_timeout_ms = 500;
    Bench bench(settings);
    Application controller;
    REQUIRE(controller.write(reg::control_privilege, privilege::control) == 0);
    // Three times the timeout without a pause of this thread that comes near it.
    std::uint64_t lost = 0;
    auto begin = SteadyClock::now(), last = begin;
    while (last - begin < std::chrono::milliseconds(1500)) {
        const auto status = controller.write(address_of("Gain"), 1000); // never the privilege register
        if (SteadyClock::now() - last >
            std::chrono::milliseconds(400)) { // this machine is busy: from the start
            REQUIRE(controller.write(reg::control_privilege, privilege::control) == 0);
            lost = bench.camera.gige_counters().control_lost;
            begin = SteadyClock::now();
        } else {
            REQUIRE(status == 0); // an acknowledge
        }
        last = SteadyClock::now();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    CHECK(bench.camera.gige_counters().control_lost == lost);
}

TEST_CASE("a request that is repeated because its answer was lost runs once") {
    Bench bench;
    Application controller;
    REQUIRE(controller.write(reg::control_privilege, privilege::control) == 0);
    REQUIRE(controller.write(address_of("TriggerMode"), 1) == 0);
    REQUIRE(controller.write(address_of("TriggerSource"), 0) == 0);
    REQUIRE(controller.write(reg::stream_destination, INADDR_LOOPBACK) == 0);
    REQUIRE(controller.write(reg::stream_port, 9) == 0);
    REQUIRE(controller.write(address_of("AcquisitionStart"), 1) == 0);
    for (int i = 0; i < 5; ++i)
        CHECK(controller.send(Command::write_register, {address_of("TriggerSoftware"), 1}, 2000, 0x4242) ==
              0);
    CHECK(bench.source.triggers() == 1);
    CHECK(bench.camera.gige_counters().retries == 4);
    CHECK(controller.send(Command::write_register, {address_of("TriggerSoftware"), 1}, 2000, 0x4243) == 0);
    CHECK(bench.source.triggers() == 2);
    CHECK(controller.write(reg::control_privilege, 0) == 0);
}

TEST_CASE("who is not on the list is not answered, not even to discovery") {
    GigeSettings settings;
    settings.allow = "127.0.0.5, 127.0.1.0/24";
    Bench bench(settings);
    Application friendly("127.0.0.5"), neighbour("127.0.1.77"), stranger("127.0.0.6");
    CHECK(friendly.send(Command::discovery, {}) == 0);
    CHECK(neighbour.read(reg::version) == 0);
    CHECK_FALSE(stranger.send(Command::discovery, {}, 200));
    CHECK_FALSE(stranger.send(Command::read_register, {reg::version}, 200));
    CHECK_FALSE(stranger.send(Command::write_register, {reg::control_privilege, privilege::control}, 200));
    CHECK(friendly.write(reg::control_privilege, privilege::control) == 0);
    CHECK_FALSE(stranger.send(Command::write_register, {address_of("Gain"), 1000}, 200));
}

TEST_CASE("a camera for looking at only can be read by everybody and written by nobody") {
    GigeSettings settings;
    settings.read_only = true;
    Bench bench(settings);
    Application application;
    CHECK(application.send(Command::discovery, {}) == 0);
    CHECK(application.read(address_of("Width")) == 0);
    CHECK(application.value == 64);
    CHECK(application.write(reg::control_privilege, privilege::control) == denied);
    CHECK(application.write(reg::control_privilege, privilege::exclusive) == denied);
    for (const std::uint32_t r : {address_of("Width"), address_of("AcquisitionStart"), reg::stream_port,
                                  reg::stream_destination, reg::heartbeat_timeout})
        CHECK(application.write(r, 1) == denied);
    CHECK(application.send(Command::write_memory, {address_of("Gain"), 1000}) == denied);
    CHECK_FALSE(application.send(Command::action, {0, 0, 0xFFFFFFFF}, 200));
    CHECK_FALSE(bench.source.acquiring());
}

} // namespace gige_control_life_test
