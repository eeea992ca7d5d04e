// SPDX-License-Identifier: Apache-2.0
// Streams of frames for credits, and connections whose sessions or readers do not hold up others.
#include "service/server.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/native_client.hpp"
#include "tests/support/service_bench.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace stream_test {

using namespace obscura;
using namespace obscura::service;
using nlohmann::json;
using namespace std::chrono_literals;
using test::Message;

namespace {

struct Counting {
    std::uint32_t credits = 0, bytes = 0;
    std::uint64_t frames = 0; ///< 0: without end

    Fields fields() {
        return {{config::key("credits", &credits), config::key("bytes", &bytes).range(0, 1e9),
                 config::key("frames", &frames).range(0, 1e9)}};
    }
};

/// Calls: echo; count, a stream of numbers; series, the same in its turn.
class StreamHost final : public Host {
public:
    std::atomic<std::uint64_t> made{0};       ///< frames
    std::atomic<int> sessions{0}, streams{0}; ///< that there are
    std::atomic<bool> blocks{false};          ///< sessions that open or end wait for false
    std::atomic<int> blocked{0};

    [[nodiscard]] std::string version() const override { return "test"; }
    [[nodiscard]] std::unique_ptr<Session> open() override { return std::make_unique<StreamSession>(*this); }

private:
    class StreamSession final : public Session {
    public:
        explicit StreamSession(StreamHost& host) : host_(host) {
            wait();
            ++host_.sessions;
        }
        ~StreamSession() override {
            wait();
            --host_.sessions;
        }
        [[nodiscard]] Calls calls() override {
            Calls calls{call<NoArguments>("echo", Permission::view, "Echo.",
                                          [](const NoArguments&, Work& /*work*/) { return Answer{}; }),
                        call<Counting>("count", Permission::view, "Numbers.",
                                       [this](const Counting& c, Work& work) { return count(c, work); }),
                        call<Counting>("series", Permission::view, "Numbers, in turn.",
                                       [this](const Counting& c, Work& work) { return count(c, work); })};
            calls[1].beside = true;
            return calls;
        }

    private:
        void wait() {
            ++host_.blocked;
            while (host_.blocks)
                std::this_thread::sleep_for(1ms);
            --host_.blocked;
        }
        Answer count(const Counting& c, Work& work) {
            struct Counted {
                explicit Counted(std::atomic<int>& the_count) : count(the_count) { ++count; }
                ~Counted() { --count; }
                std::atomic<int>& count;
            } const counted(host_.streams);
            work.grant(c.credits);
            for (std::uint64_t number = 1; c.frames == 0 || number <= c.frames; ++number) {
                work.await_credit();
                work.reserve(c.bytes);
                Answer frame{{{"number", number}}};
                if (c.bytes > 0) frame.arrays = {{"p", {c.bytes / 4}, std::vector<float>(c.bytes / 4)}};
                ++host_.made;
                work.push(std::move(frame));
            }
            return {{{"frames", c.frames}}};
        }
        StreamHost& host_;
    };
};

struct Bench {
    explicit Bench(const Limits& limits = {}) : limits_(limits) {
        std::vector<Listener> listeners;
        listeners.push_back(Listener::unix_socket(server_.path()));
        server_.start(std::make_unique<Server>(limits_, host, std::move(listeners)));
    }
    [[nodiscard]] test::NativeClient client() const { return test::NativeClient(server_.path()); }
    StreamHost host;

private:
    Limits limits_;
    test::ServerThread server_;
};

Message must(test::NativeClient& client) {
    std::optional<Message> message = client.next();
    REQUIRE(message);
    return *message;
}

void check_frame(const Message& message, std::uint32_t id, std::uint64_t number) {
    CHECK(message.frame.kind == MessageKind::event);
    CHECK(message.frame.id == id);
    CHECK(message.head["event"] == "frame");
    CHECK(message.head["number"] == number);
}

} // namespace

TEST_CASE("a stream sends a frame for each credit and no more", "[service]") {
    Bench bench;
    test::NativeClient client = bench.client();
    client.request(5, {{"call", "count"}, {"credits", 2}});
    check_frame(must(client), 5, 1);
    check_frame(must(client), 5, 2);
    // Other requests are answered meanwhile; no third frame stands before their answers.
    client.request(6, {{"call", "echo"}});
    CHECK(must(client).frame.id == 6);
    client.request(7, {{"call", "status"}});
    CHECK(must(client).head["streams"] == 1);
    CHECK(bench.host.made == 2);
    client.request(8, {{"call", "credit"}, {"request", 5}, {"frames", 3}});
    std::set<std::uint64_t> numbers;
    for (int i = 0; i < 4; ++i)
        if (const Message message = must(client); message.frame.id == 5)
            numbers.insert(message.head["number"].get<std::uint64_t>());
        else
            CHECK(message.frame.id == 8);
    CHECK(numbers == std::set<std::uint64_t>{3, 4, 5});
    client.request(9, {{"call", "cancel"}, {"request", 5}});
    std::set<std::string> ends;
    for (int i = 0; i < 2; ++i) {
        const Message message = must(client);
        ends.insert(message.frame.id == 5 ? message.head["code"].get<std::string>() : "answer");
    }
    CHECK(ends == std::set<std::string>{"answer", "cancelled"});
    client.request(10, {{"call", "credit"}, {"request", 5}});
    CHECK(client.answer().head["credits"] == 0);
}

