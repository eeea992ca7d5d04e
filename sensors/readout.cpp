// When each row is reset and read. The equations are those of a chip with two row pointers (STAR250 data
// sheet, section on the shift registers): the reset pointer runs ahead of the read pointer by a whole number
// of row slots, so that T_int = n T_row - (o_R - o_S).
#include "sensors/sensor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::sensors {
namespace {

std::int64_t row_slot_ns(const ReadoutSettings& s, std::int32_t width) {
    const std::int64_t clocks = (width + s.outputs - 1) / s.outputs;
    return s.row_overhead_ns + std::llround(static_cast<double>(clocks) * 1e9 / s.pixel_clock_hz);
}

std::string refuse(const ReadoutSettings& s, std::span<const WindowRequest> windows) {
    if (!(s.pixel_clock_hz > 0) || s.outputs < 1 || s.width < 1 || s.height < 1)
        return "readout: pixel clock, outputs, width and height must be above 0";
    if (s.sample_instant_ns < 0 || s.sample_instant_ns >= s.reset_instant_ns ||
        s.reset_instant_ns >= s.row_overhead_ns)
        return fmt::format(
            "readout: the instants of a row slot must obey 0 <= sample ({} ns) < reset ({} ns) "
            "< row overhead ({} ns)",
            s.sample_instant_ns, s.reset_instant_ns, s.row_overhead_ns);
    if (windows.empty() || windows.size() > max_windows)
        return fmt::format("readout: {} windows, 1 to {} are allowed", windows.size(), max_windows);
    for (std::size_t i = 0; i < windows.size(); ++i) {
        const Region& r = windows[i].region;
        if (!r.inside({0, 0, s.width, s.height}))
            return fmt::format("window {}: {}x{} at ({}, {}) does not lie on the {}x{} array", i, r.width,
                               r.height, r.x, r.y, s.width, s.height);
        if (windows[i].exposure_ns <= 0)
            return fmt::format("window {}: exposure of {} ns, must be above 0", i, windows[i].exposure_ns);
    }
    return {};
}

} // namespace

std::string plan_readout(const ReadoutSettings& settings, std::span<const WindowRequest> windows,
                         Time trigger, ReadoutPlan& plan) {
    if (std::string reason = refuse(settings, windows); !reason.empty()) return reason;

    plan.trigger = trigger;
    plan.width = plan.height = 0;
    plan.windows.clear();
    plan.rows.clear();
    plan.sensor_row.clear();
    plan.release.clear();
    plan.readout_ns = 0;
    plan.row_ns = row_slot_ns(settings, windows[0].region.width);

    const std::int64_t reset_to_sample = settings.reset_instant_ns - settings.sample_instant_ns;
    Time start = trigger; // of this window's first reset: windows follow each other without overlap
    for (const WindowRequest& request : windows) {
        const Region& region = request.region;
        const std::int64_t row_ns = row_slot_ns(settings, region.width);
        const std::int64_t rows_ns = region.height * row_ns;
        FrameWindow window{region, plan.height, request.exposure_ns, 0};

        if (settings.shutter == Shutter::rolling) {
            // The latest slot whose reset gives at least the requested time.
            const std::int64_t slots =
                std::max<std::int64_t>(1, (request.exposure_ns + reset_to_sample + row_ns - 1) / row_ns);
            const std::int64_t obtained = slots * row_ns - reset_to_sample;
            if (request.exposure_ns < row_ns - reset_to_sample) window.flags |= exposure_clamped_up;
            if (obtained != request.exposure_ns) window.flags |= exposure_quantised;
            for (std::int32_t r = 0; r < region.height; ++r) {
                const Time reset = start + r * row_ns;
                plan.rows.push_back({reset, reset + obtained});
                plan.release.push_back(reset + obtained + (row_ns - settings.sample_instant_ns));
            }
            plan.frame_period_ns =
                settings.overlapped ? std::max(slots * row_ns, rows_ns) : slots * row_ns + rows_ns;
            start += slots * row_ns + rows_ns;
        } else {
            const Time end = start + request.exposure_ns;
            const Time first_slot = end + settings.frame_overhead_ns;
            for (std::int32_t r = 0; r < region.height; ++r) {
                plan.rows.push_back({start, end});
                plan.release.push_back(first_slot + (r + 1) * row_ns);
            }
            const std::int64_t busy = settings.frame_overhead_ns + rows_ns;
            plan.frame_period_ns =
                settings.overlapped ? std::max(request.exposure_ns, busy) : request.exposure_ns + busy;
            start += request.exposure_ns + busy;
        }
        for (std::int32_t r = 0; r < region.height; ++r)
            plan.sensor_row.push_back(region.y + r);
        plan.windows.push_back(window);
        plan.width = std::max(plan.width, region.width);
        plan.height += region.height;
        plan.readout_ns += rows_ns;
    }
    if (windows.size() > 1) plan.frame_period_ns = start - trigger;
    return {};
}

} // namespace obscura::sensors
