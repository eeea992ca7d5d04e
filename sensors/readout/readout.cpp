// SPDX-License-Identifier: Apache-2.0
// Readout planning: reset and read time of each row. Two row pointers, as on the STAR250 (data sheet, section
// on the shift registers): the reset pointer runs ahead of the read pointer, and both act at fixed instants
// of a row slot.
#include "sensors/readout/modelled_readout.hpp"
#include "sensors/readout/row_slots.hpp"
#include "sensors/sensor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace obscura::sensors {
namespace {

constexpr std::int64_t computed_exposure_max_ns = 1'000'000 * ns_per_s;
constexpr std::int64_t max_row_ns = 10 * ns_per_s;

std::string refuse(const ReadoutSettings& s) {
    if (s.width < 1 || s.height < 1 || s.width > 65536 || s.height > 65536)
        return fmt::format("readout.width x height: {} x {}, 1 to 65536 are allowed", s.width, s.height);
    if (!(s.pixel_clock_hz >= 1e3 && s.pixel_clock_hz <= 1e12))
        return fmt::format("readout.pixel_clock_hz: {}, 1e3 to 1e12 are allowed", s.pixel_clock_hz);
    if (s.outputs < 1 || s.outputs > 65536)
        return fmt::format("readout.outputs: {}, 1 to 65536 are allowed", s.outputs);
    if (s.sample_instant_ns < 0 || s.sample_instant_ns >= s.reset_instant_ns ||
        s.reset_instant_ns >= s.row_overhead_ns || s.row_overhead_ns > max_row_ns)
        return fmt::format(
            "readout.sample_instant_ns ({}), reset_instant_ns ({}) and row_overhead_ns ({}): 0 <= sample < reset < overhead <= 10 s is allowed",
            s.sample_instant_ns, s.reset_instant_ns, s.row_overhead_ns);
    if (s.frame_overhead_ns < 0 || s.window_overhead_ns < 0 || s.frame_overhead_ns > max_row_ns ||
        s.window_overhead_ns > max_row_ns)
        return fmt::format(
            "readout.frame_overhead_ns ({}) and window_overhead_ns ({}): 0 to 10 s are allowed",
            s.frame_overhead_ns, s.window_overhead_ns);
    if (s.blanking_rows < 0 || s.blanking_rows > 1'000'000)
        return fmt::format("readout.blanking_rows: {}, 0 to 1000000 are allowed", s.blanking_rows);
    if (s.exposure_step_ns < 1 || s.exposure_step_ns > ns_per_s)
        return fmt::format("readout.exposure_step_ns: {}, 1 ns to 1 s are allowed", s.exposure_step_ns);
    if (s.shutter == Shutter::push_broom && !(s.line_rate_hz >= 1e-3 && s.line_rate_hz <= 1e7))
        return fmt::format("readout.line_rate_hz: {}, 1e-3 to 1e7 are allowed", s.line_rate_hz);
    if (s.shutter == Shutter::model && s.timing == nullptr)
        return "readout.shutter: times of your own have a table: write shutter = { model = \"FILE.tim\" }";
    if (s.window_step < 1 || s.windows_max < 1 || s.windows_max > static_cast<std::int32_t>(max_windows))
        return fmt::format(
            "readout.window_step ({}) and windows_max ({}): at least 1, and at most {} windows, are allowed",
            s.window_step, s.windows_max, max_windows);
    return {};
}

/// Adjusts `request` to the window that the chip reads. Returns the reason if the chip refuses it, else an
/// empty string.
std::string normalise(const ReadoutSettings& s, std::size_t index, WindowRequest& request,
                      std::uint32_t& flags) {
    Region& r = request.region;
    const bool lines = s.shutter == Shutter::push_broom; // the height counts lines, not rows of the array
    const Region array{0, 0, s.width, lines ? std::max(s.height, r.height) : s.height};
    if (r.width <= 0 || r.height <= 0)
        return fmt::format("window {}: Width x Height: {}x{}, at least 1x1 is allowed", index, r.width,
                           r.height);
    if (lines && (r.height > 65536 || r.y < 0 || r.y >= s.height))
        return fmt::format(
            "window {}: OffsetY ({}) must be a row of the array and Height ({}) at most 65536 lines", index,
            r.y, r.height);
    Region placed = r;
    if (lines) placed.y = 0;
    const bool aligned = r.x % s.window_step == 0 && r.y % s.window_step == 0;
    if (!placed.inside(array) || !aligned) {
        if (s.strict && !aligned)
            return fmt::format("window {}: OffsetX, OffsetY: ({}, {}), multiples of {} are allowed", index,
                               r.x, r.y, s.window_step);
        if (s.strict)
            return fmt::format("window {}: {}x{} at ({}, {}) does not lie on the {}x{} array", index, r.width,
                               r.height, r.x, r.y, s.width, s.height);
        const auto crop = [&](std::int32_t& from, std::int32_t& count, std::int32_t size) {
            const std::int64_t end = std::min<std::int64_t>(std::int64_t{from} + count, size);
            from = std::max(from, 0) / s.window_step * s.window_step;
            count = static_cast<std::int32_t>(std::max<std::int64_t>(0, end - from));
        };
        crop(r.x, r.width, s.width);
        if (!lines) crop(r.y, r.height, s.height);
        if (r.width == 0 || r.height == 0)
            return fmt::format("window {}: nothing of it lies on the {}x{} array", index, s.width, s.height);
        flags |= window_cropped;
    }
    const std::int64_t longest_ns = s.exposure_max_ns > 0 ? s.exposure_max_ns : computed_exposure_max_ns;
    if (request.exposure_ns <= 0 || request.exposure_ns > longest_ns)
        return fmt::format("window {}: ExposureTime: {} ns, above 0 and at most {} ns is allowed{}", index,
                           request.exposure_ns, longest_ns,
                           s.exposure_max_ns > 0 ? " (the chip's counter)" : "");
    const bool several = request.sampling == Sampling::cds || request.sampling == Sampling::ramp;
    const std::int32_t least = several ? 2 : 1;
    const std::int32_t most = request.sampling == Sampling::destructive ? 1 : 64;
    if (request.reads < least || request.reads > most)
        return fmt::format("window {}: reads: {}, {} to {} are allowed", index, request.reads, least, most);
    if (s.shutter != Shutter::rolling && request.sampling != Sampling::destructive)
        return fmt::format("window {}: sampling: non-destructive reads need a rolling shutter", index);
    return {};
}

constexpr bool destructive(const WindowRequest& w) {
    return w.sampling == Sampling::destructive;
}

/// Periodic reset event at `first_ns` + k `period_ns`, for all integers k or for 0 <= k < `count`.
struct ResetTrain {
    std::int64_t first_ns, period_ns, count; // count 0: unbounded in both directions

