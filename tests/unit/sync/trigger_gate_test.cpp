// SPDX-License-Identifier: Apache-2.0
#include "sync/trigger_gate.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <thread>
#include <vector>

namespace trigger_gate_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

Trigger at(std::uint64_t id, std::int64_t ns) {
    return {id, Time{ns}, Time{ns}};
}

std::uint64_t missed(const TriggerGate& gate, MissedReason reason) {
    return gate.counters().missed_because[static_cast<std::size_t>(reason)];
}

void check_balance(const GateCounters& c, std::uint64_t waiting = 0) {
    CHECK(c.edges + c.lost == c.taken + c.missed + c.masked + waiting);
}

} // namespace

TEST_CASE("a closed gate takes nothing; an open one takes one at a time from the chosen input") {
    TriggerGate gate;
    CHECK_FALSE(gate.offer(at(1, 10), 0));
    gate.open();
    CHECK(gate.ready());
    CHECK_FALSE(gate.offer(at(1, 10), 1));
    CHECK(gate.offer(at(1, 10), 0));
    CHECK(gate.pending());
    CHECK_FALSE(gate.offer(at(2, 20), 0));
    REQUIRE(gate.wait());
    CHECK(gate.current().id == 1);
    gate.started(Time{100});
    CHECK_FALSE(gate.offer(at(3, 200), 0));
    gate.finished();
    CHECK_FALSE(gate.offer(at(4, 99), 0));
    CHECK(gate.offer(at(5, 100), 0));
    const GateCounters c = gate.counters();
    CHECK(c.ignored == 2);
    CHECK(c.taken == 2);
    CHECK(c.missed == 3);
    // Before the frame was begun, and after its period; within the period.
    CHECK(missed(gate, MissedReason::rendering) == 2);
    CHECK(missed(gate, MissedReason::chip_busy) == 1);
    check_balance(c);
}

TEST_CASE("the frame period ends with the acquisition") {
    TriggerGate gate;
    gate.open();
    CHECK(gate.offer(at(1, 10), 0));
    gate.started(Time{1000});
    gate.finished();
    CHECK_FALSE(gate.offer(at(2, 500), 0));
    gate.close(true);
    gate.open();
    CHECK(gate.offer(at(3, 600), 0));
}

TEST_CASE("gaps in the ids are missed edges, but not across closing or selecting") {
    TriggerGate gate;
    gate.open();
    CHECK(gate.offer(at(10, 1), 0));
    gate.finished();
    CHECK(gate.offer(at(14, 2), 0));
    gate.finished();
    CHECK(gate.counters().lost == 3);
    gate.select(1);
    CHECK(gate.offer(at(40, 3), 1));
    gate.finished();
    gate.select(0);
    CHECK(gate.offer(at(90, 4), 0));
    gate.finished();
    gate.close(true);
    gate.offer(at(95, 5), 0);
    gate.open();
    CHECK(gate.offer(at(99, 6), 0));
    CHECK(gate.counters().lost == 3);
    CHECK(gate.counters().missed == 3);
    CHECK(missed(gate, MissedReason::lost_edge) == 3);
    check_balance(gate.counters());
}

TEST_CASE("over-triggers under each policy") {
    SECTION("ignore: masked, not missed") {
        TriggerGate gate(OverTrigger::ignore);
        gate.open();
        gate.offer(at(1, 1), 0);
        gate.offer(at(2, 2), 0);
        CHECK(gate.counters().masked == 1);
        CHECK(gate.counters().missed == 0);
        check_balance(gate.counters());
    }
    SECTION("latch: one waits for the consumer, and for the chip's period") {
        TriggerGate gate(OverTrigger::latch);
        gate.open();
        CHECK(gate.offer(at(1, 1), 0));
        CHECK(gate.offer(at(2, 20), 0));
        CHECK_FALSE(gate.offer(at(3, 30), 0));
        check_balance(gate.counters(), 1);
        gate.started(Time{50});
        gate.finished();
        REQUIRE(gate.pending());
        CHECK(gate.current().id == 2);
        CHECK(gate.held_ns() == 30);
        gate.started(Time{100});
        gate.finished();
        CHECK_FALSE(gate.pending());
        // Too soon for the chip while the consumer is free: taken at once, to take effect later.
        CHECK(gate.offer(at(4, 60), 0));
        REQUIRE(gate.pending());
        CHECK(gate.held_ns() == 40);
        CHECK(gate.counters().latched == 2);
        CHECK(gate.counters().missed == 1);
        CHECK(missed(gate, MissedReason::latch_full) == 1);
        check_balance(gate.counters());
    }
    SECTION("latch: what waits at the end is missed") {
        TriggerGate gate(OverTrigger::latch);
        gate.open();
        gate.offer(at(1, 1), 0);
        gate.offer(at(2, 2), 0);
        gate.close_after_this();
        gate.started(Time{3});
        gate.finished();
        CHECK_FALSE(gate.pending());
        CHECK(gate.counters().missed == 1);
        CHECK(missed(gate, MissedReason::stopped) == 1);
        check_balance(gate.counters());
    }
}

TEST_CASE("two sources and a controller at once: every edge is accounted for") {
    for (const OverTrigger policy : {OverTrigger::count, OverTrigger::ignore, OverTrigger::latch}) {
        TriggerGate gate(policy);
        std::atomic<std::uint64_t> consumed{0};
        std::thread consumer([&] {
            while (gate.wait()) {
                ++consumed;
                gate.started(gate.current().edge + 3);
                gate.finished();
            }
        });
        constexpr std::uint64_t count = 20'000;
        const auto source = [&](std::size_t input) {
            for (std::uint64_t id = 1; id <= count; ++id)
                gate.offer(at(id, static_cast<std::int64_t>(id) * 2), input);
        };
        std::thread a(source, 0), b(source, 1);
        for (int i = 0; i < 200; ++i) {
            gate.open();
            gate.select(static_cast<std::size_t>(i) % 2);
            std::this_thread::yield();
            gate.close(i % 3 == 0);
        }
        a.join();
        b.join();
        gate.close(true);
        gate.quit();
        consumer.join();
        const GateCounters c = gate.counters();
        CHECK(c.edges + c.ignored == 2 * count);
        CHECK(c.taken == consumed);
        check_balance(c);
    }
}

TEST_CASE("a listener hears of every occasion on which edges are missed") {
    struct Listener final : MissedListener {
        std::vector<std::int64_t> edges;
        void on_missed(Time edge) noexcept override { edges.push_back(edge.ns); }
    } listener;
    TriggerGate gate(OverTrigger::latch);
    gate.set_missed_listener(&listener);
    gate.open();
    CHECK(gate.offer({1, Time{100}, Time{100}}, 0));
    CHECK(gate.offer({4, Time{200}, Time{200}}, 0)); // two lost before it; itself latched
    CHECK_FALSE(gate.offer({5, Time{300}, Time{300}}, 0));
    gate.started(Time{0});
    gate.close(false); // the latched one is missed now
    CHECK(listener.edges == std::vector<std::int64_t>{200, 300, 200});
    CHECK(gate.counters().missed == 4);
}

} // namespace trigger_gate_test
