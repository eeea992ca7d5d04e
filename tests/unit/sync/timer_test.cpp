// SPDX-License-Identifier: Apache-2.0
#include "sync/software.hpp"
#include "sync/timer.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace timer_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

// Checks every trigger against the schedule as it comes, and says when `expected` have come.
class CheckingSink final : public TriggerSink {
public:
    CheckingSink(Schedule schedule, std::uint64_t expected) : schedule_(schedule), expected_(expected) {}

    void on_trigger(const Trigger& t) noexcept override {
        if (done_.load()) return;
        if (t.id != last_id_ + 1) ++gaps_;
        if (t.edge != schedule_.slot(t.id - 1)) ++misplaced_;
        if (t.seen < t.edge) ++early_;
        last_id_ = t.id;
        last_edge_ = t.edge;
        if (++count_ == expected_) {
            done_ = true;
            done_.notify_all();
        }
    }
    void wait() { done_.wait(false); }

    std::uint64_t count_ = 0, gaps_ = 0, misplaced_ = 0, early_ = 0, last_id_ = 0;
    Time last_edge_;

private:
    Schedule schedule_;
    std::uint64_t expected_;
    std::atomic<bool> done_{false};
};

// Collects, and can hold the timer's thread up inside a delivery, as a slow sink would.
class CollectingSink final : public TriggerSink {
public:
    void on_trigger(const Trigger& t) noexcept override {
        triggers[count.load()] = t;
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

void wait_for_sleeper(const FakeClock& clock) {
    while (clock.sleepers() == 0)
        std::this_thread::sleep_for(std::chrono::microseconds(50));
}

} // namespace

TEST_CASE("a thousand hours of timer: every edge in its place, none lost") {
    const RationalRate rate = rational_rate(30000.0 / 1001.0 / 10);
    const std::uint64_t slots = 3'600'000ULL * 3000 / 1001;
    const Time start{777};
    TimerSettings settings;
    settings.rate = rate;
    settings.phase_ns = 250;
    TimerTrigger timer(settings, std::make_unique<FakeClock>(start, true));
    CheckingSink sink(Schedule(rate, start, 250), slots);
    timer.start(sink);
    sink.wait();
    timer.stop();
    CHECK(sink.count_ == slots);
    CHECK(sink.gaps_ == 0);
    CHECK(sink.misplaced_ == 0);
    CHECK(sink.early_ == 0);
    CHECK(timer.missed() == 0);
    // 3000/1001 Hz: slot k at floor(k * 1001/3000 s).
    CHECK(sink.last_edge_.ns == 777 + 250 + static_cast<std::int64_t>((slots - 1) / 3000) * 1001 * ns_per_s +
                                    static_cast<std::int64_t>((slots - 1) % 3000) * 1001 * ns_per_s / 3000);
}

TEST_CASE("slots that were slept through are a gap in the ids, not a burst") {
    auto owned = std::make_unique<FakeClock>();
    FakeClock& clock = *owned;
    TimerSettings settings;
    settings.rate = {10, 1};
    TimerTrigger timer(settings, std::move(owned));
    CollectingSink sink;
    timer.start(sink);
    sink.wait_for(1); // slot 0 is at the start
    wait_for_sleeper(clock);
    clock.advance_to(Time{100 * ns_per_ms});
    sink.wait_for(2);
    wait_for_sleeper(clock);
    clock.advance_to(Time{750 * ns_per_ms}); // over slots 2..7
    sink.wait_for(3);
    wait_for_sleeper(clock);
    clock.advance_to(Time{800 * ns_per_ms});
    sink.wait_for(4);
    timer.stop();
    REQUIRE(sink.count == 4);
    CHECK(sink.triggers[1].id == 2);
    CHECK(sink.triggers[2].id == 8);
    CHECK(sink.triggers[2].edge == Time{700 * ns_per_ms});
    CHECK(sink.triggers[2].seen == Time{750 * ns_per_ms});
    CHECK(sink.triggers[3].id == 9);
    CHECK(timer.missed() == 5);
    timer.start(sink); // counts anew
    timer.stop();
    CHECK(timer.missed() == 0);
}

TEST_CASE("an epoch in the past is counted from, not caught up with") {
    auto owned = std::make_unique<FakeClock>(Time{1'050 * ns_per_ms});
    FakeClock& clock = *owned;
    TimerSettings settings;
    settings.rate = {10, 1};
    settings.start = Time{0};
    TimerTrigger timer(settings, std::move(owned));
    CollectingSink sink;
    timer.start(sink);
    wait_for_sleeper(clock);
    clock.advance_to(Time{1'100 * ns_per_ms});
    sink.wait_for(1);
    timer.stop();
    REQUIRE(sink.count == 1);
    CHECK(sink.triggers[0].id == 12);
    CHECK(sink.triggers[0].edge == Time{1'100 * ns_per_ms});
    CHECK(timer.missed() == 0);
}

TEST_CASE("a timer can be stopped while it sleeps and started again") {
    auto owned = std::make_unique<FakeClock>();
    TimerSettings settings;
    settings.phase_ns = ns_per_s;
    FakeClock& clock = *owned;
    TimerTrigger timer(settings, std::move(owned));
    CollectingSink sink;
    for (int round = 0; round < 3; ++round) {
        timer.start(sink);
        wait_for_sleeper(clock);
        timer.stop();
    }
    CHECK(sink.count == 0);
}

TEST_CASE("the software trigger delivers what it is told, while it is started") {
    const FakeClock clock(Time{500});
    SoftwareTrigger software(clock);
    CollectingSink sink;
    CHECK_FALSE(software.fire(Time{1}));
    software.start(sink);
    CHECK(software.fire(Time{400}));
    CHECK(software.fire(Time{450}));
    software.stop();
    CHECK_FALSE(software.fire(Time{460}));
    REQUIRE(sink.count == 2);
    CHECK(sink.triggers[0].id == 1);
    CHECK(sink.triggers[0].edge == Time{400});
    CHECK(sink.triggers[0].seen == Time{500});
    CHECK(sink.triggers[1].id == 2);
}

} // namespace timer_test