    /// Latest reset of the train before `t_ns`.
    [[nodiscard]] std::optional<std::int64_t> latest_before(std::int64_t t_ns) const {
        std::int64_t k = floor_div(t_ns - 1 - first_ns, period_ns);
        if (count > 0) {
            if (k < 0) return std::nullopt;
            k = std::min(k, count - 1);
        }
        return first_ns + k * period_ns;
    }
};

/// Cycles of row slots of one frame; the cycle of the first read starts at 0.
class CyclePlan {
public:
    CyclePlan(const ReadoutSettings& s, std::span<const WindowRequest> windows, bool steady)
        : settings_(s), windows_(windows), steady_(steady) {
        for (const WindowRequest& w : windows)
            cycles_ = std::max<std::int64_t>(cycles_, w.reads);
        // Idle slots have the length of the last window's slots.
        const std::int64_t idle_ns = row_slot_ns(s, windows.back().region.width);
        std::int64_t reads_ns = 0;
        for (const WindowRequest& w : windows)
            reads_ns += w.region.height * row_slot_ns(s, w.region.width) + s.window_overhead_ns;
        std::int64_t blanking = s.blanking_rows;
        if (s.stretch_blanking)
            for (const WindowRequest& w : windows)
                blanking = std::max(blanking, ceil_div(min_cycle_ns(w) - reads_ns, idle_ns));
        for (const WindowRequest& w : windows)
            slots_.append(w.region.height, row_slot_ns(s, w.region.width), s.window_overhead_ns);
        slots_.append(blanking, idle_ns, 0);
        reads_ns_ = reads_ns;
    }

