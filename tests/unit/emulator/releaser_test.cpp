// SPDX-License-Identifier: Apache-2.0
// The releasing thread under a clock that only moves when told to.
#include "emulator/camera/releaser.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

namespace releaser_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

struct Bench {
    explicit Bench(ReleaserSettings settings = {.max_rows = 8})
        : clock(new FakeClock), releaser(settings, std::unique_ptr<Clock>(clock)), pool(4, 64, 8) {}

    FrameRef frame(std::int32_t rows) {
        FrameRef f = pool.acquire();
        f->info.width = 4;
        f->info.height = rows;
        return f;
    }
    // The releasing thread has nothing to do before the clock moves.
    void settle() const {
        while (clock->sleepers() == 0)
            std::this_thread::sleep_for(std::chrono::microseconds(50));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }

    FakeClock* clock;
    Releaser releaser;
    FramePool pool;
};

} // namespace

TEST_CASE("rows leave at their times, the first exactly, the others in groups of a grain") {
    Bench bench({.max_rows = 8, .grain_ns = 250});
    const FrameRef frame = bench.frame(4);
    RowSink& sink = bench.releaser.begin(frame, {Time{1000}, Time{1100}, Time{1200}, Time{2000}}, 0);
    sink.rows_exposed(4);
    bench.releaser.end(true);
    bench.settle();
    bench.clock->advance_to(Time{999});
    bench.settle();
    CHECK(frame->rows_ready() == 0);
    bench.clock->advance_to(Time{1000});
    frame->wait_rows(1);
    bench.settle();
    CHECK(frame->rows_ready() == 1);
    bench.clock->advance_to(Time{1349}); // 1100 + 250 is when the next group leaves
    bench.settle();
    CHECK(frame->rows_ready() == 1);
    bench.clock->advance_to(Time{1350});
    CHECK(frame->wait_rows(3) == 3);
    bench.settle();
    bench.clock->advance_to(Time{2000});
    CHECK(frame->wait_rows(4) == 4);
    bench.releaser.wait_idle();
    const ReleaseCounters c = bench.releaser.counters();
    CHECK(c.complete == 1);
    CHECK(c.late == 0);
    CHECK(c.late_rows == 0);
    CHECK(bench.releaser.release_lateness().count() == 1);
    CHECK(bench.releaser.release_lateness().max_ns() == 0);
}

TEST_CASE("fast, rows leave when they are ready, before or after the chip's times") {
    Bench bench({.max_rows = 8, .timing = ReadoutTiming::fast, .policy = LatePolicy::drop});
    const FrameRef frame = bench.frame(4);
    bench.clock->advance_to(Time{500});
    RowSink& sink = bench.releaser.begin(frame, {Time{100}, Time{1100}, Time{1200}, Time{2000}}, 0);
    sink.rows_exposed(1);
    CHECK(frame->wait_rows(1) == 1);
    bench.clock->advance_to(Time{600});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    CHECK(frame->rows_ready() == 1);
    sink.rows_exposed(4);
    CHECK(frame->wait_rows(4) == 4); // the clock stands still
    bench.releaser.end(true);
    bench.releaser.wait_idle();
    const ReleaseCounters c = bench.releaser.counters();
    CHECK(c.complete == 1);
    CHECK(c.late_rows == 0);
    CHECK(c.dropped == 0);
    CHECK(frame->flags.load() == 0);
}

TEST_CASE("late rows are counted one by one and leave at once") {
    Bench bench;
    const FrameRef frame = bench.frame(4);
    frame->info.frame_id = 5;
    frame->info.trigger_id = 7;
    OutcomeRing::Request request = bench.releaser.outcomes().request();
    RowSink& sink = bench.releaser.begin(frame, {Time{0}, Time{10}, Time{20}, Time{30}}, 1000,
                                         {.acquisition = 2}, request.number);
    bench.clock->advance_to(Time{1015});
    sink.rows_exposed(2); // due at 1000 and 1010
    frame->wait_rows(2);
    sink.rows_exposed(4); // due at 1020 and 1030: in time
    bench.releaser.end(true);
    bench.settle();
    CHECK(frame->rows_ready() == 2);
    bench.clock->advance_to(Time{1030});
    frame->wait_rows(4);
    bench.releaser.wait_idle();
    const ReleaseCounters c = bench.releaser.counters();
    CHECK(c.complete == 1);
    CHECK(c.late == 1);
    CHECK(c.late_rows == 2);
    CHECK((frame->flags.load() & frame_late) != 0);
    const auto record = bench.releaser.outcomes().wait(request, EventCount::never);
    REQUIRE(record);
    CHECK(record->outcome == FrameOutcome::late);
    CHECK(record->frame_id == 5);
    CHECK(record->trigger_id == 7);
    CHECK(record->acquisition == 2);
    CHECK(record->late_rows == 2);
    CHECK(record->stalled_rows == 0);
    CHECK((record->flags & frame_late) != 0);
}

