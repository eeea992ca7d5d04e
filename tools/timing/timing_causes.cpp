// SPDX-License-Identifier: Apache-2.0
#include "tools/timing/timing_causes.hpp"

#include "tools/timing/timing_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

namespace obscura::tools {
namespace {

/// Part of rendering below which a cure is not worth a line.
constexpr double min_share = 0.05;

double to_ms(std::int64_t ns) {
    return static_cast<double>(ns) * 1e-6;
}

bool finished(const TimingRow& row) {
    return row.last != 0 && row.detector_end != 0;
}

/// Mean over the finished frames, in ms or plain numbers.
class Means {
public:
    explicit Means(std::span<const TimingRow> frames) {
        for (const TimingRow& row : frames)
            if (finished(row)) rows_.push_back(&row);
    }
    [[nodiscard]] bool empty() const { return rows_.empty(); }
    [[nodiscard]] const TimingRow& front() const { return *rows_.front(); }
    template<typename Value>
    [[nodiscard]] double of(const Value& value) const {
        double sum = 0;
        for (const TimingRow* row : rows_)
            sum += static_cast<double>(std::invoke(value, *row));
        return rows_.empty() ? 0 : sum / static_cast<double>(rows_.size());
    }
    [[nodiscard]] double ms(std::int64_t TimingRow::*value) const { return of(value) * 1e-6; }
    [[nodiscard]] double ms(std::int64_t TimingRow::*from, std::int64_t TimingRow::*to) const {
        return of([=](const TimingRow& row) { return row.*to - row.*from; }) * 1e-6;
    }

private:
    std::vector<const TimingRow*> rows_;
};

/// Rendering of a mean frame in ms of elapsed time, by its parts.
struct Rendering {
    double all = 0, setup = 0, sampling = 0, grid = 0, wings = 0, points = 0, rest = 0;
    double others = 0;        ///< lost to other programs
    double detector_wait = 0; ///< for a free buffer
    double busy_share = 0;    ///< of the render threads
    double cpu_share = 1;     ///< CPU time over elapsed time of the threads at work
    double instants = 1;      ///< of a row
    bool known = false;       ///< the file has the parts