    [[nodiscard]] const RowSlots& slots() const { return slots_; }
    [[nodiscard]] std::int64_t cycles() const { return cycles_; }
    [[nodiscard]] std::int64_t reads_ns() const { return reads_ns_; }
    [[nodiscard]] std::int64_t first_cycle(const WindowRequest& w) const { return cycles_ - w.reads; }

    [[nodiscard]] std::int64_t sample_ns(std::size_t w, std::int64_t row, std::int64_t cycle) const {
        return cycle * slots_.cycle_ns() + slots_.start(w, row) + settings_.sample_instant_ns;
    }

    /// Longest integration time of window w.
    [[nodiscard]] std::int64_t max_exposure_ns(const WindowRequest& w) const {
        if (w.reads > 1) return (w.reads - 1) * slots_.cycle_ns();
        if (!repeats(w)) return std::numeric_limits<std::int64_t>::max();
        return (destructive(w) ? 1 : cycles_) * slots_.cycle_ns() - reset_to_sample_ns();
    }

    /// Latest reset event on array row `row` before `t_ns`; sets `by` to the window that issued it.
    [[nodiscard]] std::int64_t latest_reset(std::int32_t row, std::int64_t t_ns, std::size_t& by) const {
        std::int64_t latest = std::numeric_limits<std::int64_t>::min();
        for (std::size_t v = 0; v < windows_.size(); ++v) {
            const Region& region = windows_[v].region;
            if (row < region.y || row >= region.y + region.height) continue;
            const auto consider = [&](const ResetTrain& train) {
                const std::optional<std::int64_t> t = train.latest_before(t_ns);
                if (t && *t > latest) latest = *t, by = v;
            };
            if (const auto train = shutter_resets(v, row - region.y)) consider(*train);
            if (destructive(windows_[v]))
                consider({sample_ns(v, row - region.y, 0) + reset_to_sample_ns(), slots_.cycle_ns(),
                          steady_ ? 0 : cycles_});
        }
        return latest;
    }

private:
    [[nodiscard]] std::int64_t reset_to_sample_ns() const {
        return settings_.reset_instant_ns - settings_.sample_instant_ns;
    }

    /// Whether an earlier read of the same window bounds its integration.
    [[nodiscard]] bool repeats(const WindowRequest& w) const {
        return steady_ || (destructive(w) && cycles_ > 1);
    }

    [[nodiscard]] std::int64_t min_cycle_ns(const WindowRequest& w) const {
        if (w.reads > 1) return ceil_div(w.exposure_ns, w.reads - 1);
        if (!repeats(w)) return 0;
        return ceil_div(w.exposure_ns + reset_to_sample_ns(), destructive(w) ? 1 : cycles_);
    }

    /// Resets that the reset pointer issues for a row of window v.
    [[nodiscard]] std::optional<ResetTrain> shutter_resets(std::size_t v, std::int64_t row) const {
        const WindowRequest& w = windows_[v];
        const std::int64_t cycle = slots_.cycle_ns();
        const std::int64_t read = sample_ns(v, row, first_cycle(w));
        // Several reads start from a reset one slot before the first of them.
        const std::int64_t wanted = w.reads > 1 ? 1 : std::min(w.exposure_ns, max_exposure_ns(w));
        const auto before = [&](std::int64_t t) {
            return slots_.latest_at_or_before(t - wanted - settings_.reset_instant_ns) +
                   settings_.reset_instant_ns;
        };
        if (!destructive(w)) return ResetTrain{before(read), cycles_ * cycle, steady_ ? 0 : 1};
        // An integration of a whole cycle needs no separate reset: the double sampling of the previous read
        // started it.
        const bool needed_every_cycle = wanted < cycle - reset_to_sample_ns();
        const std::int64_t first = before(sample_ns(v, row, 0));
        if (needed_every_cycle) return ResetTrain{first, cycle, steady_ ? 0 : cycles_};
        if (steady_) return std::nullopt;
        return ResetTrain{first, cycle, 1};
    }

