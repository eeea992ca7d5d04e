// SPDX-License-Identifier: Apache-2.0
#include "emulator/recent_timing.hpp"

#include "emulator/timing_columns.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::emulator {
namespace {

void add(LatencyHistogram& stage, Time from, Time to) {
    if (from.ns != 0 && to.ns != 0) stage.add(to - from);
}

std::optional<std::int64_t> instant(Time t) {
    return t.ns != 0 ? std::optional(t.ns) : std::nullopt;
}

} // namespace

void RecentTiming::note(const FrameTiming& frame) {
    Kept kept{frame, {}, {}};
    for (std::size_t slot = 0; frame.transmit != nullptr && slot < max_transports; ++slot) {
        kept.first_byte[slot] = frame.transmit->first(slot);
        kept.last_byte[slot] = frame.transmit->last(slot);
        add(stages_.first_byte[slot], frame.edge, kept.first_byte[slot]);
    }
    add(stages_.trigger_seen, frame.edge, frame.seen);
    add(stages_.render, frame.render_begin, frame.render_end);
    add(stages_.detector, frame.render_end, frame.detector_end);
    kept.frame.transmit = nullptr;
    kept.frame.row_lateness_us = {};
    const std::lock_guard lock(mutex_);
    if (kept_.size() < most_)
        kept_.push_back(kept);
    else if (most_ > 0)
        kept_[frames_ % most_] = kept;
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

RecentTiming::Rows RecentTiming::rows(std::uint64_t after, std::size_t most) const {
    const std::lock_guard lock(mutex_);
    Rows found;
    found.last = frames_;
    const std::uint64_t newer = frames_ > after ? frames_ - after : 0;
    const std::uint64_t count = std::min<std::uint64_t>({newer, most, kept_.size()});
    for (std::uint64_t number = frames_ - count; number < frames_; ++number) {
        const Kept& kept = kept_[number % most_];
        Row& row = found.rows.emplace_back();
        for (const TimingColumn& column : timing_columns()) {
            const std::int64_t value = column.value(kept.frame, log_.render());
            row.push_back(column.is_instant && value == 0 ? std::nullopt : std::optional(value));
        }
        for (std::size_t slot = 0; slot < log_.transports().size(); ++slot) {
            row.push_back(instant(kept.first_byte[slot]));
            row.push_back(instant(kept.last_byte[slot]));
        }
    }
    return found;
}

} // namespace obscura::emulator
