// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/pps_schedule.hpp"
#include "sync/inputs/pps_trigger.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

namespace pps_test {

using namespace obscura;
using namespace obscura::sync;

TEST_CASE("slots follow the pulse of their own second") {
    PpsSchedule schedule({.rate = {4, 1}, .phase_ns = 1000});
    CHECK_FALSE(schedule.started());
    CHECK(schedule.pulse(Time{5'000'000'000}));
    REQUIRE(schedule.started());
    CHECK(schedule.slot(0) == Time{5'000'001'000});
    CHECK(schedule.slot(3) == Time{5'750'001'000});
    CHECK(schedule.slot(4) == Time{6'000'001'000}); // expected: the pulse is not there yet
    CHECK(schedule.pulse(Time{6'000'000'040}));     // 40 ns late
    CHECK(schedule.last_offset_ns() == 40);
    CHECK(schedule.slot(4) == Time{6'000'001'040});
    CHECK(schedule.slot(5) == Time{6'250'001'040});
    CHECK(schedule.first_slot_from(Time{6'250'001'040}) == 5);
    CHECK(schedule.first_slot_from(Time{6'250'001'041}) == 6);
    CHECK_FALSE(schedule.awaits_pulse(8)); // with a phase no slot is a pulse
}

TEST_CASE("rates that do not divide the second keep their place over many seconds") {
    PpsSchedule schedule({.rate = {5, 2}}); // every 0.4 s
    schedule.pulse(Time{0});
    for (std::int64_t second = 1; second <= 10'000; ++second)
        schedule.pulse(Time{second * (ns_per_s + 7)}); // the scheduling clock runs 7 ppb fast
    // Slot 25,001 lies at 10,000.4 s after the first pulse.
    CHECK(schedule.slot(25'001) == Time{10'000 * (ns_per_s + 7) + 400'000'000});
    CHECK(schedule.awaits_pulse(25'005)); // 10,002 s
    CHECK_FALSE(schedule.awaits_pulse(25'000));
    CHECK_FALSE(schedule.awaits_pulse(25'001));
}

TEST_CASE("missing pulses, glitches and the state of the clock") {
    PpsSchedule schedule({.rate = {1, 1}});
    const auto at = [](double s) { return Time{static_cast<std::int64_t>(s * 1e9)}; };
    CHECK(schedule.state(at(0)) == ClockState::free);
    schedule.pulse(at(1));
    CHECK(schedule.state(at(1.1)) == ClockState::free); // one pulse proves nothing
    schedule.pulse(at(2));
    CHECK(schedule.state(at(2.1)) == ClockState::locked);
    CHECK_FALSE(schedule.pulse(at(2.3))); // glitch
    CHECK(schedule.state(at(3.2)) == ClockState::locked);
    CHECK(schedule.state(at(4.0)) == ClockState::holdover);
    CHECK(schedule.slot(5) == at(6)); // runs on
    schedule.pulse(at(6.0005));       // four seconds later, within the tolerance for four seconds
    CHECK(schedule.state(at(6.1)) == ClockState::locked);
    CHECK(schedule.slot(5) == at(6.0005));
    CHECK(schedule.slot(6) == at(7.0005));
    schedule.pulse(at(7.2)); // a jump
    CHECK(schedule.state(at(7.3)) == ClockState::free);
    schedule.pulse(at(8.2));
    CHECK(schedule.state(at(8.3)) == ClockState::locked);
    CHECK(schedule.state(at(100)) == ClockState::free);
}

namespace {

// Pulses that the test sends.
struct PulseBox {
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<Edge> edges;
    void send(Time at, std::uint64_t sequence) {
        const std::lock_guard lock(mutex);
        edges.push_back({at, sequence});
        changed.notify_all();
    }
};

class BoxInput final : public EdgeInput {
public:
    explicit BoxInput(PulseBox& box) : box_(box) {}
    int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept override {
        std::unique_lock lock(box_.mutex);
        if (!box_.changed.wait_for(lock, std::chrono::nanoseconds(timeout_ns),
                                   [&] { return !box_.edges.empty(); }))
            return 0;
        edges[0] = box_.edges.front();
        box_.edges.pop_front();
        return 1;
    }

private:
    PulseBox& box_;
};

struct Collector final : TriggerSink {
    void on_trigger(const Trigger& t) noexcept override {
        const std::lock_guard lock(mutex);
        triggers.push_back(t);
        changed.notify_all();
    }
    std::vector<Trigger> wait_for(std::size_t n) {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return triggers.size() >= n; });
        return triggers;
    }
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<Trigger> triggers;
};

void settle(FakeClock& clock) {
    while (clock.sleepers() == 0)
        std::this_thread::sleep_for(std::chrono::microseconds(50));
}

} // namespace

TEST_CASE("the source triggers on the pulse with the pulse's stamp, between pulses by the clock") {
    PulseBox box;
    auto owned = std::make_unique<FakeClock>(Time{10 * ns_per_s});
    FakeClock& clock = *owned;
    Collector sink;
    PpsTrigger source(
        {.rate = {2, 1}}, ThreadSettings{}, [&] { return std::make_unique<BoxInput>(box); },
        std::move(owned));
    source.start(sink);
    settle(clock);
    CHECK(source.clock_state(clock.now()) == ClockState::free);

    clock.advance_to(Time{10 * ns_per_s + 20});
    box.send(Time{10 * ns_per_s + 5}, 1);
    sink.wait_for(1);
    settle(clock);
    CHECK_FALSE(source.offset_ns()); // the first pulse was not expected at any time
    clock.advance_to(Time{10'500'000'005});
    sink.wait_for(2);
    settle(clock);
    clock.advance_to(Time{11'000'000'090}); // the slot of the pulse: nothing before its stamp is known
    settle(clock);
    box.send(Time{11'000'000'060}, 2);
    sink.wait_for(3);
    settle(clock);
    CHECK(source.clock_state(clock.now()) == ClockState::locked);
    CHECK(source.offset_ns() == 55);
    clock.advance_to(Time{11'500'000'060});
    sink.wait_for(4);
    settle(clock);
    clock.advance_to(Time{12'019'000'000}); // the next pulse does not come
    settle(clock);
    clock.advance_to(Time{12'020'000'060});
    const std::vector<Trigger> triggers = sink.wait_for(5);
    source.stop();
    REQUIRE(triggers.size() == 5);
    const std::int64_t edges[] = {10'000'000'005, 10'500'000'005, 11'000'000'060, 11'500'000'060,
                                  12'000'000'060};
    for (std::size_t i = 0; i < 5; ++i) {
        CHECK(triggers[i].id == i + 1);
        CHECK(triggers[i].edge.ns == edges[i]);
    }
    CHECK(source.missed() == 0);
}

} // namespace pps_test
