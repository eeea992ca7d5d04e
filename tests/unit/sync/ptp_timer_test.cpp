// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "sync/inputs/ptp_timer.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace ptp_timer_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

class Collector final : public TriggerSink {
public:
    void on_trigger(const Trigger& t) noexcept override {
        if (count < triggers.size()) triggers[count] = t;
        ++count;
        count.notify_all();
    }
    void wait_for(std::size_t n) const {
        for (std::size_t seen = count; seen < n; seen = count)
            count.wait(seen);
    }
    std::vector<Trigger> triggers = std::vector<Trigger>(64);
    std::atomic<std::size_t> count{0};
};

/// Another clock: the scheduling clock minus `difference_ns`, or nothing.
struct OtherClock {
    std::atomic<std::int64_t> difference_ns{0};
    std::atomic<bool> there{true};
    std::atomic<int> readings{0};
    ReadDifference reader() {
        return [this]() -> std::optional<std::int64_t> {
            ++readings;
            if (!there) return std::nullopt;
            return difference_ns.load();
        };
    }
};

struct Bench {
    explicit Bench(PtpTimerSettings settings, Time start, std::int64_t difference_ns) {
        other.difference_ns = difference_ns;
        auto owned = std::make_unique<FakeClock>(start);
        clock = owned.get();
        timer = std::make_unique<PtpTimer>(
            settings, [this] { return other.reader(); }, std::move(owned));
        timer->start(sink);
    }
    /// Moves the clock to where the timer wakes up, and waits until it sleeps again. It never sleeps for more
    /// than a quarter of a second.
    void advance_to(Time t) {
        const auto asleep = [this] {
            while (clock->sleepers() == 0)
                std::this_thread::sleep_for(std::chrono::microseconds(50));
        };
        asleep();
        const int before = other.readings;
        clock->advance_to(t);
        while (other.readings == before)
            std::this_thread::sleep_for(std::chrono::microseconds(50));
        asleep();
    }
    void pass_until(Time t) {
        while (clock->now() < t)
            advance_to(std::min(t, clock->now() + 250 * ns_per_ms));
    }

    OtherClock other;
    Collector sink;
    FakeClock* clock = nullptr;
    std::unique_ptr<PtpTimer> timer;
};

constexpr std::int64_t tai_s = 1'795'244'400; // what the other clock shows, about

} // namespace

