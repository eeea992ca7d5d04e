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
#include <thread>
#include <utility>
#include <vector>

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

    explicit Bench(bool extended, const std::vector<FaultRule>& faults = {}) {
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
        config.faults.set_rules(faults);
        REQUIRE(sender.begin(config));
    }
    ~Bench() {
        sender.stop();
        close(fd);
    }
    Bench(const Bench&) = delete;
    Bench& operator=(const Bench&) = delete;

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
};

using Packets = std::vector<std::array<std::uint16_t, 2>>;

} // namespace

TEST_CASE("a frame that nobody could take is told of in all packets of the next block, resent ones too") {
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
    const timeval patience{30, 0};
    REQUIRE(setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) == 0);
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
