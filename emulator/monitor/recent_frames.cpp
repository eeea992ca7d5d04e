// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/recent_frames.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::emulator {
namespace {

std::string reasons_of(const MissedCounts& counts) {
    std::string text;
    for (std::size_t reason = 0; reason < counts.size(); ++reason)
        if (counts[reason] > 0)
            text += fmt::format("{}{}: {}", text.empty() ? "" : ", ",
                                name_of(static_cast<MissedReason>(reason)), counts[reason]);
    return text;
}

/// A camera that has just been started has that long for its first trigger.
constexpr double first_trigger_s = 10;

} // namespace

void RecentFrames::note(Time now, const CameraCounters& counters, bool acquiring, std::uint64_t undelivered) {
    if (!acquiring) {
        frame_.reset();
        max_gap_ns_ = 0;
        for (Snapshot& snapshot : snapshots_)
            snapshot.max_gap_ns = 0;
    } else if (counters.complete != complete_) {
        note_frame(now);
    }
    complete_ = counters.complete;
    if (!snapshots_.empty() && now - snapshots_.back().time < ns_per_s) return;
    snapshots_.push_back({now, counters, undelivered});
    while (snapshots_.size() > 2 && now - snapshots_[1].time >= span_ns)
        snapshots_.pop_front();
}

void RecentFrames::note_frame(Time now) {
    if (frame_ && !snapshots_.empty()) {
        Snapshot& latest = snapshots_.back();
        latest.max_gap_ns = std::max(latest.max_gap_ns, now - *frame_);
        max_gap_ns_ = 0;
        for (const Snapshot& snapshot : snapshots_)
            max_gap_ns_ = std::max(max_gap_ns_, snapshot.max_gap_ns);
    }
    frame_ = now;
}

std::optional<RecentFrames::LastFrame> RecentFrames::last_frame(Time now) const {
    if (!frame_ || max_gap_ns_ == 0) return {};
    const auto seconds = [](std::int64_t ns) {
        return static_cast<double>(ns) / static_cast<double>(ns_per_s);
    };
    return LastFrame{seconds(now - *frame_), seconds(std::max(overdue_gaps * max_gap_ns_, min_overdue_ns))};
}

FrameOutcomes RecentFrames::until(Time now, const CameraCounters& counters, std::uint64_t undelivered) const {
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
    out.unsent = counters.unsent - before.unsent;
    out.undelivered = undelivered - snapshots_.front().undelivered;
    out.degraded = counters.quality.degraded - before.quality.degraded;
    return out;
}

Verdict judge(const FrameOutcomes& recent, bool acquiring, const std::string& controller,
              const AwaitedTrigger& awaited, bool for_client,
              const std::optional<RecentFrames::LastFrame>& last_frame) {
    if (!acquiring)
        return {Health::idle, controller.empty() ? "idle: the acquisition is stopped, no client is in control"
                                                 : fmt::format("idle: {} has not started it", controller)};
    const auto bad = [&recent](const std::string& what) {
        return Verdict{Health::bad, fmt::format("{}, last {:.0f} s", what, recent.seconds)};
    };
    if (recent.triggers == 0 && awaited.on_request)
        return {Health::idle,
                fmt::format("idle: waits for {}, none in the last {:.0f} s", awaited.name, recent.seconds)};
    if (recent.triggers == 0 && awaited.acquires_s < first_trigger_s)
        return {Health::idle,
                fmt::format("idle: no trigger yet of {}, {:.0f} s after the start of the acquisition",
                            awaited.name, awaited.acquires_s)};
    if (recent.triggers == 0) return bad(fmt::format("no trigger of {}", awaited.name));
    if (last_frame && !awaited.on_request && last_frame->age_s > last_frame->overdue_s)
        return {Health::bad, fmt::format("no frame of {} for {:.0f} s, where one was due within {:.0f} s",
                                         awaited.name, last_frame->age_s, last_frame->overdue_s)};
    if (recent.missed_triggers > 0)
        return bad(fmt::format("{} of {} triggers missed ({})", recent.missed_triggers, recent.triggers,
                               reasons_of(recent.missed_because)));
    if (recent.dropped > 0)
        return bad(fmt::format("{} of {} triggers without a frame: no memory or transport was free",
                               recent.dropped, recent.triggers));
    const bool client_awaited = for_client && controller.empty();
    if (recent.unsent > 0 && !client_awaited)
        return bad(fmt::format("{} of {} frames were sent nowhere: no transport had a receiver, or room",
                               recent.unsent, recent.frames));
    if (recent.undelivered > 0)
        return bad(fmt::format("{} of {} frames were not delivered by {}, see the log", recent.undelivered,
                               recent.frames, recent.undelivered_by));
    if (recent.abandoned > 0)
        return bad(fmt::format("{} of {} frames abandoned", recent.abandoned, recent.frames));
    if (recent.late_rows > 0)
        return bad(
            fmt::format("{} late rows in {} of {} frames", recent.late_rows, recent.late, recent.complete));
    if (recent.stalled_rows > 0)
        return bad(
            fmt::format("{} rows in {} of {} frames left late: the system did not run the release thread",
                        recent.stalled_rows, recent.stalled, recent.complete));
    std::string beside = recent.degraded > 0 ? fmt::format(", {} degraded", recent.degraded) : "";
    if (recent.unsent > 0)
        beside += fmt::format(", {} sent nowhere as no client is in control", recent.unsent);
    return {Health::good, fmt::format("on time: 0 late rows in {} frames{}, last {:.0f} s", recent.complete,
                                      beside, recent.seconds)};
}

} // namespace obscura::emulator
