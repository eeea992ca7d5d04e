// SPDX-License-Identifier: Apache-2.0
// The stream sender by the bytes that leave it.
#include "core/clock.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/loopback_interface.hpp"
#include "tests/support/plain_frame.hpp"
#include "transports/gige/channels/gvsp_sender.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace gige_sender_test {

using namespace obscura;
using namespace obscura::transports::gige;

namespace {

constexpr std::int32_t width = 32, height = 24;

/// A sender that streams to a socket here.
struct Bench {
    const NetworkInterface network = test::loopback_interface();
    GigeSettings settings;
    MonotonicClock clock;
    MessageChannel messages{network};
    FramePool pool{12, width* height, height};
    GvspSender sender{settings, network, messages, clock};
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

    std::vector<FaultRule> rules;

    explicit Bench(bool extended, const std::vector<FaultRule>& faults = {}) : rules(faults) {
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t bytes = sizeof a;
        REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
        REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
        sender.start();
        StreamConfig config;
        config.destination_ip = INADDR_LOOPBACK;
        config.destination_port = ntohs(a.sin_port);
        config.packet_size = 576;
        config.extended_ids = extended;
        config.payload.max_width = width;
        config.payload.max_height = height;
        config.payload.max_image_bytes = std::size_t{2} * width * height;
        for (FaultRule& rule : rules)
            rule.struck = std::make_shared<std::atomic<std::uint64_t>>(0);
        config.faults.set_rules(rules);
        REQUIRE(sender.begin(config));
    }
    ~Bench() {
        sender.stop();
        close(fd);
    }
    Bench(const Bench&) = delete;
    Bench& operator=(const Bench&) = delete;

    [[nodiscard]] std::uint64_t strikes(std::size_t rule) const { return *rules[rule].struck; }

    void send_frame(std::uint64_t id) {
        const FrameRef frame = pool.acquire();
        REQUIRE(bool{frame});
        test::describe_mono16(frame->info, id, width, height);
        REQUIRE(sender.submit(frame));
        frame->publish_rows(height);
        REQUIRE(sender.wait_idle(10 * ns_per_s));
    }
    /// Status and flags (bytes 2 and 3) of all packets that are there.
    std::vector<std::array<std::uint16_t, 2>> received() const {
        std::vector<std::array<std::uint16_t, 2>> all;
        for (std::array<std::uint8_t, 1500> d{}; recv(fd, d.data(), d.size(), 0) > 0;)
            all.push_back({load_be16(d.data()), load_be16(d.data() + 2)});
        return all;
    }
    /// The same of the answer to a resend request; a frame is sent after it, whose packets count, too.
    void ask(std::uint64_t block, std::uint32_t packet, bool extended) {
        ResendRequest request;
        request.block_id = block;
        request.first = request.last = packet;
        request.extended = extended;
        sender.resend(request);
    }
    /// Asks for packets and waits until the sender has dealt with them.
    void ask_and_wait(std::uint64_t block, std::uint32_t first, std::uint32_t last) {
        const std::uint64_t before = asked();
        ResendRequest request;
        request.block_id = block;
        request.first = first;
        request.last = last;
        request.extended = true;
        sender.resend(request);
        const Time give_up = clock.now() + 30 * ns_per_s;
        while ((asked() == before || settled() != asked()) && clock.now() < give_up)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        REQUIRE(asked() > before);
    }
    [[nodiscard]] std::uint64_t asked() const { return sender.counters().asked_packets.load(); }
    [[nodiscard]] std::uint64_t became(ResendOutcome outcome) const {
        return sender.counters().resends[static_cast<std::size_t>(outcome)].load();
    }
    [[nodiscard]] std::uint64_t settled() const {
        std::uint64_t sum = 0;
        for (const auto& n : sender.counters().resends)
            sum += n.load();
        return sum;
    }
};

using Packets = std::vector<std::array<std::uint16_t, 2>>;

} // namespace

TEST_CASE("all packets of a block say that the frame before was lost, resent ones too") {
    Bench bench(true);
    bench.send_frame(1);
    bench.send_frame(2);
    const Packets whole = bench.received();
    REQUIRE(whole.size() == 10); // leader, three of payload, trailer
    for (const auto& p : whole)
        CHECK(p == std::array<std::uint16_t, 2>{0, 0});
    bench.send_frame(4);
    const Packets after_gap = bench.received();
    REQUIRE(after_gap.size() == 5);
    for (const auto& p : after_gap)
        CHECK(p == std::array<std::uint16_t, 2>{0, gvsp_flag::previous_block_dropped});
    // Blocks are numbered without gaps all the same: this is the third.
    bench.ask(3, 1, true);
    bench.send_frame(5);
    const Packets resent = bench.received();
    REQUIRE(resent.size() == 6);
    CHECK(resent[0] ==
          std::array<std::uint16_t, 2>{0, gvsp_flag::previous_block_dropped | gvsp_flag::resent});
    CHECK(resent[1] == std::array<std::uint16_t, 2>{0, 0});
    bench.ask(3, 5, true); // behind the trailer
    bench.send_frame(6);
    const Packets refused = bench.received();
    REQUIRE(refused.size() == 6);
    CHECK(refused[0] ==
          std::array<std::uint16_t, 2>{0x800C, gvsp_flag::resend_range_error | gvsp_flag::resent});
}

