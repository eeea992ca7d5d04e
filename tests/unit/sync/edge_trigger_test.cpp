// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "sync/clock_reading.hpp"
#include "sync/edge_trigger.hpp"
#include "sync/inputs/gpio_input.hpp"
#include "sync/inputs/pps_input.hpp"
#include "sync/inputs/ptp_input.hpp"
#include "sync/inputs/rate_limit.hpp"
#include "sync/inputs/udp_input.hpp"
#include "tests/support/catch.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <functional>
#include <mutex>
#include <vector>

namespace edge_trigger_test {

using namespace obscura;
using namespace obscura::sync;
using Catch::Matchers::ContainsSubstring;

namespace {

struct Collector final : TriggerSink {
    void on_trigger(const Trigger& t) noexcept override {
        triggers[count.load() % triggers.size()] = t;
        ++count;
        count.notify_all();
    }
    void wait_for(std::size_t n) {
        for (std::size_t seen = count; seen < n; seen = count)
            count.wait(seen);
    }
    std::vector<Trigger> triggers = std::vector<Trigger>(64);
    std::atomic<std::size_t> count{0};
};

// Plays a list: positive numbers are edges with that sequence, 0 an edge without, -1 the end of the input.
struct Script {
    std::mutex mutex;
    std::deque<int> steps;
    std::atomic<int> opened{0};
    std::atomic<bool> present{true};
};

class ScriptInput final : public EdgeInput {
public:
    explicit ScriptInput(Script& script) : script_(script) {
        if (!script.present) throw HardwareError("not there");
        ++script.opened;
    }
    int wait(std::int64_t, std::span<Edge> edges) noexcept override {
        const std::lock_guard lock(script_.mutex);
        if (script_.steps.empty()) {
            usleep(200);
            return 0;
        }
        const int step = script_.steps.front();
        script_.steps.pop_front();
        if (step < 0) return gone;
        edges[0] = {Time{1000 + step}, static_cast<std::uint64_t>(step), step % 2 == 0};
        return 1;
    }

private:
    Script& script_;
};

std::string complaint_of(const EdgeTrigger::Open& open) {
    try {
        (void)open();
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

} // namespace

TEST_CASE("edges get ids; sequence numbers show the lost ones, until the input is opened anew") {
    Script script;
    script.steps = {5, 6, 9, 0, 0, -1, 100, 101, -1, 500};
    const MonotonicClock clock;
    Collector sink;
    EdgeTrigger source(
        {.reopen_every_ns = ns_per_ms}, [&] { return std::make_unique<ScriptInput>(script); }, clock);
    source.start(sink);
    sink.wait_for(8);
    source.stop();
    const std::uint64_t ids[] = {1, 2, 5, 6, 7, 8, 9, 10};
    for (std::size_t i = 0; i < 8; ++i)
        CHECK(sink.triggers[i].id == ids[i]);
    CHECK(sink.triggers[2].edge == Time{1009});
    CHECK(sink.triggers[1].falling);
    CHECK_FALSE(sink.triggers[2].falling);
    CHECK(script.opened == 3);
    CHECK(source.reconnects() == 2);
}

TEST_CASE("an input that is not there at the start is an error, later it is waited for") {
    Script script;
    script.present = false;
    const MonotonicClock clock;
    Collector sink;
    EdgeTrigger source(
        {.reopen_every_ns = ns_per_ms}, [&] { return std::make_unique<ScriptInput>(script); }, clock);
    CHECK_THROWS_AS(source.start(sink), HardwareError);
    script.present = true;
    source.start(sink);
    CHECK(source.connected());
    script.present = false;
    {
        const std::lock_guard lock(script.mutex);
        script.steps = {-1, 3};
    }
    while (source.connected())
        usleep(200);
    usleep(5000);
    CHECK(sink.count == 0);
    script.present = true;
    sink.wait_for(1);
    CHECK(source.connected());
    source.stop();
}

TEST_CASE("the clock is locked while edges come as they should, and free otherwise") {
    Script script;
    script.steps = {1, 11, 21, 60, 70}; // 39 is more than 1.5 periods of 10
    FakeClock clock(Time{1000});
    Collector sink;
    EdgeTrigger source(
        {.nominal_period_ns = 10}, [&] { return std::make_unique<ScriptInput>(script); }, clock);
    CHECK(source.clock_state(clock.now()) == ClockState::free);
    source.start(sink);
    sink.wait_for(5);
    const ClockState expected[] = {ClockState::free, ClockState::locked, ClockState::locked, ClockState::free,
                                   ClockState::locked};
    for (std::size_t i = 0; i < 5; ++i)
        CHECK(sink.triggers[i].clock == expected[i]);
    CHECK(source.clock_state(Time{1085}) == ClockState::locked);
    CHECK(source.clock_state(Time{1086}) == ClockState::free);
    source.stop();
    CHECK(source.clock_state(Time{1070}) == ClockState::free);
}

TEST_CASE("a stamp that cannot be meant is replaced by the time it was seen") {
    const Time seen{10 * ns_per_s};
    CHECK(plausible_edge(3 * ns_per_s, 6'999'000'000, seen) == Time{9'999'000'000});
    CHECK(plausible_edge(3 * ns_per_s, 7'000'500'000, seen) == Time{10'000'500'000}); // readings have errors
    CHECK(plausible_edge(3 * ns_per_s, 7'002'000'000, seen) == seen);                 // the future
    CHECK(plausible_edge(3 * ns_per_s, 5 * ns_per_s, seen) == seen); // long ago: the clock was stepped
}

TEST_CASE("the difference of two clocks of this machine") {
    timespec real{}, mono{};
    clock_gettime(CLOCK_REALTIME, &real);
    const std::int64_t difference = monotonic_minus(CLOCK_REALTIME);
    clock_gettime(CLOCK_MONOTONIC, &mono);
    // The two readings embrace the one inside; a machine may take its time between them.
    CHECK(difference <= to_ns(mono) - to_ns(real));
    // Against itself nothing but the time between two readings is left.
    CHECK(std::abs(monotonic_minus(CLOCK_MONOTONIC)) < ns_per_s);
}

TEST_CASE("devices that are not there or not what they should be are named") {
    CHECK_THAT(complaint_of([] { return open_gpio({.line = "gpiochip99:3"}); }),
               ContainsSubstring("gpiochip99:3") && ContainsSubstring("No such file"));
    CHECK_THAT(complaint_of([] { return open_gpio({.line = "NO_SUCH_LINE"}); }),
               ContainsSubstring("NO_SUCH_LINE"));
    CHECK_THAT(complaint_of([] { return open_gpio({.line = "gpiochip0:x"}); }),
               ContainsSubstring("gpiochip0:x"));
    CHECK_THAT(complaint_of([] { return open_pps("trigger.line1", "/dev/pps99"); }),
               ContainsSubstring("trigger.line1.device: /dev/pps99: No such file"));
    CHECK_THAT(complaint_of([] { return open_pps("trigger", "/dev/null"); }),
               ContainsSubstring("/dev/null: no PPS device"));
    CHECK_THAT(complaint_of([] { return open_ptp("trigger.line2", "/dev/ptp99", 0); }),
               ContainsSubstring("trigger.line2.device: /dev/ptp99: No such file"));
    CHECK_THAT(complaint_of([] { return open_ptp("trigger", "/dev/null", 0); }),
               ContainsSubstring("/dev/null: no PTP clock"));
    for (const char* address :
         {"", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "::1:5000", "a:1"})
        CHECK_THROWS_AS((void)open_udp("trigger", address), ConfigError);
    CHECK_THAT(complaint_of([] { return open_udp("trigger", "192.0.2.1:5002"); }),
               ContainsSubstring("192.0.2.1:5002: Cannot assign"));
}

TEST_CASE("UDP triggers: the message by its bytes") {
    const auto bytes = encode({0x01020304, 0x0a0b0c0d0e0f1011});
    const std::uint8_t expected[] = {'O', 'B', 'T', 'R', 1, 2, 3, 4, 10, 11, 12, 13, 14, 15, 16, 17};
    CHECK(std::equal(bytes.begin(), bytes.end(), std::begin(expected)));
    UdpTriggerMessage message;
    REQUIRE(decode(bytes, message));
    CHECK(message == UdpTriggerMessage{0x01020304, 0x0a0b0c0d0e0f1011});
    CHECK_FALSE(decode({bytes.data(), 15}, message));
    for (const std::size_t longer : {17, 32, 64}) {
        std::vector<std::uint8_t> datagram(bytes.begin(), bytes.end());
        datagram.resize(longer);
        CHECK_FALSE(decode(datagram, message));
    }
    auto wrong = bytes;
    wrong[0] = 'X';
    CHECK_FALSE(decode(wrong, message));
    wrong = bytes;
    wrong[8] = 0x40; // a time that no clock shows
    CHECK_FALSE(decode(wrong, message));
}

/// Sends datagrams to a UDP trigger on an address of this process's own.
class UdpSender {
public:
    UdpSender() {
        to_.sin_family = AF_INET;
        to_.sin_port = htons(static_cast<std::uint16_t>(std::stoi(port_)));
        inet_pton(AF_INET, host_.c_str(), &to_.sin_addr);
    }
    [[nodiscard]] std::string address() const { return host_ + ":" + port_; }
    void send(const void* data, std::size_t size) const {
        sendto(fd_.get(), data, size, 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_);
    }

private:
    const std::string port_ = std::to_string(20'000 + getpid() % 40'000);
    const std::string host_ = "127.77." + std::to_string(getpid() / 250 % 250) + ".1";
    FileDescriptor fd_{socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
    sockaddr_in to_{};
};

TEST_CASE("a flood of other datagrams does not keep the thread of UDP triggers") {
    const UdpSender sender;
    const auto input = open_udp("trigger", sender.address());
    for (int i = 0; i < udp_datagrams_per_wait; ++i)
        sender.send("rubbish", 7);
    const auto message = encode({1, 0});
    sender.send(message.data(), message.size());
    std::array<Edge, 4> edges;
    CHECK(input->wait(ns_per_s, edges) == 0); // beats and goes on
    CHECK(input->wait(ns_per_s, edges) == 1);
}

TEST_CASE("a flood of UDP triggers is taken at the highest rate, and the rest is counted") {
    const UdpSender sender;
    const auto input = open_udp("trigger", sender.address(), {.max_rate_hz = 1});
    constexpr int sent = 40;
    const MonotonicClock clock;
    const Time begin = clock.now();
    for (std::uint32_t i = 1; i <= sent; ++i) {
        const auto message = encode({i, 0});
        sender.send(message.data(), message.size());
    }
    std::array<Edge, 64> edges;
    const int taken = input->wait(ns_per_s, edges);
    // The burst, and one for each second that a busy machine took.
    const auto seconds = static_cast<int>((clock.now() - begin) / ns_per_s);
    CHECK(taken >= static_cast<int>(RateLimit::burst));
    CHECK(taken <= static_cast<int>(RateLimit::burst) + seconds + 1);
    CHECK(input->refused() == static_cast<std::uint64_t>(sent - taken));
}

TEST_CASE("datagrams for which the kernel has no room are counted") {
    const UdpSender sender;
    const auto input = open_udp("trigger", sender.address());
    constexpr std::uint64_t sent = 20'000; // far more than a socket's buffer holds
    for (std::uint64_t i = 0; i < sent; ++i)
        sender.send("rubbish", 7);
    std::array<Edge, 4> edges;
    while (input->refused() < sent / 100)
        CHECK(input->wait(ns_per_s, edges) == 0);
    const auto message = encode({1, 0});
    int taken = 0;
    while (taken == 0) {
        sender.send(message.data(), message.size());
        taken = input->wait(ns_per_ms, edges);
    }
    CHECK(input->refused() >= sent);
}

TEST_CASE("a rate is limited with room for a burst") {
    RateLimit limit(100);
    const auto at = [](double s) { return Time{std::llround(s * 1e9)}; };
    int allowed = 0;
    for (int i = 0; i < 1000; ++i) // 1000 in a second
        allowed += limit.allows(at(50 + 1e-3 * i)) ? 1 : 0;
    CHECK(std::abs(allowed - (100 + static_cast<int>(RateLimit::burst))) <= 1);
    for (int i = 0; i < 50; ++i) // below the rate
        CHECK(limit.allows(at(60 + 0.011 * i)));
}

TEST_CASE("a stamp of a UDP trigger is read by the clock's TAI, or by CLOCK_TAI") {
    const UdpSender sender;
    MonotonicClock clock;
    // 37 s, but for a kernel that knows them: then 74 s, so that the two differ.
    clock.set_tai_correction({37 * ns_per_s, TaiSource::list});
    const auto input = open_udp("trigger", sender.address(), {.clock = &clock});
    std::array<Edge, 4> edges;
    const Time earlier{clock.now().ns - 100 * ns_per_ms};
    for (const std::int64_t tai_ns :
         {earlier.ns + clock.tai_offset_ns(), earlier.ns - monotonic_minus(CLOCK_TAI)}) {
        const auto message = encode({0, tai_ns});
        sender.send(message.data(), message.size());
        REQUIRE(input->wait(ns_per_s, edges) == 1);
        CHECK(std::abs(edges[0].at - earlier) < ns_per_ms);
    }
}

TEST_CASE("UDP triggers over a socket: stamps, gaps, rubbish") {
    const UdpSender sender;
    const MonotonicClock clock;
    Collector sink;
    EdgeTrigger source(
        {}, [&] { return open_udp("trigger", sender.address()); }, clock);
    source.start(sink);
    const Time begin = clock.now();
    const std::int64_t tai_of_begin = begin.ns - monotonic_minus(CLOCK_TAI);
    sender.send("rubbish", 7);
    auto message = encode({7, tai_of_begin});
    sender.send(message.data(), message.size());
    sink.wait_for(1);
    message = encode({10, 0});
    sender.send(message.data(), message.size());
    sink.wait_for(2);
    const Time end = clock.now();
    source.stop();
    CHECK(sink.count == 2);
    CHECK(source.refused() == 1);
    CHECK(sink.triggers[0].id == 1);
    CHECK(sink.triggers[1].id == 4); // 8 and 9 never came
    // Comparing clocks has an error; a whole millisecond would be another edge.
    CHECK(sink.triggers[0].edge - begin < ns_per_ms);
    CHECK(begin - sink.triggers[0].edge < ns_per_ms);
    CHECK(sink.triggers[1].edge - begin > -ns_per_ms);
    CHECK(end - sink.triggers[1].edge > -ns_per_ms);
}

TEST_CASE("UDP triggers: an empty datagram is an edge only where it is accepted") {
    const UdpSender sender;
    const MonotonicClock clock;
    const bool accepted = GENERATE(true, false);
    Collector sink;
    EdgeTrigger source(
        {}, [&] { return open_udp("trigger", sender.address(), {.accept_empty = accepted}); }, clock);
    source.start(sink);
    const Time begin = clock.now();
    sender.send("", 0);
    sender.send("\n", 1);
    const auto message = encode({1, 0});
    sender.send(message.data(), message.size());
    sink.wait_for(accepted ? 2 : 1);
    source.stop();
    CHECK(sink.count == (accepted ? 2 : 1));
    CHECK(source.refused() == (accepted ? 1 : 2));
    CHECK(sink.triggers[0].edge - begin > -ns_per_ms);
}

} // namespace edge_trigger_test