    const ReadoutSettings& settings_;
    std::span<const WindowRequest> windows_;
    bool steady_;
    RowSlots slots_;
    std::int64_t cycles_ = 1;
    std::int64_t reads_ns_ = 0;
};

/// Appends window w, as sampled in `cycle`, to the plan; times are relative to the cycle of the first read.
void append_window(const ReadoutSettings& s, std::span<const WindowRequest> windows, std::size_t w,
                   std::int64_t cycle, const CyclePlan& cycles, std::uint32_t flags, ReadoutPlan& plan) {
    const WindowRequest& request = windows[w];
    const Region& region = request.region;
    const std::int64_t reset_to_sample = s.reset_instant_ns - s.sample_instant_ns;
    const std::int64_t first_cycle = cycles.first_cycle(request);
    const bool difference = request.sampling == Sampling::cds || request.sampling == Sampling::ramp;
    // Requested exposure of this read.
    const std::int64_t wanted = request.exposure_ns;
    const bool exact_read = request.reads == 1 || difference;

    FrameWindow window;
    window.sensor = region;
    window.image_y = plan.height;
    window.exposure_requested_ns = request.exposure_ns;
    window.flags = flags;
    window.request = static_cast<std::uint32_t>(w);
    window.sampling = request.sampling;
    window.reads = request.reads;
    window.read_index = static_cast<std::int32_t>(cycle - first_cycle);
    window.read_spacing_ns = request.reads > 1 ? cycles.slots().cycle_ns() : 0;
    if (wanted > cycles.max_exposure_ns(request)) window.flags |= exposure_clamped_down;
    if (request.reads == 1 && wanted < row_slot_ns(s, region.width) - reset_to_sample)
        window.flags |= exposure_clamped_up;

    window.exposure_min_ns = std::numeric_limits<std::int64_t>::max();
    for (std::int32_t r = 0; r < region.height; ++r) {
        const std::int64_t read = cycles.sample_ns(w, r, cycle);
        std::size_t by = w;
        std::int64_t reset = cycles.latest_reset(region.y + r, read, by);
        if (difference) {
            const std::int64_t first_read = cycles.sample_ns(w, r, first_cycle);
            if (reset > first_read) {
                if (by != w) window.flags |= row_shared;
            } else {
                reset = first_read;
            }
        } else if (by != w) {
            window.flags |= row_shared;
        }
        const std::int64_t obtained = read - reset;
        if (exact_read && by == w && obtained != wanted) window.flags |= exposure_quantised;
        window.exposure_min_ns = std::min(window.exposure_min_ns, obtained);
        window.exposure_max_ns = std::max(window.exposure_max_ns, obtained);
        plan.rows.push_back({Time{reset}, Time{read}});
        plan.release.push_back(Time{read - s.sample_instant_ns + cycles.slots().row_ns(w)});
        plan.sensor_row.push_back(region.y + r);
    }
    plan.windows.push_back(window);
    plan.width = std::max(plan.width, region.width);
    plan.height += region.height;
}

/// Plans a frame of the on-chip sequencer: all windows in every cycle. The first integration starts at
/// `start`.
void plan_cycles(const ReadoutSettings& s, std::span<const WindowRequest> windows,
                 std::span<const std::uint32_t> flags, bool steady, Time start, ReadoutPlan& plan) {
    const CyclePlan cycles(s, windows, steady);
    const std::size_t first_row = plan.rows.size();
    for (std::int64_t cycle = 0; cycle < cycles.cycles(); ++cycle)
        for (std::size_t w = 0; w < windows.size(); ++w) {
            const bool every_read = windows[w].sampling == Sampling::non_destructive;
            if (cycle == cycles.cycles() - 1 || (every_read && cycle >= cycles.first_cycle(windows[w])))
                append_window(s, windows, w, cycle, cycles, flags[w], plan);
        }
    std::int64_t earliest = std::numeric_limits<std::int64_t>::max();
    for (std::size_t i = first_row; i < plan.rows.size(); ++i)
        earliest = std::min(earliest, plan.rows[i].reset.ns);
    const std::int64_t shift = start.ns - earliest;
    for (std::size_t i = first_row; i < plan.rows.size(); ++i) {
        plan.rows[i].reset += shift;
        plan.rows[i].read += shift;
        plan.release[i] += shift;
    }
    plan.cycle_start = Time{shift};
    plan.cycle_ns = cycles.slots().cycle_ns();
    plan.readout_ns += cycles.reads_ns();
    // The slot of the first reset must lie after the last slot of the previous frame.
    const std::int64_t end_ns = (cycles.cycles() - 1) * plan.cycle_ns + cycles.reads_ns();
    plan.frame_period_ns = steady ? cycles.cycles() * plan.cycle_ns : end_ns - earliest + s.reset_instant_ns;
}

void plan_sequential(const ReadoutSettings& s, std::span<const WindowRequest> windows,
                     std::span<const std::uint32_t> flags, Time trigger, ReadoutPlan& plan) {
    // Each window has its own line loop, without gaps.
    ReadoutSettings alone = s;
    alone.window_overhead_ns = 0;
    alone.blanking_rows = 0;
    Time start = trigger;
    for (std::size_t w = 0; w < windows.size(); ++w) {
        const std::size_t first = plan.windows.size();
        plan_cycles(alone, windows.subspan(w, 1), flags.subspan(w, 1), false, start, plan);
        for (std::size_t i = first; i < plan.windows.size(); ++i)
            plan.windows[i].request = static_cast<std::uint32_t>(w);
        start += plan.frame_period_ns + s.window_overhead_ns;
    }
    plan.frame_period_ns = start - trigger;
    plan.cycle_ns = plan.frame_period_ns;
}

/// Plans a frame whose rows integrate together and are read one after the other (`global`), or of one row
/// that is read at the line rate (`push_broom`).
void plan_common_exposure(const ReadoutSettings& s, std::span<const WindowRequest> windows,
                          std::span<const std::uint32_t> flags, Time trigger, ReadoutPlan& plan) {
    const bool lines = s.shutter == Shutter::push_broom;
    std::int64_t line_ns = 0;
    if (lines) {
        line_ns = std::llround(1e9 / s.line_rate_hz);
        for (const WindowRequest& w : windows)
            line_ns = std::max(line_ns, row_slot_ns(s, w.region.width));
    }
    // All windows have the exposure of the first one.
    const std::int64_t step = s.exposure_step_ns;
    const std::int64_t longest =
        lines ? line_ns - (s.reset_instant_ns - s.sample_instant_ns) : computed_exposure_max_ns + step;
    std::int64_t exposure = ceil_div(windows[0].exposure_ns, step) * step;
    if (exposure > longest) exposure = std::max(longest / step, std::int64_t{1}) * step;

    const Time end = trigger + exposure;
    std::int64_t readout = 0;
    for (std::size_t w = 0; w < windows.size(); ++w) {
        const Region& region = windows[w].region;
        const std::int64_t row_ns = lines ? line_ns : row_slot_ns(s, region.width);
        FrameWindow window;
        window.sensor = region;
        window.image_y = plan.height;
        window.exposure_requested_ns = windows[w].exposure_ns;
        window.exposure_min_ns = window.exposure_max_ns = exposure;
        window.request = static_cast<std::uint32_t>(w);
        window.flags = flags[w];
        if (exposure - windows[w].exposure_ns >= step) window.flags |= exposure_clamped_up;
        if (exposure < windows[w].exposure_ns) window.flags |= exposure_clamped_down;
        if (exposure != windows[w].exposure_ns) window.flags |= exposure_quantised;
        for (std::int32_t r = 0; r < region.height; ++r) {
            if (lines) {
                const std::int64_t at = readout + r * line_ns;
                plan.rows.push_back({trigger + at, end + at});
                plan.release.push_back(end + at + (row_slot_ns(s, region.width) - s.sample_instant_ns));
                plan.sensor_row.push_back(region.y);
            } else {
                plan.rows.push_back({trigger, end});
                plan.release.push_back(end + s.frame_overhead_ns + readout + (r + 1) * row_ns);
                plan.sensor_row.push_back(region.y + r);
            }
        }
        readout += region.height * row_ns + s.window_overhead_ns;
        plan.windows.push_back(window);
        plan.width = std::max(plan.width, region.width);
        plan.height += region.height;
    }
    plan.readout_ns = readout;
    plan.cycle_ns = readout;
    plan.cycle_start = lines ? end : end + s.frame_overhead_ns;
    if (lines)
        plan.frame_period_ns = readout;
    else if (s.overlapped)
        plan.frame_period_ns = s.frame_overhead_ns + std::max(exposure, readout);
    else
        plan.frame_period_ns = exposure + s.frame_overhead_ns + readout;
}

} // namespace