TEST_CASE("packets that are asked for are counted by what becomes of them") {
    FaultRule gone;
    gone.fault = Fault::lose_for_good;
    gone.first_frame = gone.last_frame = 2;
    Bench bench(true, {gone});
    bench.send_frame(1);
    bench.ask_and_wait(1, 1, 3);
    CHECK(bench.became(ResendOutcome::resent) == 3);
    bench.ask_and_wait(1, 2, UINT32_MAX); // the rest: two of payload and the trailer
    CHECK(bench.became(ResendOutcome::resent) == 6);
    bench.ask_and_wait(1, 9, 12);
    CHECK(bench.became(ResendOutcome::no_such_packet) == 4);
    bench.ask_and_wait(77, 1, 5);
    CHECK(bench.became(ResendOutcome::no_such_block) == 5);
    for (int i = 0; i < 4; ++i)
        bench.ask_and_wait(1, 0, 4);
    // Four times the block's five packets altogether.
    CHECK(bench.became(ResendOutcome::resent) == 20);
    CHECK(bench.became(ResendOutcome::over_budget) == 6);
    bench.send_frame(2);
    bench.ask_and_wait(2, 1, 2);
    CHECK(bench.became(ResendOutcome::by_fault) == 2);
    CHECK(bench.strikes(0) == 3);

    // A frame of which two packets have been sent: what is asked of the rest is not lost.
    const FrameRef late = bench.pool.acquire();
    REQUIRE(bool{late});
    test::describe_mono16(late->info, 3, width, height);
    const std::uint64_t packets = bench.sender.socket().packets();
    REQUIRE(bench.sender.submit(late));
    late->publish_rows(height / 2);
    const Time give_up = bench.clock.now() + 30 * ns_per_s;
    while (bench.sender.socket().packets() < packets + 2 && bench.clock.now() < give_up)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    bench.ask_and_wait(3, 1, 4);
    CHECK(bench.became(ResendOutcome::resent) == 21);
    CHECK(bench.became(ResendOutcome::before_sent) == 3);
    late->publish_rows(height);
    REQUIRE(bench.sender.wait_idle(10 * ns_per_s));

    for (std::uint64_t id = 4; id < 12; ++id)
        bench.send_frame(id);
    bench.ask_and_wait(1, 1, 1);
    CHECK(bench.became(ResendOutcome::no_longer_kept) == 1);
    CHECK(bench.settled() == bench.asked());
}

TEST_CASE("each fault rule counts its own strikes") {
    std::vector<FaultRule> rules(4);
    rules[0].fault = Fault::lose;
    rules[0].first_frame = rules[0].last_frame = 1;
    rules[1].fault = Fault::delay;
    rules[1].amount = 1;
    rules[1].first_frame = rules[1].last_frame = 2;
    rules[2].fault = Fault::delay;
    rules[2].amount = 2;
    rules[2].first_frame = 3;
    rules[3].fault = Fault::skip_frame;
    rules[3].first_frame = rules[3].last_frame = 4;
    Bench bench(true, rules);
    for (std::uint64_t id = 1; id < 6; ++id)
        bench.send_frame(id);
    CHECK(bench.strikes(0) == 3); // payload packets of a frame
    CHECK(bench.strikes(1) == 3);
    CHECK(bench.strikes(2) == 6);
    CHECK(bench.strikes(3) == 1);
    CHECK(bench.sender.counters().injected_losses == 4);
    CHECK(bench.sender.counters().injected_delays == 9);
}

TEST_CASE("rules that are replaced while frames are sent hold from the next frame on") {
    FaultRule lose;
    lose.fault = Fault::lose;
    Bench bench(true, {lose});
    FaultRule skip;
    skip.fault = Fault::skip_frame;
    skip.struck = std::make_shared<std::atomic<std::uint64_t>>(0);
    FaultInjector next;
    next.set_rules({skip});
    bench.send_frame(1);
    CHECK(bench.strikes(0) == 3); // payload packets of a frame
    bench.sender.set_faults(next);
    bench.send_frame(2);
    bench.send_frame(3);
    CHECK(bench.strikes(0) == 3);
    CHECK(*skip.struck == 2);
    for (int i = 0; i < 20; ++i) // none of them is lost or freed twice, taken or not
        bench.sender.set_faults({});
    bench.send_frame(4);
    CHECK(*skip.struck == 2);
    bench.sender.set_faults(next);
}

