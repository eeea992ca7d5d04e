// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/release_self_test.hpp"

#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/releaser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace obscura::emulator {
namespace {

constexpr int release_priority = 75; // as in the daemon

/// One measurement of the self-test. `spin_ns`: how long before the due time polling begins; 0: sleep only.
struct Wakeups {
    const char* name;
    double rate_hz;
    std::int64_t spin_ns;
    int priority;
};

/// Releases one-row frames through the daemon's own row release thread at `rate_hz` for `seconds`.
ReleaseLateness measure(const Wakeups& w, double seconds) {
    emulator::Releaser releaser({.max_rows = 1, .thread = {w.priority, {}}, .spin_ns = w.spin_ns},
                                std::make_unique<MonotonicClock>());
    FramePool pool(emulator::Releaser::frames_in_flight + 1, 16, 1);
    const MonotonicClock clock;
    const auto period_ns = static_cast<std::int64_t>(1e9 / w.rate_hz);
    Time due = clock.now() + 10 * ns_per_ms;
    for (const Time end = due + static_cast<std::int64_t>(seconds * 1e9); due < end; due += period_ns) {
        FrameRef frame = pool.acquire();
        frame->info.width = frame->info.height = 1;
        frame->info.trigger_edge = due;
        emulator::RowSink& sink = releaser.begin(frame, {due}, 0);
        sink.rows_exposed(1);
        releaser.end(true);
        releaser.wait_idle();
    }
    const LatencyHistogram& h = releaser.release_lateness();
    const auto us = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
    return {w.name, w.rate_hz, h.count(), us(h.quantile_ns(0.5)), us(h.quantile_ns(0.99)), us(h.max_ns())};
}

} // namespace

ReleaseSelfTest release_self_test(double seconds, bool realtime) {
    ReleaseSelfTest test;
    std::vector<Wakeups> all{{"floor: sleep, ordinary scheduling", 10, 0, 0},
                             {"floor: sleep, ordinary scheduling", 100, 0, 0}};
    if (!realtime) {
        test.scheduling = "ordinary scheduling, of this program; the daemon's may be better";
    } else if (const RealtimeGrant grant = realtime_permitted(release_priority); grant.granted) {
        test.scheduling = "SCHED_FIFO is permitted";
        all.push_back({"floor: sleep, SCHED_FIFO", 10, 0, release_priority});
        all.push_back({"floor: sleep, SCHED_FIFO", 100, 0, release_priority});
        all.push_back({"release: sleep, then poll", 10, 100 * ns_per_us, release_priority});
        all.push_back({"release: sleep, then poll", 100, 100 * ns_per_us, release_priority});
    } else {
        test.scheduling =
            fmt::format("SCHED_FIFO is not permitted ({}): expect late frames on a busy machine", grant.why);
    }
    for (const Wakeups& one : all)
        test.rows.push_back(measure(one, seconds));
    // They wait as the daemon does.
    test.p99_us = std::max(test.rows.rbegin()[0].p99_us, test.rows.rbegin()[1].p99_us);
    return test;
}

std::string text_of(const ReleaseSelfTest& test) {
    std::string out = fmt::format("{}\n\n{:<34} {:>6} {:>8} {:>10} {:>10} {:>10}\n", test.scheduling,
                                  "row after its time, us", "Hz", "rows", "p50", "p99", "max");
    for (const ReleaseLateness& row : test.rows)
        out += fmt::format("{:<34} {:>6.0f} {:>8} {:>10.1f} {:>10.1f} {:>10.1f}\n", row.name, row.rate_hz,
                           row.rows, row.p50_us, row.p99_us, row.max_us);
    return out +
           fmt::format(
               "\n"
               "At its present load this machine releases 99 of 100 rows at most {:.1f} us after their due time; "
               "the column max shows the worst row.\n",
               test.p99_us);
}

} // namespace obscura::emulator
