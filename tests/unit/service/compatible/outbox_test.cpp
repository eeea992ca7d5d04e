// SPDX-License-Identifier: Apache-2.0
// What a client that reads little is sent: unread answers, and answers after an error.
#include "service/compatible/codec.hpp"
#include "service/compatible/outbox.hpp"
#include "tests/support/catch.hpp"

#include <string>

namespace outbox_test {

using namespace obscura::service::compatible;
using namespace std::chrono_literals;

namespace {

using Clock = Outbox::Clock;

/// An outbox, the clock that it sees, and what a client that reads everything has got.
struct Bench {
    CompatibleLimits limits;
    Outbox outbox{limits};
    Clock::time_point now{};

    /// A request and its answer, as the connection hands them over.
    void call(const std::string& name, bool waits, bool fails = false) {
        const std::uint64_t request = outbox.requests_read(1);
        if (fails) outbox.add_line("[error] " + name, true);
        outbox.add_answer(request, {name}, waits, fails, now);
    }
    /// What is sent now: answers by their name, lines as they are.
    std::string sent() {
        std::string all;
        while (const Packet* const packet = outbox.next(now)) {
            std::string name = packet->start;
            if (name.find("data") == std::string::npos && name.size() > 30) {
                Decoder decoder({});
                (void)decoder.read(name);
                name = find(decoder.take(), "data")->as<Bytes>()->data;
            }
            all += (all.empty() ? "" : ", ") + name;
            outbox.advance(packet->size());
        }
        return all;
    }
};

} // namespace

TEST_CASE("an answer is dropped once a later request has been read", "[service]") {
    Bench bench;
    bench.call("setImageSize", false);
    bench.call("version", true);
    CHECK(bench.sent() == "version");
    bench.call("setImageSize", false);
    CHECK(bench.sent() == "setImageSize");
    CHECK(bench.sent().empty());
}

TEST_CASE("answers that nobody reads take no memory", "[service]") {
    Bench bench;
    for (int i = 0; i < 300'000; ++i) {
        bench.call("setObjectPosition", false);
        REQUIRE(bench.outbox.waiting() <= 100);
    }
    bench.call("version", true);
    CHECK(bench.sent() == "version");
}

TEST_CASE("an answer that comes after the next request was read is dropped at once", "[service]") {
    Bench bench;
    const std::uint64_t first = bench.outbox.requests_read(1);
    const std::uint64_t second = bench.outbox.requests_read(1);
    bench.outbox.add_answer(first, {"first"}, true, false, bench.now);
    CHECK(bench.sent().empty());
    bench.outbox.add_answer(second, {"second"}, true, false, bench.now);
    CHECK(bench.sent() == "second");
}

TEST_CASE("an answer that is begun is finished, one that is not is dropped", "[service]") {
    Bench bench;
    bench.call("getImage", true);
    REQUIRE(bench.outbox.next(bench.now) != nullptr); // handed out, nothing taken
    (void)bench.outbox.requests_read(1);
    CHECK(bench.sent().empty());

    bench.call("getImage", true);
    REQUIRE(bench.outbox.next(bench.now) != nullptr);
    bench.outbox.advance(3);
    (void)bench.outbox.requests_read(1);
    REQUIRE(bench.outbox.next(bench.now) != nullptr);
    CHECK(bench.outbox.next(bench.now)->start == "getImage");
    CHECK(bench.outbox.sent() == 3);
}

TEST_CASE("after an error the failing call's answer never meets the next call of that name", "[service]") {
    Bench bench;
    bench.call("getImage", true, true);
    CHECK(bench.sent() == "[error] getImage"); // the client raises
    bench.now += 1s;
    CHECK(bench.sent().empty());
    bench.call("getImage", true); // a retry gets its own answer, at once
    CHECK(bench.sent() == "getImage");
}

TEST_CASE("an unread setter's error makes the next getter fail, whose answer is dropped", "[service]") {
    Bench bench;
    bench.call("setObjectPosition", false, true);
    CHECK(bench.sent() == "[error] setObjectPosition");
    bench.call("render", false);
    CHECK(bench.sent() == "render");
    bench.call("getImage", true); // the client reads the line here, and raises
    CHECK(bench.sent().empty());
    bench.now += 1999ms;
    CHECK(bench.sent().empty());
    bench.call("getImage", true); // no stale picture
    CHECK(bench.sent() == "getImage");
}

TEST_CASE("a client that ignores errors gets the held answer after a while", "[service]") {
    Bench bench;
    bench.call("setObjectPosition", false, true);
    bench.call("getImage", true);
    CHECK(bench.sent() == "[error] setObjectPosition");
    REQUIRE(bench.outbox.due());
    CHECK(*bench.outbox.due() == bench.now + 2s);
    bench.now += 2s;
    CHECK(bench.sent() == "getImage");
    bench.call("getImage", true); // not held again
    CHECK(bench.sent() == "getImage");
}

TEST_CASE("a failing setter's own late answer does not end the wait for the getter's error", "[service]") {
    Bench bench;
    bench.call("setObjectPosition", false, true);
    CHECK(bench.sent() == "[error] setObjectPosition");
    bench.now += 3s; // the client computes
    CHECK(bench.sent() == "setObjectPosition");
    bench.call("getImage", true);
    CHECK(bench.sent().empty());
    bench.call("getImage", true);
    CHECK(bench.sent() == "getImage");
}

TEST_CASE("each unread error makes one getter fail", "[service]") {
    Bench bench;
    bench.call("setSunPower", false, true);
    bench.call("setObjectPosition", false, true);
    bench.call("getImage", true);
    CHECK(bench.sent() == "[error] setSunPower, [error] setObjectPosition");
    bench.call("getImage", true);
    CHECK(bench.sent().empty());
    bench.call("getImage", true);
    CHECK(bench.sent() == "getImage");
}

TEST_CASE("lines of log are limited, and those beyond are counted", "[service]") {
    Bench bench;
    for (int i = 0; i < 250; ++i)
        bench.call("setSunPower", false, true);
    CHECK(bench.outbox.waiting() < 20'000);
    const std::string sent = bench.sent();
    CHECK(sent.ends_with("[error] setSunPower, [error] 150 more lines"));
}

} // namespace outbox_test