TEST_CASE("a stream with an end is answered after its last frame", "[service]") {
    Bench bench;
    test::NativeClient client = bench.client();
    for (const char* const call : {"count", "series"}) {
        client.request(5, {{"call", call}, {"credits", 9}, {"frames", 3}, {"bytes", 1 << 20}});
        for (std::uint64_t number = 1; number <= 3; ++number) {
            const Message message = must(client);
            check_frame(message, 5, number);
            CHECK(message.body.size() == 1 << 20);
        }
        const Message end = must(client);
        CHECK(end.frame.kind == MessageKind::answer);
        CHECK(end.head["frames"] == 3);
    }
}

TEST_CASE("a connection has a few streams at most, and ends them", "[service]") {
    Limits limits;
    limits.streams = 2;
    Bench bench(limits);
    {
        test::NativeClient client = bench.client();
        for (std::uint32_t id = 2; id < 4; ++id)
            client.request(id, {{"call", "count"}});
        client.request(4, {{"call", "count"}});
        CHECK(client.answer().head["code"] == "busy");
        // The place of one that has ended is free.
        client.request(5, {{"call", "cancel"}, {"request", 2}});
        test::until([&] { return bench.host.streams == 1; });
        std::optional<Message> of_third;
        while (!of_third || of_third->frame.kind == MessageKind::error) {
            client.request(6, {{"call", "count"}, {"credits", 1}});
            do
                of_third = must(client);
            while (of_third->frame.id != 6);
        }
        check_frame(*of_third, 6, 1);
        client.request(7, {{"call", "count"}, {"nothing", 1}});
        CHECK(client.answer().head["code"] == "busy");
    }
    test::until([&] { return bench.host.streams == 0 && bench.host.sessions == 0; });
}

TEST_CASE("a stream that nobody reads costs one frame, and others nothing", "[service]") {
    Bench bench;
    test::NativeClient lazy = bench.client(), other = bench.client();
    constexpr std::uint32_t bytes = 8 << 20;
    lazy.request(5, {{"call", "count"}, {"credits", 1000}, {"bytes", bytes}});
    test::until([&] { return bench.host.made >= 1; });
    for (std::uint32_t id = 1; id < 200; ++id) {
        other.request(id, {{"call", "echo"}});
        CHECK(other.answer().frame.id == id);
    }
    CHECK(bench.host.made == 1); // more than socket buffers hold
    // Its own answers wait for the frame that has begun, and for no other.
    lazy.request(6, {{"call", "status"}});
    check_frame(must(lazy), 5, 1);
    std::vector<std::uint32_t> ids{must(lazy).frame.id, must(lazy).frame.id};
    CHECK(std::count(ids.begin(), ids.end(), 6U) == 1);
}

TEST_CASE("frames count as memory of clients until they have been sent", "[service]") {
    Limits limits;
    limits.memory_bytes = 10 << 20;
    Bench bench(limits);
    test::NativeClient client = bench.client();
    client.request(5, {{"call", "count"}, {"credits", 3}, {"frames", 3}, {"bytes", 6 << 20}});
    for (std::uint64_t number = 1; number <= 3; ++number)
        check_frame(must(client), 5, number);
    CHECK(must(client).frame.kind == MessageKind::answer);
    client.request(6, {{"call", "count"}, {"credits", 3}, {"bytes", 11 << 20}});
    CHECK(client.answer().head["code"] == "too-large");
}

TEST_CASE("a session that takes long to open or to end holds up nobody else", "[service]") {
    Bench bench;
    test::NativeClient other = bench.client();
    const auto others_work = [&] {
        for (std::uint32_t id = 10; id < 20; ++id) {
            other.request(id, {{"call", "echo"}});
            CHECK(other.answer().frame.id == id);
        }
        const test::NativeClient further = bench.client();
    };
    others_work();
    {
        bench.host.blocks = true;
        test::NativeClient slow = bench.client();
        slow.request(2, {{"call", "echo"}});
        slow.request(3, {{"call", "status"}});
        CHECK(slow.answer().frame.id == 3);
        test::until([&] { return bench.host.blocked == 1; });
        others_work();
        bench.host.blocks = false;
        CHECK(slow.answer().frame.id == 2);
        bench.host.blocks = true;
    }
    test::until([&] { return bench.host.blocked == 1; });
    others_work();
    bench.host.blocks = false;
    test::until([&] { return bench.host.sessions == 1; });
}

TEST_CASE("a client that has not said hello costs no session", "[service]") {
    Bench bench;
    std::vector<test::NativeClient> greeted;
    for (int i = 0; i < 5; ++i)
        greeted.push_back(bench.client());
    CHECK(bench.host.sessions == 0);
    greeted[2].request(2, {{"call", "echo"}});
    CHECK(greeted[2].answer().frame.id == 2);
    CHECK(bench.host.sessions == 1);
}

} // namespace stream_test
