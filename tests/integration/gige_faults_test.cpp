// SPDX-License-Identifier: Apache-2.0
// Faults on purpose: every kind, seen as packets on the wire, and the same packets in every run.
#include "core/clock.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/gige.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <thread>

namespace gige_faults_test {

using namespace obscura;
using namespace obscura::test;
using namespace obscura::transports::gige;

namespace {

const std::string address = own_loopback_address();
constexpr int frames = 8;
constexpr std::int64_t period_ns = 40 * ns_per_ms;

struct Packet {
    std::uint16_t block = 0;
    std::uint8_t format = 0; // 1 leader, 2 trailer, 3 payload
    std::uint32_t id = 0;
    std::uint64_t digest = 0;  // of what follows the header; leaders: without the time stamp
    std::int64_t stamp_us = 0; // leaders: after the first one's, to 10 us
    bool operator==(const Packet&) const = default;
};
using Recording = std::vector<Packet>;

/// A UDP socket with room for a whole run.
class Receiver {
public:
    Receiver() : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
        const int room = 8 << 20;
        setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
        setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        REQUIRE(bind(fd_, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
        socklen_t bytes = sizeof a;
        getsockname(fd_, reinterpret_cast<sockaddr*>(&a), &bytes);
        port_ = ntohs(a.sin_port);
    }
    ~Receiver() { close(fd_); }
    Receiver(const Receiver&) = delete;
    Receiver& operator=(const Receiver&) = delete;
    [[nodiscard]] int port() const { return port_; }
    /// Everything that has arrived.
    Recording take() {
        Recording recording;
        std::uint8_t d[2048];
        std::uint64_t first_stamp = 0;
        for (ssize_t n; (n = recv(fd_, d, sizeof d, MSG_DONTWAIT)) > 0;) {
            if (n < 8) continue;
            Packet p;
            p.block = static_cast<std::uint16_t>(d[2] << 8 | d[3]);
            p.format = d[4] & 0x0F;
            p.id = static_cast<std::uint32_t>(d[5] << 16 | d[6] << 8 | d[7]);
            if (p.format == 1) {
                std::uint64_t stamp = 0;
                for (int i = 12; i < 20; ++i) {
                    stamp = stamp << 8 | d[i];
                    d[i] = 0;
                }
                if (first_stamp == 0) first_stamp = stamp;
                p.stamp_us = (static_cast<std::int64_t>(stamp - first_stamp) + 5000) / 10'000 * 10;
            }
            p.digest = 0xCBF29CE484222325; // FNV-1a
            for (ssize_t i = 8; i < n; ++i)
                p.digest = (p.digest ^ d[i]) * 0x100000001B3;
            recording.push_back(p);
        }
        return recording;
    }

private:
    int fd_;
    int port_ = 0;
};

/// Sends the same frames under `rules` to a plain socket and tells what came out.
Recording record(const std::vector<FaultRule>& rules, std::int64_t* took_ns = nullptr) {
    CameraLimits limits;
    limits.sensor_width = 128;
    limits.sensor_height = 96;
    limits.adc_bits = 12;
    MonotonicClock clock;
    PatternCamera source(limits, 24);
    GigeSettings settings;
    settings.interface = address;
    settings.packet_size = 576; // 46 payload packets a frame
    settings.throughput_limit_mbit_s = 0;
    settings.faults = rules;
    GigeCamera camera(settings, source, clock);
    source.set_transport(camera);
    source.set_bands(8, 0);
    camera.start();
    Recording recording;
    {
        Receiver receiver;
        GigeClient client(address);
        client.set("TriggerMode", "On");
        client.set("TriggerSource", "Line0");
        client.set("GevSCDA", std::int64_t{INADDR_LOOPBACK});
        client.set("GevSCPHostPort", std::int64_t{receiver.port()});
        client.execute("AcquisitionStart");
        const Time begin = clock.now();
        for (std::uint64_t i = 1; i <= frames; ++i) {
            while (!source.line_trigger(Time{begin.ns + static_cast<std::int64_t>(i) * period_ns}))
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            for (int w = 0; w < 120'000; ++w) {
                const transports::TransportCounters c = camera.counters();
                if (c.delivered + c.dropped == i) break;
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
        if (took_ns != nullptr) *took_ns = clock.now() - begin;
        client.execute("AcquisitionStop");
        recording = receiver.take();
    }
    source.acquisition_stop(true);
    camera.stop();
    return recording;
}

FaultRule rule(Fault fault, double percent, double amount = 1) {
    FaultRule r;
    r.fault = fault;
    r.percent = percent;
    r.amount = amount;
    r.seed = 5;
    return r;
}

std::map<std::uint16_t, Recording> by_block(const Recording& r) {
    std::map<std::uint16_t, Recording> blocks;
    for (const Packet& p : r)
        blocks[p.block].push_back(p);
    return blocks;
}

} // namespace

TEST_CASE("every fault strikes the same packets in every run, and does what its name says") {
    const Recording clean = record({});
    REQUIRE(clean.size() == frames * 48U);
    REQUIRE(record({}) == clean);
    const auto twice = [&](const FaultRule& r) {
        CAPTURE(name_of(r.fault));
        Recording first = record({r});
        CHECK(first == record({r}));
        CHECK((first == clean) == (r.fault == Fault::delay));
        return first;
    };
    // What is there of `struck` is as in the clean run.
    const auto intact = [&](const Recording& struck) {
        return std::all_of(struck.begin(), struck.end(), [&](const Packet& p) {
            return std::find(clean.begin(), clean.end(), p) != clean.end();
        });
    };
    {
        const Recording r = twice(rule(Fault::lose, 10));
        CHECK(r.size() < clean.size() - 10);
        CHECK(intact(r));
        FaultRule bursts = rule(Fault::lose, 20);
        bursts.burst = 9;
        const Recording b = twice(bursts);
        // Payload packets 1..46: groups of 8 (ids 1-8), 9, 9, 9, 9 and 2.
        for (const auto& [block, packets] : by_block(b))
            for (std::uint32_t group = 1; group < 5; ++group) {
                const auto n = std::count_if(packets.begin(), packets.end(), [&](const Packet& p) {
                    return p.format == 3 && p.id / 9 == group;
                });
                CHECK((n == 0 || n == 9));
            }
    }
    {
        const Recording r = twice(rule(Fault::duplicate, 10));
        CHECK(r.size() > clean.size() + 10);
        CHECK(intact(r));
    }
    {
        const Recording r = twice(rule(Fault::reorder, 10));
        CHECK(r.size() == clean.size());
        CHECK(intact(r));
        int out_of_order = 0;
        for (std::size_t i = 1; i < r.size(); ++i)
            out_of_order += r[i].block == r[i - 1].block && r[i].id < r[i - 1].id;
        CHECK(out_of_order > 10);
    }
    {
        const Recording r = twice(rule(Fault::corrupt, 10));
        REQUIRE(r.size() == clean.size());
        int wrong = 0;
        for (std::size_t i = 0; i < r.size(); ++i) {
            CHECK(r[i].id == clean[i].id);
            wrong += r[i].digest != clean[i].digest;
        }
        CHECK(wrong > 10);
        CHECK(wrong < 80);
    }
    {
        std::int64_t took = 0;
        FaultRule slow = rule(Fault::delay, 100, 2000);
        slow.last_frame = 2;
        CHECK(record({slow}, &took) == clean);
        CHECK(took >= 2 * 46 * 2 * ns_per_ms);
    }
    for (const auto& [fault, format] : {std::pair{Fault::drop_leader, 1}, {Fault::drop_trailer, 2}}) {
        const Recording r = twice(rule(fault, 70));
        const auto left = std::count_if(r.begin(), r.end(), [f = format](auto& p) { return p.format == f; });
        CHECK(left > 0);
        CHECK(left < frames);
        CHECK(r.size() == clean.size() - static_cast<std::size_t>(frames - left));
    }
    {
        FaultRule every = rule(Fault::skip_frame, 100);
        every.first_frame = 2;
        every.last_frame = 6;
        every.every_frames = 3;
        std::set<std::uint16_t> seen;
        for (const auto& [block, packets] : by_block(twice(every)))
            seen.insert(block);
        CHECK(seen == std::set<std::uint16_t>{1, 3, 4, 6, 7, 8}); // without 2 and 5
    }
    {
        FaultRule some = rule(Fault::freeze_frame, 100);
        some.first_frame = 3;
        some.last_frame = 5;
        const Recording r = twice(some);
        const auto blocks = by_block(r), good = by_block(clean);
        for (const auto& [block, packets] : blocks) {
            const std::uint16_t shows = block >= 3 && block <= 5 ? 2 : block;
            const Recording& picture = good.at(shows);
            REQUIRE(packets.size() == picture.size());
            for (std::size_t i = 0; i < packets.size(); ++i)
                if (packets[i].format == 3) CHECK(packets[i].digest == picture[i].digest);
            CHECK(packets[0].stamp_us == good.at(block)[0].stamp_us); // time runs on
        }
        CHECK(blocks.size() == frames);
    }
    {
        FaultRule some = rule(Fault::repeat_frame, 100);
        some.first_frame = some.last_frame = 4;
        const Recording r = twice(some);
        const auto blocks = by_block(r), good = by_block(clean);
        REQUIRE(blocks.size() == frames + 1);
        for (const auto& [block, packets] : blocks) {
            const auto shows = static_cast<std::uint16_t>(block >= 5 ? block - 1 : block);
            Recording expected = good.at(shows);
            for (Packet& p : expected)
                p.block = block;
            CHECK(packets == expected); // time stamps included
        }
    }
    {
        FaultRule some = rule(Fault::wrong_block_id, 100, 100);
        some.first_frame = some.last_frame = 4;
        std::set<std::uint16_t> seen;
        for (const auto& [block, packets] : by_block(twice(some)))
            seen.insert(block);
        CHECK(seen == std::set<std::uint16_t>{1, 2, 3, 104, 5, 6, 7, 8});
    }
    {
        FaultRule some = rule(Fault::wrong_timestamp, 100, -15'000);
        some.first_frame = some.last_frame = 4;
        for (const auto& [block, packets] : by_block(twice(some)))
            CHECK(packets[0].stamp_us == (block - 1) * period_ns / 1000 - (block == 4 ? 15'000 : 0));
    }
    {
        FaultRule gone = rule(Fault::lose_for_good, 10);
        CHECK(intact(twice(gone)));
    }
}

TEST_CASE("a camera that does not answer and one that forgets its controller") {
    const auto camera_with = [](const FaultRule& r, auto&& run) {
        CameraLimits limits;
        limits.sensor_width = limits.sensor_height = 64;
        MonotonicClock clock;
        PatternCamera source(limits);
        GigeSettings settings;
        settings.interface = address;
        settings.heartbeat_timeout_ms = 500;
        settings.faults = {r};
        GigeCamera camera(settings, source, clock);
        source.set_transport(camera);
        camera.start();
        run(camera);
        camera.stop();
    };
    // Which of 60 questions are answered.
    const auto answers = [&](const FaultRule& r) {
        std::string pattern;
        camera_with(r, [&](GigeCamera&) {
            const int fd = socket(AF_INET, SOCK_DGRAM, 0);
            sockaddr_in to{};
            to.sin_family = AF_INET;
            to.sin_port = htons(3956);
            inet_pton(AF_INET, address.c_str(), &to.sin_addr);
            timeval timeout{0, 30'000};
            setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
            for (std::uint8_t i = 1; i <= 60; ++i) {
                const std::uint8_t read_version[12] = {0x42, 1, 0, 0x80, 0, 4, 0, i, 0, 0, 0, 0};
                sendto(fd, read_version, sizeof read_version, 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
                std::uint8_t d[64];
                ssize_t n = recv(fd, d, sizeof d, 0);
                pattern += n == 12 && d[7] == i ? 'x' : '.';
            }
            close(fd);
        });
        return pattern;
    };
    FaultRule mute = rule(Fault::mute_control, 100);
    mute.first_frame = 11;
    mute.last_frame = 20;
    // An answer may come late on a busy machine, but none comes that is not to come.
    const std::string window = answers(mute);
    CHECK(window.substr(10, 10) == "..........");
    CHECK(std::count(window.begin(), window.end(), 'x') > 40);
    const std::string half = answers(rule(Fault::mute_control, 50)),
                      again = answers(rule(Fault::mute_control, 50));
    const auto heard = std::count(half.begin(), half.end(), 'x');
    CHECK(heard > 15);
    CHECK(heard < 45);
    int different = 0;
    for (std::size_t i = 0; i < half.size(); ++i)
        different += half[i] != again[i];
    CHECK(different <= 4);

    FaultRule forgetful = rule(Fault::heartbeat_loss, 100);
    forgetful.first_frame = 20; // the client has connected by then
    camera_with(forgetful, [&](GigeCamera& camera) {
        GigeClient client(address); // reads the privilege register every second at least
        for (int i = 0; i < 4000 && camera.gige_counters().control_lost == 0; ++i) {
            GError* error = nullptr;
            arv_camera_get_integer(client.camera(), "Width", &error);
            g_clear_error(&error);
            std::this_thread::sleep_for(std::chrono::milliseconds(30));
        }
        CHECK(camera.gige_counters().control_lost == 1);
    });
}

} // namespace gige_faults_test
