// SPDX-License-Identifier: Apache-2.0
#include "emulator/record/recent_timing.hpp"

#include "emulator/record/timing_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::emulator {
namespace {

void add(LatencyHistogram& stage, Time from, Time to) {
    if (from.ns != 0 && to.ns != 0) stage.add(to - from);
}

std::optional<std::int64_t> instant(Time t) {
    return t.ns != 0 ? std::optional(t.ns) : std::nullopt;
}

} // namespace

RecentTiming::Kept::Kept(const FrameTiming& timing)
    : frame(timing), row_lateness_us(timing.row_lateness_us.begin(), timing.row_lateness_us.end()) {
    for (std::size_t slot = 0; timing.transmit != nullptr && slot < max_transports; ++slot) {
        first_byte[slot] = timing.transmit->first(slot);
        last_byte[slot] = timing.transmit->last(slot);
    }
    frame.transmit = nullptr;
    frame.row_lateness_us = {};
}

void RecentTiming::note(const FrameTiming& frame) {
    Kept kept(frame);
    for (std::size_t slot = 0; slot < max_transports; ++slot)
        add(stages_.first_byte[slot], frame.edge, kept.first_byte[slot]);
    add(stages_.trigger_seen, frame.edge, frame.seen);
    add(stages_.render, frame.render_begin, frame.render_end);
    add(stages_.detector, frame.render_end, frame.detector_end);
    const std::lock_guard lock(mutex_);
    if (kept_.size() < most_)
        kept_.push_back(std::move(kept));
    else if (most_ > 0)
        kept_[frames_ % most_] = std::move(kept);
    ++frames_;
}

std::vector<std::string> RecentTiming::columns() const {
    std::vector<std::string> names;
    for (const TimingColumn& column : timing_columns())
        names.emplace_back(column.name);
    for (const std::string& kind : log_.transports()) {
        names.push_back(fmt::format("{}_first_byte_ns", kind));
        names.push_back(fmt::format("{}_last_byte_ns", kind));
    }
    return names;
}

void RecentTiming::add_row(Rows& found, const Kept& kept) const {
    Row& row = found.rows.emplace_back();
    const FrameRecord record = record_of(kept.frame, log_.render());
    for (const TimingColumn& column : timing_columns()) {
        const std::int64_t value = column.value(record);
        row.push_back(column.is_instant && value == 0 ? std::nullopt : std::optional(value));
    }
    for (std::size_t slot = 0; slot < log_.transports().size(); ++slot) {
        row.push_back(instant(kept.first_byte[slot]));
        row.push_back(instant(kept.last_byte[slot]));
    }
    found.frames.push_back({kept.frame.frame_id, kept.frame.edge, kept.frame.ended});
}

RecentTiming::Rows RecentTiming::rows(std::uint64_t after, std::size_t most, bool early) const {
    std::vector<Kept> queued;
    std::unique_lock<std::mutex> held;
    if (early && most_ > 0) {
        held = log_.hold();
        log_.queued([&queued](const FrameTiming& frame) { queued.emplace_back(frame); });
    }
    const std::lock_guard lock(mutex_);
    Rows found;
    found.last = frames_ + queued.size();
    const std::uint64_t newer = found.last > after ? found.last - after : 0;
    const std::uint64_t count = std::min<std::uint64_t>({newer, most, kept_.size() + queued.size()});
    for (std::uint64_t number = found.last - count; number < found.last; ++number)
        add_row(found, number < frames_ ? kept_[number % most_] : queued[number - frames_]);
    return found;
}

std::optional<RecentTiming::RowLateness> RecentTiming::row_lateness(std::uint64_t frame_id) const {
    const std::lock_guard lock(mutex_);
    for (std::uint64_t age = 1; age <= kept_.size(); ++age) {
        const Kept& kept = kept_[(frames_ - age) % most_];
        if (frame_id == 0 || kept.frame.frame_id == frame_id)
            return RowLateness{kept.frame.frame_id, kept.frame.facts.acquisition, kept.row_lateness_us};
    }
    return std::nullopt;
}

} // namespace obscura::emulator
