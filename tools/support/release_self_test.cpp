// SPDX-License-Identifier: Apache-2.0
#include "tools/support/release_self_test.hpp"

#include "core/clock.hpp"
#include "core/frame.hpp"
#include "core/realtime.hpp"
#include "emulator/releaser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace obscura::tools {
namespace {

constexpr int release_priority = 75; // as in the daemon

/// One measurement of the self-test. `spin_ns`: how long before the due time polling begins; 0: sleep only.
struct Wakeups {
    const char* name;
    double rate_hz;
    std::int64_t spin_ns;
    int priority;
};

/// Releases one-row frames through the daemon's own row release thread at `rate_hz` for `seconds`. Returns
/// the 99th percentile of the lateness in microseconds and appends a table line to `out`.
double measure(const Wakeups& w, double seconds, std::string& out) {
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
    out += fmt::format("{:<34} {:>6.0f} {:>8} {:>10.1f} {:>10.1f} {:>10.1f}\n", w.name, w.rate_hz, h.count(),
                       us(h.quantile_ns(0.5)), us(h.quantile_ns(0.99)), us(h.max_ns()));
    return us(h.quantile_ns(0.99));
}

} // namespace

std::string release_self_test(double seconds) {
    const RealtimeGrant grant = realtime_permitted(release_priority);
    std::string out = grant.granted
                          ? "SCHED_FIFO is permitted\n"
                          : fmt::format("SCHED_FIFO is not permitted ({}): expect late frames on a busy "
                                        "machine\n",
                                        grant.why);
    out += fmt::format("\n{:<34} {:>6} {:>8} {:>10} {:>10} {:>10}\n", "row after its time, us", "Hz", "rows",
                       "p50", "p99", "max");
    std::vector<Wakeups> all{{"floor: sleep, ordinary scheduling", 10, 0, 0},
                             {"floor: sleep, ordinary scheduling", 100, 0, 0}};
    if (grant.granted) {
        all.push_back({"floor: sleep, SCHED_FIFO", 10, 0, release_priority});
        all.push_back({"floor: sleep, SCHED_FIFO", 100, 0, release_priority});
        all.push_back({"release: sleep, then poll", 10, 100 * ns_per_us, release_priority});
        all.push_back({"release: sleep, then poll", 100, 100 * ns_per_us, release_priority});
    }
    // 99th percentile over the last two rows of the table, which wait as the daemon does.
    double promise_us = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const double p99_us = measure(all[i], seconds, out);
        if (i + 2 >= all.size()) promise_us = std::max(promise_us, p99_us);
    }
    out += fmt::format("\nAt its present load this machine releases 99 of 100 rows at most {:.1f} us "
                       "after their due time; "
                       "the column max shows the worst row.\n",
                       promise_us);
    return out;
}

} // namespace obscura::tools