std::span<const ReadoutFlagName> readout_flags() {
    static constexpr std::array table{
        ReadoutFlagName{exposure_clamped_up, "T_CLAMPED_UP",
                        "the exposure asked for is shorter than the settings allow"},
        ReadoutFlagName{exposure_clamped_down, "T_CLAMPED_DOWN",
                        "the exposure asked for is longer than the settings allow"},
        ReadoutFlagName{row_shared, "ROW_SHARED",
                        "another window's reads or resets cut the integration short"},
        ReadoutFlagName{exposure_quantised, "T_QUANTISED",
                        "the exposure differs from that asked for by the grid of row slots"},
        ReadoutFlagName{window_cropped, "WINDOW_CROPPED", "strict = false: the window was cut or aligned"},
        ReadoutFlagName{trigger_deferred, "TRIGGER_DEFERRED",
                        "the trigger landed in a readout and waited for its row grid"},
        ReadoutFlagName{settings_changed, "SETTINGS_CHANGED",
                        "first frame after a change: rows had been started under the old settings"},
        ReadoutFlagName{charge_saturated, "SATURATED",
                        "a pixel reached full well; non-destructive reads that follow add nothing to it"}};
    return table;
}

std::string flag_names(std::uint32_t flags) {
    std::string text;
    for (const ReadoutFlagName& flag : readout_flags())
        if ((flags & flag.bit) != 0) text += fmt::format("{}{}", text.empty() ? "" : "|", flag.name);
    return text;
}

