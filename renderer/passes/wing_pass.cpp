// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/wing_pass.hpp"

#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"
#include "renderer/world/key_times.hpp"

#include <algorithm>
#include <span>

namespace obscura::renderer {
namespace {

/// Makes the rows of a map that are needed; false when cancelled.
bool fill_wing_map(const RowScheduler& workers, const WingMaps::Needed& needed, Scratch* alone,
                   const std::atomic<bool>* cancel) {
    const BuiltScene& built = workers.built();
    WingMap& map = *needed.map;
    const double time_s = to_seconds(map.time().ns);
    if (!map.has_bodies()) {
        Scratch& s = workers.own_scratch(alone);
        const RowState& row = begin_row(built, time_s, s);
        map.set_bodies(*s.lens, row);
    }
    // Calls `use(job, view)` for every job, with the scene at the map's time.
    const auto trace = [&](std::int32_t jobs, const auto& use) {
        return workers.for_rows(RenderPart::wings, jobs, {0, alone}, cancel, [&](std::int32_t i, Scratch& s) {
            const RowState& row = begin_row(built, time_s, s);
            with_tracer(built, row, s, [&](Tracer& tracer) {
                use(i, WingMap::View{*s.lens, row, tracer, s.candidates, built.settings.seed});
            });
        });
    };
    const auto each = [&](std::span<const WingMap::Job> jobs, const auto& use) {
        return workers.for_rows(
            RenderPart::wings, static_cast<std::int32_t>(jobs.size()), {0, alone}, cancel,
            [&](std::int32_t i, Scratch& s) { use(jobs[static_cast<std::size_t>(i)], s); });
    };
    if (!map.has_points()) {
        if (!trace(map.point_jobs(),
                   [&](std::int32_t i, const WingMap::View& view) { map.trace_points(i, view); }))
            return false;
        map.sort_points();
    }
    map.plan(needed.first_y, needed.last_y);
    if (!trace(static_cast<std::int32_t>(map.cell_jobs().size()),
               [&](std::int32_t i, const WingMap::View& view) {
                   map.trace_cells(map.cell_jobs()[static_cast<std::size_t>(i)], view);
               }))
        return false;
    if (!each(map.source_jobs(), [&](WingMap::Job job, Scratch&) { map.gather(job); })) return false;
    const std::span<const WingMap::Job> results = map.result_jobs();
    if (!each(results, [&](WingMap::Job job, Scratch&) { map.convolve(job); })) return false;
    // Jobs are in the order of their levels; each needs the one above.
    for (auto end = results.end(); end != results.begin();) {
        const auto begin = std::find_if(
            results.begin(), end, [&](const WingMap::Job& job) { return job.level == (end - 1)->level; });
        if (!each({begin, end}, [&](WingMap::Job job, Scratch& s) { map.add_level_above(job, s.wing_row); }))
            return false;
        end = begin;
    }
    return true;
}

} // namespace

bool fill_wings(const RowScheduler& workers, const PassRequest& request, const std::atomic<bool>* cancel,
                RowBlock& rows) {
    const BuiltScene& built = workers.built();
    if (!built.wing_kernels) return true;
    if (!rows.wings)
        rows.wings.emplace(*built.psf, *built.wing_kernels,
                           KeyTimes(built.scene, built.bodies, *built.lens, built.splatter.reach_px(),
                                    WingMaps::spacing_px(*built.psf)));
    std::span<const RowTime> times = request.row_times;
    if (built.settings.max_instants == 1) {
        rows.middles.clear();
        for (const RowTime& t : times)
            rows.middles.push_back({t.mid(), t.mid()});
        times = rows.middles;
    }
    const std::span<const WingMaps::Needed> needed =
        rows.wings->find(request.frame_id, times, request.window.y + request.first_row, request.window.x,
                         request.window.width);
    return std::all_of(needed.begin(), needed.end(), [&](const WingMaps::Needed& n) {
        return fill_wing_map(workers, n, request.of.alone, cancel);
    });
}

} // namespace obscura::renderer
