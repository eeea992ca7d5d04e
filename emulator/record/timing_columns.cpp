// SPDX-License-Identifier: Apache-2.0
#include "emulator/record/timing_columns.hpp"

#include <array>
#include <cmath>

namespace obscura::emulator {
namespace {

using Frame = FrameTiming;
using Facts = RenderFacts;

template<typename Number>
std::int64_t whole(Number value) {
    return static_cast<std::int64_t>(value);
}

std::int64_t in_millionths(double value) {
    return std::llround(1e6 * value);
}

constexpr TimingColumn instant(std::string_view name, std::int64_t (*value)(const Frame&, const Facts&)) {
    return {name, value, true};
}

constexpr std::array columns{
    TimingColumn{"frame_id", [](const Frame& f, const Facts& /*r*/) { return whole(f.frame_id); }},
    TimingColumn{"trigger_id", [](const Frame& f, const Facts& /*r*/) { return whole(f.trigger_id); }},
    instant("edge_ns", [](const Frame& f, const Facts& /*r*/) { return f.edge.ns; }),
    instant("seen_ns", [](const Frame& f, const Facts& /*r*/) { return f.seen.ns; }),
    instant("pose_ns", [](const Frame& f, const Facts& /*r*/) { return f.pose.ns; }),
    instant("render_begin_ns", [](const Frame& f, const Facts& /*r*/) { return f.render_begin.ns; }),
    instant("render_end_ns", [](const Frame& f, const Facts& /*r*/) { return f.render_end.ns; }),
    instant("detector_end_ns", [](const Frame& f, const Facts& /*r*/) { return f.detector_end.ns; }),
    instant("due_ns", [](const Frame& f, const Facts& /*r*/) { return f.due.ns; }),
    instant("first_ns", [](const Frame& f, const Facts& /*r*/) { return f.first.ns; }),
    instant("last_due_ns", [](const Frame& f, const Facts& /*r*/) { return f.last_due.ns; }),
    instant("last_ns", [](const Frame& f, const Facts& /*r*/) { return f.last.ns; }),
    TimingColumn{"rows", [](const Frame& f, const Facts& /*r*/) { return whole(f.rows); }},
    TimingColumn{"late_rows", [](const Frame& f, const Facts& /*r*/) { return whole(f.late_rows); }},
    TimingColumn{"worst_row_ns", [](const Frame& f, const Facts& /*r*/) { return whole(f.worst_row_ns); }},
    TimingColumn{"worst_row", [](const Frame& f, const Facts& /*r*/) { return whole(f.worst_row); }},
    TimingColumn{"flags", [](const Frame& f, const Facts& /*r*/) { return whole(f.flags); }},
    TimingColumn{"acquisition",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.facts.acquisition); }},
    TimingColumn{"min_period_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.facts.min_period_ns); }},
    TimingColumn{"width", [](const Frame& f, const Facts& /*r*/) { return whole(f.width); }},
    TimingColumn{"height", [](const Frame& f, const Facts& /*r*/) { return whole(f.height); }},
    TimingColumn{"render_threads", [](const Frame& /*f*/, const Facts& r) { return whole(r.threads); }},
    TimingColumn{"render_cores", [](const Frame& /*f*/, const Facts& r) { return whole(r.cores); }},
    TimingColumn{"samples_per_pixel",
                 [](const Frame& /*f*/, const Facts& r) { return whole(r.samples_per_pixel); }},
    TimingColumn{"target_error_ppm",
                 [](const Frame& /*f*/, const Facts& r) { return in_millionths(r.target_error); }},
    TimingColumn{"max_instants", [](const Frame& /*f*/, const Facts& r) { return whole(r.max_instants); }},
    TimingColumn{"rendered_rows",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.rows); }},
    TimingColumn{"setup_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.part_ns[0]); }},
    TimingColumn{"sampling_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.part_ns[1]); }},
    TimingColumn{"grid_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.part_ns[2]); }},
    TimingColumn{"wings_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.part_ns[3]); }},
    TimingColumn{"points_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.part_ns[4]); }},
    TimingColumn{"rest_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.part_ns[5]); }},
    TimingColumn{"measured_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.measured_ns); }},
    TimingColumn{"measured_cpu_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.measured_cpu_ns); }},
    TimingColumn{"preemptions",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.preemptions); }},
    TimingColumn{"row_instants",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.instants); }},
    TimingColumn{"samples", [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.samples); }},
    TimingColumn{"rays", [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.rays); }},
    TimingColumn{"detector_wait_ns",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.detector_wait_ns); }},
    TimingColumn{"detector_ns", [](const Frame& f, const Facts& /*r*/) { return whole(f.work.detector_ns); }},
    TimingColumn{"ahead_ns", [](const Frame& f, const Facts& /*r*/) { return whole(f.work.ahead_ns); }},
    TimingColumn{"ahead_error_upx",
                 [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.work.ahead_error_px); }},
    TimingColumn{"level_max", [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.level_max); }},
    TimingColumn{"rows_degraded",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.rows_degraded); }},
    TimingColumn{"quality_reasons",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.reasons); }},
    TimingColumn{"error_ppm",
                 [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.quality.error_rms); }},
    TimingColumn{"budget_us", [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.budget_us); }},
    TimingColumn{"spent_us", [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.spent_us); }},
    TimingColumn{"margin_us", [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.margin_us); }},
    TimingColumn{
        "error_worst_ppm",
        [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.quality.error_worst_group); }},
    TimingColumn{"error_goal_ppm",
                 [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.quality.error_goal); }},
    TimingColumn{"noise_ratio_ppm",
                 [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.quality.noise_ratio_p95); }},
    TimingColumn{"unknown_ppm",
                 [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.quality.unknown_share); }},
    TimingColumn{"sampled_instants",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.instants); }},
    TimingColumn{"bounces", [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.bounces); }},
    TimingColumn{"bounces_asked",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.bounces_asked); }},
    TimingColumn{"page_faults",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.work.render.page_faults); }},
    TimingColumn{"stalled_rows", [](const Frame& f, const Facts& /*r*/) { return whole(f.stalled_rows); }},
    TimingColumn{
        "lod_deficit_ppm",
        [](const Frame& f, const Facts& /*r*/) { return in_millionths(f.quality.lod_deficit_share); }},
    TimingColumn{"lod_deficit_worst",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.lod_deficit_worst); }},
    TimingColumn{"tiles_missing",
                 [](const Frame& f, const Facts& /*r*/) { return whole(f.quality.tiles_missing); }},
};

} // namespace

std::span<const TimingColumn> timing_columns() {
    return columns;
}

} // namespace obscura::emulator