TEST_CASE("rows ready in time that leave late are stalled, apart from late ones") {
    Bench bench;
    const FrameRef frame = bench.frame(4);
    const Time due{1000};
    // Row 0 is late; row 1 is ready in time.
    RowSink& sink = bench.releaser.begin(frame, {due, due + 100, due + 200, due + 5 * ns_per_ms}, 0);
    bench.clock->advance_to(due + 50);
    sink.rows_exposed(1);
    frame->wait_rows(1);
    sink.rows_exposed(4);
    bench.settle();
    // The release thread sleeps until rows 1 and 2 leave together; it wakes too late.
    bench.clock->advance_to(due + 200 + release_stall_ns);
    frame->wait_rows(3);
    bench.settle();
    bench.clock->advance_to(due + 5 * ns_per_ms + release_stall_ns);
    bench.releaser.end(true);
    bench.releaser.wait_idle();
    const ReleaseCounters c = bench.releaser.counters();
    CHECK(c.complete == 1);
    CHECK(c.late_rows == 1);
    CHECK(c.stalled == 1);
    CHECK(c.stalled_rows == 1); // row 1; rows 2 and 3 left within the limit
    CHECK((frame->flags.load() & frame_stalled) != 0);
}

TEST_CASE("a partial frame keeps the rows that were in time; the renderer is told to stop") {
    Bench bench({.max_rows = 8, .policy = LatePolicy::partial, .grace_ns = 100});
    const FrameRef frame = bench.frame(4);
    RowSink& sink = bench.releaser.begin(frame, {Time{1000}, Time{1001}, Time{2000}, Time{2001}}, 0);
    sink.rows_exposed(2);
    bench.settle();
    bench.clock->advance_to(Time{1001});
    frame->wait_rows(2);
    bench.settle();
    bench.clock->advance_to(Time{2100}); // still within the grace
    bench.settle();
    CHECK_FALSE(frame->abandoned());
    CHECK_FALSE(bench.releaser.cancel_flag().load());
    bench.clock->advance_to(Time{2101});
    CHECK(frame->wait_rows(3) == 2);
    CHECK(bench.releaser.cancel_flag().load());
    bench.releaser.end(false);
    bench.releaser.wait_idle();
    CHECK((frame->flags.load() & frame_partial) != 0);
    CHECK(bench.releaser.counters().partial == 1);
    CHECK(bench.releaser.counters().abandoned == 1);
    CHECK(bench.releaser.counters().late_rows == 2);
}

TEST_CASE("with nothing to repeat a late frame is dropped") {
    Bench bench({.max_rows = 8, .policy = LatePolicy::repeat});
    const FrameRef frame = bench.frame(2);
    bench.releaser.begin(frame, {Time{10}, Time{20}}, 0);
    bench.settle();
    bench.clock->advance_to(Time{50});
    CHECK(frame->wait_rows(1) == 0);
    bench.releaser.end(false);
    bench.releaser.wait_idle();
    CHECK(bench.releaser.counters().dropped == 1);
    CHECK((frame->flags.load() & frame_dropped) != 0);
}

namespace {

/// A clock that moves 10 us whenever it is read, and at once to where a sleep is to end.
class TickingClock final : public Clock {
public:
    [[nodiscard]] Time now() const noexcept override { return {now_ns_.fetch_add(10'000) + 10'000}; }
    bool sleep_until(Time deadline) noexcept override {
        if (deadline.ns > now_ns_) now_ns_ = deadline.ns;
        return true;
    }
    void interrupt() noexcept override {}
    void rearm() noexcept override {}
    [[nodiscard]] std::int64_t tai_offset_ns() const noexcept override { return 0; }

private:
    mutable std::atomic<std::int64_t> now_ns_{ns_per_s};
};

} // namespace

TEST_CASE("polling is rationed to a fifth of every second") {
    auto owned = std::make_unique<TickingClock>();
    const TickingClock& clock = *owned;
    Releaser releaser({.max_rows = 1, .spin_ns = 15 * ns_per_ms}, std::move(owned));
    FramePool pool(4, 4, 1);
    const auto release_one = [&] {
        const FrameRef frame = pool.acquire();
        frame->info.width = 4;
        frame->info.height = 1;
        RowSink& sink = releaser.begin(frame, {clock.now() + 16 * ns_per_ms}, 0);
        sink.rows_exposed(1);
        releaser.end(true);
        frame->wait_rows(1);
        releaser.wait_idle();
    };
    for (int i = 0; i < 13; ++i)
        release_one(); // 13 times 15 ms are allowed
    CHECK(releaser.counters().spins_denied == 0);
    for (int i = 0; i < 7; ++i)
        release_one();
    CHECK(releaser.counters().spins_denied >= 5);
    CHECK(releaser.counters().complete == 20);
}

} // namespace releaser_test
