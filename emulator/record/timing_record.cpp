// SPDX-License-Identifier: Apache-2.0
#include "emulator/record/timing_record.hpp"

namespace obscura::emulator {
namespace {

std::int64_t whole(std::uint64_t count) {
    return static_cast<std::int64_t>(count);
}

void add_work(FrameRecord& out, const FrameWork& work) {
    using renderer::RenderPart;
    const renderer::RenderWork& render = work.render;
    out.rendered_rows = whole(render.rows);
    out.setup = render[RenderPart::setup];
    out.sampling = render[RenderPart::sampling];
    out.grid = render[RenderPart::grid];
    out.wings = render[RenderPart::wings];
    out.points = render[RenderPart::points];
    out.rest = render[RenderPart::rest];
    out.measured = render.measured_ns, out.measured_cpu = render.measured_cpu_ns;
    out.preemptions = whole(render.preemptions), out.page_faults = whole(render.page_faults);
    out.row_instants = whole(render.instants);
    out.samples = whole(render.samples), out.rays = whole(render.rays);
    out.detector_wait = work.detector_wait_ns, out.detector = work.detector_ns;
    out.ahead = work.ahead_ns, out.ahead_error_px = work.ahead_error_px;
}

} // namespace

FrameRecord record_of(const FrameTiming& frame, const RenderFacts& render) {
    FrameRecord out;
    out.frame_id = frame.frame_id, out.trigger_id = frame.trigger_id;
    out.edge = frame.edge.ns, out.seen = frame.seen.ns, out.pose = frame.pose.ns;
    out.render_begin = frame.render_begin.ns, out.render_end = frame.render_end.ns;
    out.detector_end = frame.detector_end.ns;
    out.due = frame.due.ns, out.first = frame.first.ns;
    out.last_due = frame.last_due.ns, out.last = frame.last.ns;
    out.rows = frame.rows, out.late_rows = frame.late_rows, out.stalled_rows = frame.stalled_rows;
    out.worst_row = frame.worst_row_ns, out.worst_row_number = frame.worst_row;
    out.flags = frame.flags;
    out.acquisition = frame.facts.acquisition, out.min_period = frame.facts.min_period_ns;
    out.width = frame.width, out.height = frame.height;
    out.render_threads = render.threads, out.render_cores = render.cores;
    out.samples_per_pixel = render.samples_per_pixel, out.target_error = render.target_error;
    out.max_instants = render.max_instants;
    add_work(out, frame.work);
    out.quality = frame.quality;
    return out;
}

} // namespace obscura::emulator
