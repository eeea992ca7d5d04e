// SPDX-License-Identifier: Apache-2.0
// A thousand hours of triggering on a fake clock: jitter, bounces, bursts, gaps, lost edges, clock steps and
// leap seconds. Every edge must become a frame or a counted miss, and no stamp may move.
#include "core/clock.hpp"
#include "core/philox.hpp"
#include "sync/conditioner.hpp"
#include "sync/schedule.hpp"
#include "sync/trigger_gate.hpp"
#include "tests/support/catch.hpp"

#include <cstdint>
#include <iostream>

namespace simulation_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

constexpr std::int64_t frame_period_ns = 40 * ns_per_ms; // of the imagined chip
constexpr std::int64_t debounce_ns = 2 * ns_per_ms;

/// The camera: takes what the gate lets through and is busy for a while.
class CameraModel final : public TriggerSink {
public:
    explicit CameraModel(TriggerGate& gate) : gate_(gate) {}

    void on_trigger(const Trigger& t) noexcept override {
        finish_until(t.seen);
        gate_.offer(t, 0);
        begin(t.seen);
    }
    void finish_until(Time now) noexcept {
        while (busy_ && busy_until_ <= now) {
            busy_ = false;
            const Time free_at = busy_until_;
            gate_.finished();
            begin(free_at); // a latched one
        }
    }

    std::uint64_t frames = 0, out_of_order = 0, checksum = 0;

private:
    void begin(Time now) noexcept {
        if (busy_ || !gate_.pending()) return;
        const Trigger& t = gate_.current();
        if (t.edge <= last_edge_) ++out_of_order;
        last_edge_ = t.edge;
        ++frames;
        checksum = checksum * 31 + static_cast<std::uint64_t>(t.edge.ns);
        // Now and then a frame takes longer than the trigger's period.
        const auto random = philox4x32({static_cast<std::uint32_t>(frames), 0, 0, 9}, {1, 2});
        busy_until_ = now + (20 + (random[0] % 256 == 0 ? 250 : random[1] % 60)) * ns_per_ms;
        busy_ = true;
        gate_.started(t.edge + gate_.held_ns() + frame_period_ns);
    }

    TriggerGate& gate_;
    bool busy_ = false;
    Time busy_until_, last_edge_{INT64_MIN};
};

struct Tally {
    std::uint64_t edges = 0, lost = 0, bounces = 0;
};

/// What the bench's clock does in slot k. Delivers to `sink` and books what it did.
void play_slot(std::uint64_t k, const Schedule& schedule, FakeClock& clock, TriggerSink& sink,
               std::uint64_t& id, Tally& tally) {
    const auto r =
        philox4x32({static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(k >> 32), 0, 0}, {3, 4});
    const std::uint64_t hour = k / 36'000;
    // A gap of ten minutes once in 50 hours: nothing happens at all.
    if (hour % 50 == 49 && k % 36'000 < 6'000) return;
    const auto deliver = [&](Time edge, std::int64_t latency_ns) {
        ++tally.edges;
        clock.advance_to(edge + latency_ns);
        sink.on_trigger({++id, edge, clock.now()});
    };
    const Time edge = schedule.slot(k) + static_cast<std::int64_t>(r[0] % 200'001) - 100'000; // +-100 us
    if (r[1] % 5000 == 0) { // the source was too slow and lost it
        ++id;
        ++tally.lost;
        return;
    }
    deliver(edge, 50'000 + r[2] % 200'000);
    if (r[1] % 1000 == 1) { // contact bounce
        deliver(edge + ns_per_ms, 300'000);
        ++tally.bounces;
    }
    if (r[1] % 20'000 == 2) // a burst, 5 ms apart
        for (int i = 1; i <= 8; ++i)
            deliver(edge + i * 5 * ns_per_ms, 100'000);
    // Leap seconds and clock steps: TAI against this clock moves, this clock does not.
    if (k % 36'000 == 17)
        clock.set_tai_offset_ns(clock.tai_offset_ns() + (hour % 3 == 0 ? ns_per_s : -12'345'678));
}

} // namespace

TEST_CASE("a thousand hours: every edge becomes a frame or a counted miss") {
    for (const OverTrigger policy : {OverTrigger::count, OverTrigger::latch}) {
        TriggerGate gate(policy);
        CameraModel camera(gate);
        Conditioner conditioner({.debounce_ns = debounce_ns}, camera);
        gate.open();
        FakeClock clock;
        const Schedule schedule({10, 1}, Time{ns_per_s}, 0);
        Tally tally;
        std::uint64_t id = 0;
        constexpr std::uint64_t slots = 36'000'000;
        for (std::uint64_t k = 0; k < slots; ++k)
            play_slot(k, schedule, clock, conditioner, id, tally);
        camera.finish_until(clock.now() + 10 * ns_per_s);

        const ConditionerCounters line = conditioner.counters();
        const GateCounters c = gate.counters();
        CHECK(clock.now() - Time{} > 999 * 3600 * ns_per_s);
        CHECK(line.edges == tally.edges);
        CHECK(line.lost == tally.lost);
        CHECK(line.bounces == tally.bounces);
        CHECK(line.passed == tally.edges - tally.bounces);
        CHECK(c.edges == line.passed);
        CHECK(c.lost == tally.lost);
        CHECK(c.taken == camera.frames);
        CHECK(c.edges + c.lost == c.taken + c.missed);
        CHECK(c.missed > tally.lost);
        CHECK(c.ignored == 0);
        CHECK(camera.out_of_order == 0);
        CHECK((policy == OverTrigger::latch) == (c.latched > 0));
        std::cout << "1000 h, " << (policy == OverTrigger::latch ? "latch" : "count") << ": "
                  << c.edges + c.lost << " edges, " << c.taken << " frames (" << c.latched << " latched), "
                  << c.missed << " missed (" << c.lost << " lost by the source), " << line.bounces
                  << " bounces\n";
    }
}

} // namespace simulation_test