TEST_CASE("slots lie at the scheduled start of the other clock and follow its rate") {
    // The other clock shows 1795244400.25 when this one shows 10 s; start is at .5, half a second of phase.
    const std::int64_t difference_ns = 10 * ns_per_s - (tai_s * ns_per_s + 250 * ns_per_ms);
    PtpTimerSettings settings;
    settings.rate = {10, 1};
    settings.start = parse_start("1795244400.5");
    settings.phase_ns = 50 * ns_per_ms;
    Bench bench(settings, Time{10 * ns_per_s}, difference_ns);
    bench.pass_until(Time{10 * ns_per_s + 250 * ns_per_ms});
    CHECK(bench.sink.count == 0);
    CHECK(bench.timer->clock_state(bench.clock->now()) == ClockState::locked);
    bench.pass_until(Time{10 * ns_per_s + 300 * ns_per_ms});
    bench.sink.wait_for(1);
    CHECK(bench.sink.triggers[0].id == 1);
    CHECK(bench.sink.triggers[0].edge == Time{10 * ns_per_s + 300 * ns_per_ms});
    CHECK(bench.sink.triggers[0].clock == ClockState::locked);
    // It has gained 10 us: its slots come sooner here.
    bench.other.difference_ns = difference_ns - 10'000;
    bench.advance_to(Time{10 * ns_per_s + 400 * ns_per_ms});
    bench.sink.wait_for(2);
    CHECK(bench.sink.triggers[1].edge == Time{10 * ns_per_s + 400 * ns_per_ms - 10'000});
    CHECK(bench.sink.triggers[1].id == 2);
    CHECK(bench.timer->steps() == 0);
}

TEST_CASE("a step of the other clock gives neither a burst nor silence; a lost clock is held over") {
    PtpTimerSettings settings;
    settings.rate = {2, 1};
    settings.start = Time{0};
    settings.holdover_ns = 2 * ns_per_s;
    Bench bench(settings, Time{100 * ns_per_s}, 0); // slot 200 is now
    bench.sink.wait_for(1);
    CHECK(bench.sink.triggers[0].id == 201);
    // An hour forward: the slots in between are missed, and counted.
    bench.other.difference_ns = -3600 * ns_per_s;
    bench.pass_until(Time{100 * ns_per_s + 500 * ns_per_ms});
    bench.sink.wait_for(2);
    CHECK(bench.sink.triggers[1].id == 201 + 7200 + 1);
    CHECK(bench.sink.triggers[1].edge == Time{100 * ns_per_s + 500 * ns_per_ms});
    CHECK(bench.timer->missed() == 7200);
    // And back: ids go on, edges keep their distance.
    bench.other.difference_ns = 0;
    bench.pass_until(Time{101 * ns_per_s});
    bench.sink.wait_for(3);
    CHECK(bench.sink.triggers[2].id == 201 + 7200 + 2);
    CHECK(bench.sink.triggers[2].edge == Time{101 * ns_per_s});
    CHECK(bench.timer->steps() == 2);

    bench.other.there = false;
    bench.pass_until(Time{102 * ns_per_s});
    bench.sink.wait_for(5);
    CHECK(bench.sink.triggers[4].edge == Time{102 * ns_per_s});
    CHECK(bench.sink.triggers[4].clock == ClockState::holdover);
    bench.pass_until(Time{104 * ns_per_s});
    bench.sink.wait_for(9);
    CHECK(bench.sink.triggers[8].clock == ClockState::free);
    bench.other.there = true;
    bench.pass_until(Time{105 * ns_per_s});
    bench.sink.wait_for(11);
    CHECK(bench.sink.triggers[10].clock == ClockState::locked);
    CHECK(bench.sink.triggers[10].id == 201 + 7200 + 10);
    bench.timer->stop();
    CHECK(bench.timer->clock_state(bench.clock->now()) == ClockState::free);
}

TEST_CASE("a step of the other clock does not repeat the slot of this instant") {
    PtpTimerSettings settings;
    settings.rate = {2, 1};
    settings.start = Time{0};
    Bench bench(settings, Time{100 * ns_per_s}, 0); // slot 200 is now
    bench.sink.wait_for(1);
    const int before = bench.other.readings;
    bench.other.difference_ns = -3600 * ns_per_s; // there, too, a slot falls on this instant
    bench.clock->interrupt();                     // the timer reads the other clock again, at the same time
    while (bench.other.readings == before)
        std::this_thread::sleep_for(std::chrono::microseconds(50));
    bench.clock->rearm();
    bench.pass_until(Time{100 * ns_per_s + 500 * ns_per_ms});
    bench.sink.wait_for(2);
    CHECK(bench.sink.triggers[1].edge == Time{100 * ns_per_s + 500 * ns_per_ms});
}

TEST_CASE("without a start the first slot is the next full second of the other clock") {
    Bench bench({.rate = {1, 1}}, Time{5'300 * ns_per_ms}, 100 * ns_per_ms); // there it is 5.2 s
    bench.pass_until(Time{6'100 * ns_per_ms});
    bench.sink.wait_for(1);
    CHECK(bench.sink.triggers[0].edge == Time{6'100 * ns_per_ms});
    CHECK(bench.sink.triggers[0].id == 1);
}

TEST_CASE("starts") {
    CHECK(parse_start("0") == Time{0});
    CHECK(parse_start("1795244437.5") == Time{1'795'244'437'500'000'000});
    CHECK(parse_start("1795244437.000000001") == Time{1'795'244'437'000'000'001});
    for (const char* bad :
         {"", ".5", "-1", "1e9", "1795244437.0000000001", "99999999999", "9000000001", "12x", "1.2.3"})
        CHECK_FALSE(parse_start(bad).has_value());
    CHECK_THROWS_AS(open_ptp_clock("trigger", "/dev/not-there"), HardwareError);
    CHECK_THROWS_AS(open_ptp_clock("trigger", "/dev/null"), HardwareError);
}

} // namespace ptp_timer_test
