// SPDX-License-Identifier: Apache-2.0
#include "sensors/readout/modelled_readout.hpp"

#include "models/kinds/timing_program.hpp"
#include "sensors/readout/row_slots.hpp"

#include <algorithm>

namespace obscura::sensors {
namespace {

/// What the pixels of a window have in common, after its trigger.
struct WindowTimes {
    Time first_reset, first_slot, last_release;
    std::int64_t max_exposure_ns = 0;
};

/// Appends the rows of a window that is triggered at `start`. Returns what cannot be.
std::optional<models::BadTiming> append_rows(const ReadoutSettings& s, const models::TimedFrame& frame,
                                             const Region& region, Time start, ReadoutPlan& plan,
                                             FrameWindow& window, WindowTimes& times) {
    const models::TimingProgram& timing = *s.timing;
    // A row is read in its slot; of a model by pixel, the last pixel's read is the end.
    const bool by_pixel = timing.by_pixel();
    const std::int64_t before_read_ns = by_pixel ? 0 : s.sample_instant_ns;
    const std::int64_t after_read_ns = by_pixel ? 0 : row_slot_ns(s, region.width) - s.sample_instant_ns;
    const std::size_t first = plan.rows.size();
    plan.rows.resize(first + static_cast<std::size_t>(region.height));
    if (const auto bad = timing.fill_rows(frame, 0, std::span(plan.rows).subspan(first))) return bad;
    for (std::int32_t r = 0; r < region.height; ++r) {
        RowTime& row = plan.rows[first + static_cast<std::size_t>(r)];
        models::TimedRow all{row.reset, row.read, row.read, row.exposure_ns(), row.exposure_ns()};
        if (by_pixel)
            if (const auto bad = timing.sum_up(frame, r, all)) return bad;
        const Time released = all.last_read + after_read_ns, slot = all.first_read + -before_read_ns;
        if (r == 0) times = {all.first_reset, slot, released, 0};
        times.first_reset = std::min(times.first_reset, all.first_reset);
        times.first_slot = std::min(times.first_slot, slot);
        times.last_release = std::max(times.last_release, released);
        times.max_exposure_ns = std::max(times.max_exposure_ns, all.max_exposure_ns);
        window.exposure_min_ns =
            r == 0 ? all.min_exposure_ns : std::min(window.exposure_min_ns, all.min_exposure_ns);
        window.exposure_max_ns = std::max(window.exposure_max_ns, all.max_exposure_ns);
        plan.release.push_back(start + times.last_release.ns);
        plan.sensor_row.push_back(region.y + r);
        row = {start + row.reset.ns, start + row.read.ns};
    }
    return {};
}

} // namespace

std::string plan_modelled(const ReadoutSettings& s, std::span<const WindowRequest> windows,
                          std::span<const std::uint32_t> flags, Time trigger, ReadoutPlan& plan) {
    const std::int64_t reset_to_sample_ns = s.reset_instant_ns - s.sample_instant_ns;
    if (s.timing->by_pixel()) plan.pixel_timing = s.timing.get();
    Time start = trigger;
    for (std::size_t w = 0; w < windows.size(); ++w) {
        const Region& region = windows[w].region;
        FrameWindow window;
        window.sensor = region;
        window.image_y = plan.height;
        window.exposure_requested_ns = windows[w].exposure_ns;
        window.request = static_cast<std::uint32_t>(w);
        window.flags = flags[w];
        WindowTimes times;
        if (const auto bad = append_rows(s, {region.height, region.width, windows[w].exposure_ns}, region,
                                         start, plan, window, times))
            return s.timing->explain(*bad);
        if (window.exposure_min_ns != windows[w].exposure_ns ||
            window.exposure_max_ns != windows[w].exposure_ns)
            window.flags |= exposure_quantised;
        plan.windows.push_back(window);
        plan.timed_windows.push_back({start, region, windows[w].exposure_ns});
        plan.width = std::max(plan.width, region.width);
        plan.height += region.height;

        const std::int64_t row_ns = row_slot_ns(s, region.width);
        const bool alone = windows.size() == 1;
        const std::int64_t reads_ns =
            times.last_release - times.first_slot + (alone ? s.window_overhead_ns : 0);
        plan.readout_ns += reads_ns;
        if (w == 0) plan.cycle_start = start + times.first_slot.ns;
        if (alone && s.overlapped) {
            // The next frame resets a row after its read in this one, and reads after the last row.
            std::int64_t blanking = std::int64_t{s.blanking_rows} * row_ns;
            const std::int64_t lacking = times.max_exposure_ns + reset_to_sample_ns - reads_ns;
            const std::int64_t step = s.timing->by_pixel() ? 1 : row_ns;
            blanking = std::max(blanking, ceil_div(lacking, step) * step);
            plan.cycle_ns = plan.frame_period_ns = reads_ns + blanking;
        } else {
            const std::int64_t tail_ns = s.timing->by_pixel() ? 0 : s.reset_instant_ns;
            const std::int64_t period_ns =
                times.last_release - times.first_reset + tail_ns + (alone ? s.window_overhead_ns : 0);
            start += period_ns + (alone ? 0 : s.window_overhead_ns);
            plan.frame_period_ns = start - trigger;
            plan.cycle_ns = alone ? reads_ns + std::int64_t{s.blanking_rows} * row_ns : plan.frame_period_ns;
        }
    }
    return {};
}

} // namespace obscura::sensors
