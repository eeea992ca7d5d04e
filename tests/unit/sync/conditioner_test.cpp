// SPDX-License-Identifier: Apache-2.0
#include "sync/conditioner.hpp"
#include "tests/support/catch.hpp"

#include <vector>

namespace conditioner_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

struct Collector final : TriggerSink {
    void on_trigger(const Trigger& t) noexcept override { triggers.push_back(t); }
    std::vector<Trigger> triggers;
};

} // namespace

TEST_CASE("without settings every edge passes as it is") {
    Collector out;
    Conditioner conditioner({}, out);
    for (std::uint64_t id = 7; id < 10; ++id)
        conditioner.on_trigger({id, Time{static_cast<std::int64_t>(id) * 100}, Time{5000}});
    REQUIRE(out.triggers.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
        CHECK(out.triggers[i].id == i + 1);
        CHECK(out.triggers[i].edge == Time{static_cast<std::int64_t>(i + 7) * 100});
        CHECK(out.triggers[i].seen == Time{5000});
    }
}

TEST_CASE("what the source says of its next edge passes with the delay, but not through a divider") {
    const Trigger trigger{.id = 1, .edge = Time{1000}, .seen = Time{1010}, .next = Time{2000}};
    Collector delayed, divided;
    Conditioner({.delay_ns = 300}, delayed).on_trigger(trigger);
    Conditioner({.divider = 2}, divided).on_trigger(trigger);
    REQUIRE(delayed.triggers.size() == 1);
    CHECK(delayed.triggers[0].edge == Time{1300});
    CHECK(delayed.triggers[0].next == Time{2300});
    REQUIRE(divided.triggers.size() == 1);
    CHECK(divided.triggers[0].next == Trigger::unknown_edge);
}

TEST_CASE("bounces are dropped, counted, and do not prolong the hold-off") {
    Collector out;
    Conditioner conditioner({.debounce_ns = 1000}, out);
    std::uint64_t id = 1;
    for (const std::int64_t at : {0, 400, 900, 1000, 1999, 2000, 5000})
        conditioner.on_trigger({id++, Time{at}, Time{at}});
    std::vector<std::int64_t> passed;
    for (const Trigger& t : out.triggers)
        passed.push_back(t.edge.ns);
    CHECK(passed == std::vector<std::int64_t>{0, 1000, 2000, 5000});
    CHECK(out.triggers.back().id == 4); // bounces are no gaps
    CHECK(conditioner.counters().bounces == 3);
    CHECK(conditioner.counters().edges == 7);
    CHECK(conditioner.counters().passed == 4);
}

TEST_CASE("the divider lets the first of every n through, and keeps count of lost edges") {
    Collector out;
    Conditioner conditioner({.divider = 3}, out);
    // Positions 0..11 of the real edges; 4, 5 and 6 are lost by the source.
    for (const std::uint64_t id : {1, 2, 3, 4, 8, 9, 10, 11, 12})
        conditioner.on_trigger({id, Time{static_cast<std::int64_t>(id) * 1000}, Time{0}});
    std::vector<std::uint64_t> ids;
    std::vector<std::int64_t> edges;
    for (const Trigger& t : out.triggers)
        ids.push_back(t.id), edges.push_back(t.edge.ns);
    // Positions 0, 3, (6 was lost), 9.
    CHECK(edges == std::vector<std::int64_t>{1000, 4000, 10000});
    CHECK(ids == std::vector<std::uint64_t>{1, 2, 4});
    CHECK(conditioner.counters().lost == 3);
    CHECK(conditioner.counters().divided == 6);
}

TEST_CASE("the delay moves the stamp and nothing else") {
    Collector out;
    Conditioner conditioner({.delay_ns = 250}, out);
    conditioner.on_trigger({1, Time{1000}, Time{1010}});
    REQUIRE(out.triggers.size() == 1);
    CHECK(out.triggers[0].edge == Time{1250});
    CHECK(out.triggers[0].seen == Time{1010});
}

TEST_CASE("a clock that was set back does not shut the line") {
    Collector out;
    Conditioner conditioner({.debounce_ns = 1000}, out);
    conditioner.on_trigger({1, Time{1'000'000}, Time{0}});
    conditioner.on_trigger({2, Time{500}, Time{0}});
    conditioner.on_trigger({3, Time{1000}, Time{0}});
    CHECK(out.triggers.size() == 2);
    CHECK(conditioner.counters().bounces == 1);
}

} // namespace conditioner_test
