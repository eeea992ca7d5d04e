// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/recent_frames.hpp"

#include <fmt/format.h>

namespace obscura::emulator {
namespace {

std::string reasons_of(const sync::MissedCounts& counts) {
    std::string text;
    for (std::size_t reason = 0; reason < counts.size(); ++reason)
        if (counts[reason] > 0)
            text += fmt::format("{}{}: {}", text.empty() ? "" : ", ",
                                name_of(static_cast<sync::MissedReason>(reason)), counts[reason]);
    return text;
}

} // namespace

void RecentFrames::note(Time now, const CameraCounters& counters) {
    if (!snapshots_.empty() && now - snapshots_.back().time < ns_per_s) return;
    snapshots_.push_back({now, counters});
    while (snapshots_.size() > 2 && now - snapshots_[1].time >= span_ns)
        snapshots_.pop_front();
}

FrameOutcomes RecentFrames::until(Time now, const CameraCounters& counters) const {
    if (snapshots_.empty()) return {};
    const CameraCounters& before = snapshots_.front().counters;
    FrameOutcomes out;
    out.seconds = static_cast<double>(now - snapshots_.front().time) / static_cast<double>(ns_per_s);
    out.triggers = counters.triggers - before.triggers;
    out.missed_triggers = counters.missed_triggers - before.missed_triggers;
    for (std::size_t reason = 0; reason < out.missed_because.size(); ++reason)
        out.missed_because[reason] = counters.missed_because[reason] - before.missed_because[reason];
    out.frames = counters.frames - before.frames;
    out.complete = counters.complete - before.complete;
    out.late = counters.late - before.late;
    out.late_rows = counters.late_rows - before.late_rows;
    out.stalled = counters.stalled - before.stalled;
    out.stalled_rows = counters.stalled_rows - before.stalled_rows;
    out.abandoned = counters.abandoned - before.abandoned;
    out.dropped = counters.dropped - before.dropped;
    out.degraded = counters.quality.degraded - before.quality.degraded;
    return out;
}

Verdict judge(const FrameOutcomes& recent, bool acquiring, const std::string& controller) {
    if (!acquiring)
        return {Health::idle, controller.empty() ? "idle: no client is in control"
                                                 : fmt::format("idle: {} has not started it", controller)};
    const auto bad = [&recent](const std::string& what) {
        return Verdict{Health::bad, fmt::format("{}, last {:.0f} s", what, recent.seconds)};
    };
    if (recent.triggers == 0) return bad("no trigger");
    if (recent.missed_triggers > 0)
        return bad(fmt::format("{} of {} triggers missed ({})", recent.missed_triggers, recent.triggers,
                               reasons_of(recent.missed_because)));
    if (recent.dropped > 0)
        return bad(fmt::format("{} of {} triggers without a frame: no memory or transport was free",
                               recent.dropped, recent.triggers));
    if (recent.abandoned > 0)
        return bad(fmt::format("{} of {} frames abandoned", recent.abandoned, recent.frames));
    if (recent.late_rows > 0)
        return bad(
            fmt::format("{} late rows in {} of {} frames", recent.late_rows, recent.late, recent.complete));
    if (recent.stalled_rows > 0)
        return bad(fmt::format("{} rows in {} of {} frames left late: the system did not run the thread that "
                               "releases them",
                               recent.stalled_rows, recent.stalled, recent.complete));
    const std::string below = recent.degraded > 0 ? fmt::format(", {} degraded", recent.degraded) : "";
    return {Health::good, fmt::format("on time: 0 late rows in {} frames{}, last {:.0f} s", recent.complete,
                                      below, recent.seconds)};
}

} // namespace obscura::emulator