TEST_CASE("a request that comes while a fault delays a packet is answered at once") {
    FaultRule delay;
    delay.fault = Fault::delay;
    delay.amount = 1e9; // us
    Bench bench(true, {delay});
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bool{frame});
    test::describe_mono16(frame->info, 1, width, height);
    frame->publish_rows(height);
    REQUIRE(bench.sender.submit(frame));
    const Time give_up = bench.clock.now() + 30 * ns_per_s;
    while (bench.strikes(0) == 0 && bench.clock.now() < give_up)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    bench.ask_and_wait(1, 0, 3);
    CHECK(bench.became(ResendOutcome::resent) == 1);
    CHECK(bench.became(ResendOutcome::before_sent) == 3);
    bench.sender.abort();
    CHECK(bench.sender.wait_idle(10 * ns_per_s));
}

TEST_CASE("standard headers have no flags: there the block id stands in their place") {
    Bench bench(false);
    bench.send_frame(1);
    bench.send_frame(7);
    const Packets all = bench.received();
    REQUIRE(all.size() == 10);
    for (std::size_t i = 0; i < 10; ++i)
        CHECK(all[i] == std::array<std::uint16_t, 2>{0, static_cast<std::uint16_t>(1 + i / 5)});
}

TEST_CASE("a long delay fault is no hung thread to the watchdog") {
    FaultRule delay;
    delay.fault = Fault::delay;
    delay.amount = 1e9; // us
    Bench bench(false, {delay});
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bool{frame});
    test::describe_mono16(frame->info, 1, width, height);
    frame->publish_rows(height);
    const std::uint64_t before = bench.sender.heartbeat().beats();
    REQUIRE(bench.sender.submit(frame));
    // Four beats a second; a sender that waits in silence has made a few before.
    const Time give_up = bench.clock.now() + 30 * ns_per_s;
    while (bench.sender.heartbeat().beats() < before + 12 && bench.clock.now() < give_up)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    CHECK(bench.sender.heartbeat().beats() >= before + 12);
    bench.sender.abort();
    CHECK(bench.sender.wait_idle(10 * ns_per_s));
}

TEST_CASE("a message without an acknowledge does not hold up those to the next client") {
    MessageChannel messages(test::loopback_interface());
    messages.start();
    messages.enable(Event::test, true);
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof a;
    const timeval timeout{30, 0};
    REQUIRE(setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout) == 0);
    REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
    REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
    MessageConfig config{INADDR_LOOPBACK, ntohs(a.sin_port), 10'000, 10};
    messages.configure(config);
    const auto received_stamp = [&] {
        std::array<std::uint8_t, 64> d{};
        return recv(fd, d.data(), d.size(), 0) == 24 ? load_be64(&d[16]) : 0;
    };
    messages.post({Event::test, 0, 1});
    REQUIRE(received_stamp() == 1); // and not acknowledged: repeated for 110 s
    config.timeout_ms = 0;
    messages.configure(config);
    messages.post({Event::test, 0, 2});
    std::uint64_t next = 1; // the first may have been repeated
    for (int repeats = 0; repeats < 3 && next == 1; ++repeats)
        next = received_stamp();
    CHECK(next == 2);
    CHECK(messages.lost() == 1);
    close(fd);
    messages.stop();
}

TEST_CASE("packets that found no receiver do not cost the next ones theirs") {
    const auto receiver = [](std::uint16_t port) {
        const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        a.sin_port = htons(port);
        socklen_t bytes = sizeof a;
        REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
        REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
        return std::pair(fd, ntohs(a.sin_port));
    };
    const auto count = [](int fd) {
        int n = 0;
        for (std::array<std::uint8_t, 64> d{}; recv(fd, d.data(), d.size(), 0) > 0;)
            ++n;
        return n;
    };
    for (const SendBackend backend : {SendBackend::sendto, SendBackend::sendmmsg, SendBackend::gso}) {
        CAPTURE(static_cast<int>(backend));
        PacketSocket out;
        out.open(test::loopback_interface(), 1 << 20);
        out.set_backend(backend);
        const std::uint16_t own_port = out.port();
        auto [first, first_port] = receiver(0);
        const auto [second, second_port] = receiver(0);
        const std::array<std::uint8_t, 8> header{};
        const auto send = [&](std::uint16_t port) {
            out.set_destination(INADDR_LOOPBACK, port);
            for (int i = 0; i < 4; ++i)
                out.add(header, header);
            out.flush();
        };
        close(first);
        send(first_port); // leaves a refusal behind
        send(second_port);
        CHECK(count(second) == 4);
        first = receiver(first_port).first;
        send(first_port);
        CHECK(count(first) == 4);
        CHECK(count(second) == 0);
        CHECK(out.packets() == 12);
        CHECK(out.errors() == 0);
        out.set_destination(0, 0); // the client has closed its stream
        CHECK(out.port() == own_port);
        send(second_port);
        sockaddr_in from{};
        socklen_t bytes = sizeof from;
        std::array<std::uint8_t, 64> d{};
        REQUIRE(recvfrom(second, d.data(), d.size(), 0, reinterpret_cast<sockaddr*>(&from), &bytes) == 16);
        CHECK(ntohs(from.sin_port) == own_port);
        close(first);
        close(second);
    }
}

} // namespace gige_sender_test