std::string plan_readout(const ReadoutSettings& settings, std::span<const WindowRequest> requests,
                         Time trigger, ReadoutPlan& plan) {
    if (std::string reason = refuse(settings); !reason.empty()) return reason;
    if (requests.empty() || requests.size() > static_cast<std::size_t>(settings.windows_max))
        return fmt::format("windows: {} requested, 1 to {} are allowed", requests.size(),
                           settings.windows_max);
    std::array<WindowRequest, max_windows> windows;
    std::array<std::uint32_t, max_windows> flags{};
    std::size_t delivered = 0;
    for (std::size_t i = 0; i < requests.size(); ++i) {
        windows[i] = requests[i];
        if (std::string reason = normalise(settings, i, windows[i], flags[i]); !reason.empty()) return reason;
        delivered += windows[i].sampling == Sampling::non_destructive
                         ? static_cast<std::size_t>(windows[i].reads)
                         : std::size_t{1};
    }
    if (delivered > max_windows)
        return fmt::format("windows: {} with every non-destructive read counted, at most {} are allowed",
                           delivered, max_windows);
    const std::span<const WindowRequest> accepted(windows.data(), requests.size());

    plan.trigger = trigger;
    plan.width = plan.height = 0;
    plan.windows.clear();
    plan.rows.clear();
    plan.sensor_row.clear();
    plan.release.clear();
    plan.pixel_timing = nullptr;
    plan.timed_windows.clear();
    plan.readout_ns = 0;
    plan.row_ns = row_slot_ns(settings, windows[0].region.width);

    if (settings.shutter == Shutter::model) return plan_modelled(settings, accepted, flags, trigger, plan);
    if (settings.shutter != Shutter::rolling)
        plan_common_exposure(settings, accepted, flags, trigger, plan);
    else if (settings.window_mode == WindowMode::interleaved || accepted.size() == 1)
        plan_cycles(settings, accepted, flags, settings.overlapped, trigger, plan);
    else
        plan_sequential(settings, accepted, flags, trigger, plan);
    return {};
}

} // namespace obscura::sensors