    explicit Rendering(const Means& means) : all(means.ms(&TimingRow::render_begin, &TimingRow::render_end)) {
        const double threads_ms = means.ms(&TimingRow::setup) + means.ms(&TimingRow::sampling) +
                                  means.ms(&TimingRow::grid) + means.ms(&TimingRow::wings) +
                                  means.ms(&TimingRow::points) + means.ms(&TimingRow::rest);
        detector_wait = std::min(means.ms(&TimingRow::detector_wait), all);
        const double measured = means.of(&TimingRow::measured);
        if (measured > 0) cpu_share = std::min(1.0, means.of(&TimingRow::measured_cpu) / measured);
        if (!(threads_ms > 0)) return;
        known = true;
        const double elapsed = all - detector_wait;
        // The threads work side by side: their parts share the elapsed time.
        const double own = elapsed / threads_ms * cpu_share;
        setup = own * means.ms(&TimingRow::setup);
        sampling = own * means.ms(&TimingRow::sampling);
        grid = own * means.ms(&TimingRow::grid);
        wings = own * means.ms(&TimingRow::wings);
        points = own * means.ms(&TimingRow::points);
        rest = own * means.ms(&TimingRow::rest);
        others = elapsed * (1 - cpu_share);
        const double threads = means.of(&TimingRow::render_threads);
        if (threads > 0 && elapsed > 0) busy_share = std::min(1.0, threads_ms / (threads * elapsed));
        const double rows = means.of(&TimingRow::rendered_rows);
        if (rows > 0) instants = std::max(1.0, means.of(&TimingRow::row_instants) / rows);
    }
};

std::string ms_text(double ms) {
    return fmt::format("{:.{}f}", ms, std::abs(ms) < 10 ? 1 : 0);
}

/// Time of a late frame by stages, in ns.
std::vector<std::pair<std::int64_t, const char*>> stages(const TimingRow& row) {
    return {
        {row.seen - row.edge, "the edge was seen late"},
        {row.pose - row.seen, "wait for earlier frames"},
        {row.render_begin - row.pose, "wait for rendering"},
        {row.render_end - row.render_begin, "rendering"},
        {row.detector_end - row.render_end, "the detector"},
        {std::max<std::int64_t>(0, row.last - std::max(row.detector_end, row.last_due)), "the release"},
    };
}

void add_rendering_cures(const Means& means, const Rendering& r, double late_ms, std::vector<Cure>& all) {
    const TimingRow& one = means.front();
    const auto add = [&](std::string cause, double ms, double saved_ms, std::string advice) {
        if (saved_ms >= min_share * r.all)
            all.push_back({std::move(cause), ms, r.all, r.all - saved_ms, std::move(advice)});
    };
    const double over_instants = (r.setup + r.points) * (1 - 1 / r.instants);
    add(fmt::format("motion instants ({:.0f} a row)", r.instants), over_instants, over_instants,
        "render.max_instants = 1");
    const double samples_ms = r.sampling + r.grid;
    if (one.target_error > 0) {
        // The error of adaptive samples falls with their number to the power of -0.75.
        const double error = one.target_error;
        add(fmt::format("samples (render.target_error = {:g})", error), samples_ms,
            samples_ms * (1 - std::pow(2, -4.0 / 3)),
            fmt::format("render.target_error = {:g}, at best,", 2 * error));
    } else if (one.samples_per_pixel > 1) {
        const auto now = static_cast<double>(one.samples_per_pixel);
        // As many as the frame has time for, or half.
        const double wanted =
            late_ms > 0 && late_ms < samples_ms ? now * (1 - late_ms / samples_ms) : now / 2;
        const double fewer = std::clamp(std::floor(wanted), 1.0, now - 1);
        add(fmt::format("samples ({:.0f} a pixel)", now), samples_ms, samples_ms * (1 - fewer / now),
            fmt::format("render.samples_per_pixel = {:.0f}", fewer));
    }
    add("wings of the point spread function", r.wings, r.wings, "camera.psf_wings_px = 0 in the scene");
    add("other programs", r.others, r.others,
        "an idle machine, cores of its own (threads.render_cores) or threads.render_class = \"rr\"");
    add("waiting for the detector", r.detector_wait, r.detector_wait,
        fmt::format("a detector that takes less than its {} ms of one thread",
                    ms_text(means.ms(&TimingRow::detector))));
    if (const double share = static_cast<double>(one.render_threads) / static_cast<double>(one.render_cores);
        one.render_threads > 0 && one.render_threads < one.render_cores) {
        const double elapsed = r.all - r.detector_wait;
        add(fmt::format("{} render threads for {} cores", one.render_threads, one.render_cores), elapsed,
            elapsed * (1 - share), fmt::format("render.threads = {}", one.render_cores));
    }
}

/// Period of the triggers, missed ones included, in ms; nullopt without two frames.
std::optional<double> trigger_period_ms(const TimingFile& acquisition) {
    std::vector<double> periods;
    for (std::size_t i = 1; i < acquisition.rows.size(); ++i) {
        const TimingRow &before = acquisition.rows[i - 1], &row = acquisition.rows[i];
        if (row.trigger_id > before.trigger_id && row.edge > before.edge)
            periods.push_back(to_ms(row.edge - before.edge) /
                              static_cast<double>(row.trigger_id - before.trigger_id));
    }
    if (periods.empty()) return std::nullopt;
    const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
    std::nth_element(periods.begin(), middle, periods.end());
    return *middle;
}

/// What sending over transport `t` adds after the rows; empty if it keeps up with them.
std::string sending(const TimingFile& acquisition, std::size_t t) {
    double behind = 0, spread = 0, pace = 0, rows_ms = 0;
    double frames = 0;
    for (const TimingRow& row : acquisition.rows) {
        if (!finished(row) || row.last_byte[t] == 0) continue;
        ++frames;
        behind += to_ms(row.last_byte[t] - row.last);
        spread += to_ms(row.last_byte[t] - row.first_byte[t]);
        pace += to_ms(row.pace[t]);
        rows_ms += to_ms(row.last - row.first);
    }
    if (frames == 0 || behind / frames < 1) return {};
    behind /= frames, spread /= frames, pace /= frames, rows_ms /= frames;
    const std::string& kind = acquisition.transports[t];
    std::string text =
        fmt::format("sending ({}): the last byte leaves {} ms after the last row", kind, ms_text(behind));
    if (pace < 0.8 * spread) return text + "; it is the receiver or the machine that holds it up, no setting";
    text += fmt::format("; at the pace that is set a frame takes {} ms, its rows {} ms", ms_text(pace),
                        ms_text(rows_ms));
    if (rows_ms > 0.5)
        text += fmt::format(
            ": {:.1f} times the pace (gige.throughput_limit_mbit_s, DeviceLinkThroughputLimit, GevSCPD) would end with the rows",
            pace / rows_ms);
    else
        text += ": gige.throughput_limit_mbit_s, DeviceLinkThroughputLimit or GevSCPD set it";
    return text;
}

} // namespace

std::int64_t lateness(const TimingRow& row) noexcept {
    if (row.late_rows == 0 && row.stalled_rows == 0) return 0;
    return row.last != 0 ? std::max<std::int64_t>(0, row.last - row.last_due) : row.worst_row;
}

std::string reason(const TimingRow& row) {
    if (row.late_rows == 0 && row.stalled_rows == 0) return "in time";
    if (row.late_rows == 0)
        return fmt::format("{} rows were ready in time; the system did not run the thread that releases them",
                           row.stalled_rows);
    if (!finished(row)) return fmt::format("given up with {} of {} rows late", row.late_rows, row.rows);
    const auto all = stages(row);
    const auto most = *std::max_element(all.begin(), all.end());
    std::string text = fmt::format("{}, {:.3f} ms", most.second, to_ms(most.first));
    const std::vector<Cure> help = cures({&row, 1});
    if (!help.empty()) text += "; " + help.front().text();
    return text;
}

std::vector<TimePart> time_parts(std::span<const TimingRow> frames) {
    const Means means(frames);
    if (means.empty()) return {};
    const Rendering r(means);
    std::vector<TimePart> parts{
        {"edge to its being seen", "threads.trigger_priority", means.ms(&TimingRow::edge, &TimingRow::seen)},
        {"waiting for earlier frames", "rendering and readout of those",
         means.ms(&TimingRow::seen, &TimingRow::pose)},
        {"waiting for rendering", "rendering of earlier frames",
         means.ms(&TimingRow::pose, &TimingRow::render_begin)},
    };
    if (r.known) {
        const auto add = [&](const char* name, const char* setting, double ms) {
            if (ms > 0.0005) parts.push_back({name, setting, ms});
        };
        add("rendering: scene at motion instants", "render.max_instants", r.setup);
        add("rendering: samples", "render.samples_per_pixel, render.target_error", r.sampling);
        add("rendering: shared sample grid", "render.target_error", r.grid);
        add("rendering: wings", "camera.psf_wings_px of the scene", r.wings);
        add("rendering: stars and small bodies", "render.max_instants, stars.limiting_magnitude", r.points);
        add("rendering: other", "pixels", r.rest);
        add("rendering: detector not ready", "[sensor.detector], pixels", r.detector_wait);
        add("rendering: lost to other programs", "threads.render_class, render_nice, render_cores", r.others);
    } else {
        parts.push_back({"rendering", "[render], pixels", r.all});
    }
    parts.push_back({"detector after rendering", "[sensor.detector], render.band_rows",
                     means.ms(&TimingRow::render_end, &TimingRow::detector_end)});
    parts.push_back({"release after both", "threads.release_priority, deadline.spin_us",
                     means.of([](const TimingRow& row) {
                         return std::max<std::int64_t>(0,
                                                       row.last - std::max(row.detector_end, row.last_due));
                     }) * 1e-6});
    return parts;
}

std::string Cure::text() const {
    return fmt::format("{} {} of {} ms: {} would give about {} ms", cause, ms_text(ms), ms_text(of_ms),
                       advice, ms_text(with_ms));
}

std::vector<Cure> cures(std::span<const TimingRow> frames) {
    const Means means(frames);
    if (means.empty()) return {};
    const Rendering r(means);
    const double late_ms = means.of([](const TimingRow& row) { return lateness(row); }) * 1e-6;
    std::vector<Cure> all;
    if (r.known) add_rendering_cures(means, r, late_ms, all);
    const double after = means.ms(&TimingRow::render_end, &TimingRow::detector_end);
    // In one row block the detector cannot begin before rendering has ended.
    if (const double whole = means.ms(&TimingRow::detector);
        r.known && whole > 0 && after > 0.9 * whole && after > 1)
        all.push_back(
            {"the detector after rendering", after, r.all + after, r.all + after / 4,
             fmt::format("render.band_rows = {}", std::max<std::int64_t>(1, means.front().height / 4))});
    std::stable_sort(all.begin(), all.end(),
                     [](const Cure& a, const Cure& b) { return a.of_ms - a.with_ms > b.of_ms - b.with_ms; });
    // All of it grows with the pixels.
    if (r.known && late_ms > 0 && late_ms < r.all && means.front().height > 1) {
        const double left = 1 - late_ms / r.all;
        const auto rows = std::max(1.0, std::floor(left * static_cast<double>(means.front().height)));
        all.push_back({fmt::format("{} x {} pixels", means.front().width, means.front().height), r.all, r.all,
                       r.all - late_ms, fmt::format("a window of {:.0f} rows", rows)});
    }
    return all;
}

std::vector<std::string> remarks(const TimingFile& acquisition) {
    std::vector<std::string> all;
    const Means means(acquisition.rows);
    if (means.empty()) return all;
    if (std::string quality = quality_remark(acquisition.rows); !quality.empty())
        all.push_back(std::move(quality));
    std::vector<double> ahead_ms;
    for (const TimingRow& row : acquisition.rows)
        if (finished(row) && row.ahead > 0) ahead_ms.push_back(to_ms(row.ahead));
    if (!ahead_ms.empty()) {
        std::sort(ahead_ms.begin(), ahead_ms.end());
        all.push_back(fmt::format(
            "rendered ahead: {} of {} frames were ready before their trigger, by {} ms (median; least {} ms)",
            ahead_ms.size(), acquisition.rows.size(), ms_text(ahead_ms[ahead_ms.size() / 2]),
            ms_text(ahead_ms.front())));
    }
    if (const Rendering r(means); r.known && means.of(&TimingRow::measured) > 0)
        all.push_back(
            fmt::format("render threads: {:.0f} of {:.0f} cores, at work {:.0f} % of the time of rendering; "
                        "then they had {:.1f} % of a core each, other programs the rest ({:.1f} ms a frame); "
                        "{:.1f} involuntary context switches a frame",
                        means.of(&TimingRow::render_threads), means.of(&TimingRow::render_cores),
                        100 * r.busy_share, 100 * r.cpu_share, r.others, means.of(&TimingRow::preemptions)));
    const std::optional<double> period = trigger_period_ms(acquisition);
    const double least = means.ms(&TimingRow::min_period);
    if (period && least > *period)
        all.push_back(fmt::format(
            "triggers every {} ms, but the chip reads a frame in {} ms: trigger at {:.3g} Hz at most, or read fewer rows (camera.height)",
            ms_text(*period), ms_text(least), 1e3 / least));
    const double making =
        std::max(means.ms(&TimingRow::render_begin, &TimingRow::render_end), means.ms(&TimingRow::detector));
    if (period && making > std::max(*period, least))
        all.push_back(fmt::format("triggers every {} ms, but a frame takes {} ms to make: at most {:.3g} Hz",
                                  ms_text(*period), ms_text(making), 1e3 / making));
    for (std::size_t t = 0; t < acquisition.transports.size(); ++t)
        if (std::string text = sending(acquisition, t); !text.empty()) all.push_back(std::move(text));
    return all;
}

} // namespace obscura::tools
