// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/point_pass.hpp"

#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"

#include <algorithm>

namespace obscura::renderer {

bool fill_points(const RowScheduler& workers, const PassRequest& request, const std::atomic<bool>* cancel,
                 RowBlock& rows) {
    const BuiltScene& built = workers.built();
    SharedPoints& shared = rows.points;
    shared.jobs.clear();
    shared.time.reset();
    const auto times = request.row_times;
    if (times.empty() || request.common_mid != times.front().mid() ||
        std::any_of(times.begin(), times.end(), [&](const RowTime& t) { return t != times.front(); }))
        return true;
    shared.time = times.front();
    Scratch& own = workers.own_scratch(request.of.alone);
    const Exposure when = exposure_of(built, times.front(), own);
    const std::uint32_t min_samples = min_samples_of(built, when);
    const auto view = [&](const RowState& row, Scratch& s) {
        return PointView{request.window, request.window.y + request.first_row,
                         request.rows,   request.frame_id,
                         false,          row,
                         *s.lens,        s.candidates};
    };
    for (std::uint32_t i = 0; i < when.instants; ++i) {
        const RowState& row = begin_row(built, when.time_s(i), own, 0, min_samples);
        with_tracer(built, row, own, [&](const Tracer& tracer) {
            built.splatter.plan_points(view(row, own), i, when.instants, tracer, shared.jobs);
        });
    }
    if (shared.done.size() < shared.jobs.size()) shared.done.resize(shared.jobs.size());
    return workers.for_rows(RenderPart::points, static_cast<std::int32_t>(shared.jobs.size()), request.of,
                            cancel, [&](std::int32_t j, Scratch& s) {
                                const PointJob& job = shared.jobs[static_cast<std::size_t>(j)];
                                const RowState& row =
                                    begin_row(built, when.time_s(job.instant), s, 0, min_samples);
                                with_tracer(built, row, s, [&](Tracer& tracer) {
                                    built.splatter.trace_points(view(row, s), job, tracer,
                                                                shared.done[static_cast<std::size_t>(j)]);
                                });
                            });
}

void splat_bodies(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                  const SplatTarget& target, std::uint32_t instant, Tracer& tracer, Scratch& s) {
    if (rows.points.time) {
        const std::vector<PointJob>& jobs = rows.points.jobs;
        const auto first = std::partition_point(jobs.begin(), jobs.end(),
                                                [&](const PointJob& job) { return job.instant < instant; });
        for (auto job = first; job != jobs.end() && job->instant == instant; ++job)
            built.splatter.splat_body(target, rows.points.done[static_cast<std::size_t>(job - jobs.begin())]);
        return;
    }
    const bool alone = request.common_mid != request.row_times[static_cast<std::size_t>(s.row)].mid();
    const PointView view{request.window, target.y,   1,       request.frame_id,
                         alone,          target.row, *s.lens, s.candidates};
    s.point_jobs.clear();
    built.splatter.plan_points(view, instant, target.instants, tracer, s.point_jobs);
    for (const PointJob& job : s.point_jobs) {
        built.splatter.trace_points(view, job, tracer, s.points);
        built.splatter.splat_body(target, s.points);
    }
}

} // namespace obscura::renderer
