// SPDX-License-Identifier: Apache-2.0
#include "sensors/readout/row_slots.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace obscura::sensors {

std::int64_t row_slot_ns(const ReadoutSettings& settings, std::int32_t width) noexcept {
    const std::int64_t clocks = (std::int64_t{width} + settings.outputs - 1) / settings.outputs;
    return settings.row_overhead_ns +
           std::llround(static_cast<double>(clocks) * 1e9 / settings.pixel_clock_hz);
}

void RowSlots::append(std::int64_t count, std::int64_t row_ns, std::int64_t gap_ns) noexcept {
    assert(run_count_ < runs_.size());
    if (count > 0) runs_[run_count_++] = {cycle_ns_, count, row_ns};
    cycle_ns_ += count * row_ns + gap_ns;
}

std::int64_t RowSlots::latest_at_or_before(std::int64_t t_ns) const noexcept {
    const std::int64_t cycle_start = floor_div(t_ns, cycle_ns_) * cycle_ns_;
    const std::int64_t phase = t_ns - cycle_start;
    // The loop ends, because the first run starts at 0.
    std::size_t run = run_count_ - 1;
    while (runs_[run].start_ns > phase)
        --run;
    const std::int64_t row =
        std::min(runs_[run].count - 1, (phase - runs_[run].start_ns) / runs_[run].row_ns);
    return cycle_start + start(run, row);
}

} // namespace obscura::sensors
