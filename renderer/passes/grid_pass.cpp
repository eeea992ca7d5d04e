// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/grid_pass.hpp"

#include "renderer/integrators/block_tracer.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Spacing of the sparse grid of a level.
std::int32_t sparse_step(QualityLevel level) {
    return 1 << sparse_index(level);
}

/// Rows of a shared grid above and below a pixel that it needs.
std::int32_t grid_margin(const SampleGridKernel& kernel) {
    return std::max(kernel.reach, 1);
}

/// Traces rows of points, RowBlock::grid_jobs: job i belongs to row `row_of(i)` of the request, for its gate;
/// `flag(i)` is 1 when it is done.
template<typename RowOf, typename Fill, typename Flag>
bool fill_rows(const RowScheduler& workers, RenderPart part, const PassRequest& request, const RowBlock& rows,
               const std::atomic<bool>* cancel, const RowOf& row_of, const Fill& fill, const Flag& flag) {
    const auto jobs = static_cast<std::int32_t>(rows.grid_jobs.size());
    if (request.gate == nullptr) return workers.for_rows(part, jobs, request.of, cancel, fill);
    workers.for_rows(
        part, jobs, request.of, cancel, [&](std::int32_t job) { return request.gate->wants(row_of(job)); },
        fill);
    for (std::int32_t job = 0; job < jobs; ++job)
        if (std::uint8_t& filled = flag(job); filled != 1) filled = 0;
    // Rows of pixels that lack points are left out one by one.
    return cancel == nullptr || !cancel->load(std::memory_order_relaxed);
}

} // namespace

bool shares_samples(const BuiltScene& built, const PassRequest& request, const RowTime& row,
                    QualityLevel level, Scratch& s) {
    if (level >= QualityLevel::quarter) return false;
    // Share samples only at <= 2 spp: a higher count is an explicit request.
    return built.settings.target_error > 0 && built.settings.samples_per_pixel <= 2 && !built.psf &&
           request.common_mid == row.mid() && SampleGridKernel::fits(built.gaussian_psf) &&
           exposure_at(built, level, row, s).instants == 1;
}

bool fill_sample_grid(const RowScheduler& workers, const PassRequest& request,
                      const std::atomic<bool>* cancel, RowBlock& rows) {
    const BuiltScene& built = workers.built();
    Scratch& own = workers.own_scratch(request.of.alone);
    const auto shares = [&](std::int32_t r) {
        return shares_samples(built, request, request.row_times[static_cast<std::size_t>(r)],
                              request.level_of(r), own);
    };
    std::int32_t first = 0;
    while (first < request.rows && !shares(first))
        ++first;
    if (first == request.rows) return true;
    SampleGrid& grid = rows.grid;
    if (!rows.kernel) {
        rows.kernel.emplace(built.grid_psf ? *built.grid_psf : built.gaussian_psf, built.settings.seed,
                            request.frame_id);
        const bool whole = request.kept != nullptr;
        const Region window{request.window.x, whole ? request.frame_y : request.window.y,
                            request.window.width, request.window.height};
        grid.reset(window, whole ? 0 : request.first_row,
                   whole ? static_cast<std::int32_t>(request.frame_times.size()) : request.rows,
                   built.channels(), rows.kernel->reach);
        rows.grid_filled.assign(static_cast<std::size_t>(grid.height()), 0);
    }
    // Rows of points about those pixels, in their order.
    const std::int32_t margin = grid_margin(*rows.kernel);
    const std::int32_t top = request.window.y + request.first_row - grid.first_y();
    rows.grid_jobs.clear();
    for (std::int32_t r = first; r < request.rows; ++r) {
        if (!shares(r)) continue;
        for (std::int32_t at = top + r - margin; at <= top + r + margin; ++at)
            if (std::uint8_t& filled = rows.grid_filled[static_cast<std::size_t>(at)]; filled == 0) {
                filled = 2; // listed
                rows.grid_jobs.push_back(at);
            }
    }
    const double time_s = to_seconds(request.common_mid->ns);
    const auto fill = [&](std::int32_t job, Scratch& s) {
        const std::int32_t r = rows.grid_jobs[static_cast<std::size_t>(job)];
        const RowState& row = begin_row(built, time_s, s);
        if (resolves_any(row, built.field_rad))
            with_tracer(built, row, s, [&](Tracer& tracer) {
                const Sampling how = built.sampling(request.frame_id);
                BlockTracer blocks(*s.lens, built.gaussian_psf, built.psf.get(), how, row, {}, tracer,
                                   s.candidates);
                const std::int32_t first_block = BlockTracer::block_of(grid.first_x());
                for (std::int32_t block = 0; block < grid.width() / packet_size; ++block)
                    blocks.trace_grid(first_block + block, grid.first_y() + r, *rows.kernel, grid);
            });
        rows.grid_filled[static_cast<std::size_t>(r)] = 1;
    };
    return fill_rows(
        workers, RenderPart::grid, request, rows, cancel,
        [&](std::int32_t job) {
            return std::clamp(rows.grid_jobs[static_cast<std::size_t>(job)] - margin - top, first,
                              request.rows - 1);
        },
        fill,
        [&](std::int32_t job) -> std::uint8_t& {
            return rows.grid_filled[static_cast<std::size_t>(rows.grid_jobs[static_cast<std::size_t>(job)])];
        });
}

bool fill_sparse_grid(const RowScheduler& workers, const PassRequest& request, QualityLevel level,
                      const std::atomic<bool>* cancel, RowBlock& rows) {
    const BuiltScene& built = workers.built();
    const auto index = sparse_index(level);
    Scratch& own = workers.own_scratch(request.of.alone);
    const auto asks = [&](std::int32_t r) {
        return request.level_of(r) == level &&
               !shares_samples(built, request, request.row_times[static_cast<std::size_t>(r)], level, own);
    };
    std::int32_t first = 0;
    while (first < request.rows && !asks(first))
        ++first;
    if (first == request.rows) return true;
    SparseGrid& grid = rows.sparse[index];
    const std::int32_t top = request.window.y + request.first_row;
    const bool whole = !request.frame_times.empty();
    const std::span<const RowTime> times = whole ? request.frame_times : request.row_times;
    const std::int32_t times_y = whole ? request.frame_y : top;
    if (!rows.sparse_begun[index]) {
        const bool kept = request.kept != nullptr;
        grid.reset(sparse_step(level), request.window.x, request.window.width, kept ? request.frame_y : top,
                   kept ? static_cast<std::int32_t>(times.size()) : request.rows, built.channels(),
                   built.response_px(), built.settings.seed, request.frame_id);
        rows.sparse_begun[index] = true;
    }
    rows.grid_jobs.clear();
    for (std::int32_t r = first; r < request.rows; ++r) {
        if (!asks(r)) continue;
        const std::int32_t about = grid.row_about(top + r);
        for (std::int32_t at = about - 1; at <= about + 2; ++at)
            if (std::uint8_t& filled = grid.filled(at); filled == 0) {
                filled = 2;
                rows.grid_jobs.push_back(at);
            }
    }
    const auto fill = [&](std::int32_t job, Scratch& s) {
        const std::int32_t r = rows.grid_jobs[static_cast<std::size_t>(job)];
        const double y = grid.y_of(r);
        const auto nearest = static_cast<std::int32_t>(std::floor(y + 0.5)) - times_y;
        const RowTime& time = times[static_cast<std::size_t>(
            std::clamp(nearest, 0, static_cast<std::int32_t>(times.size()) - 1))];
        const RowState& row = begin_row(built, to_seconds(time.mid().ns), s);
        if (resolves_any(row, built.field_rad))
            with_tracer(built, row, s, [&](Tracer& tracer) {
                const Sampling how = built.sampling(request.frame_id);
                BlockTracer blocks(*s.lens, built.gaussian_psf, built.psf.get(), how, row, {}, tracer,
                                   s.candidates);
                for (std::int32_t c = 0; c < grid.columns(); c += packet_size)
                    blocks.trace_points(grid.x_of(c), y, grid.step(), grid.row(r) + c, grid.plane());
            });
        grid.filled(r) = 1;
    };
    const bool filled = fill_rows(
        workers, RenderPart::grid, request, rows, cancel,
        [&](std::int32_t job) {
            const double y = grid.y_of(rows.grid_jobs[static_cast<std::size_t>(job)]);
            return std::clamp(static_cast<std::int32_t>(y) - 2 * grid.step() - top, first, request.rows - 1);
        },
        fill,
        [&](std::int32_t job) -> std::uint8_t& {
            return grid.filled(rows.grid_jobs[static_cast<std::size_t>(job)]);
        });
    if (!filled) return false;
    rows.grid_jobs.clear();
    for (std::int32_t r = first; r < request.rows; ++r) {
        if (!asks(r)) continue;
        const std::int32_t about = grid.row_about(top + r);
        for (const std::int32_t at : {about, about + 1})
            if (!grid.estimated(at) && grid.can_estimate(at) &&
                (rows.grid_jobs.empty() || rows.grid_jobs.back() < at))
                rows.grid_jobs.push_back(at);
    }
    return workers.for_rows(RenderPart::grid, static_cast<std::int32_t>(rows.grid_jobs.size()), request.of,
                            cancel, [&](std::int32_t job, Scratch&) {
                                grid.estimate(rows.grid_jobs[static_cast<std::size_t>(job)],
                                              built.channels());
                            });
}

bool grids_ready(const BuiltScene& built, const PassRequest& request, const RowBlock& rows, std::int32_t r,
                 Scratch& s) {
    const QualityLevel level = request.level_of(r);
    if (level >= QualityLevel::reprojected) return true;
    const std::int32_t y = request.window.y + request.first_row + r;
    const bool shared =
        rows.kernel &&
        shares_samples(built, request, request.row_times[static_cast<std::size_t>(r)], level, s);
    if (!shared) return level < QualityLevel::grid || rows.sparse[sparse_index(level)].ready(y);
    const std::int32_t margin = grid_margin(*rows.kernel);
    const auto at = rows.grid_filled.begin() + (y - rows.grid.first_y());
    return std::all_of(at - margin, at + margin + 1, [](std::uint8_t filled) { return filled == 1; });
}

bool take_sparse(const PassRequest& request, std::int32_t y, const SparseGrid& grid, std::size_t channels,
                 Scratch& s) {
    s.add_sampled(0, request.window.width, request.window.width);
    const auto width = static_cast<std::size_t>(request.window.width);
    for (std::size_t c = 0; c < channels; ++c)
        grid.interpolate(c, request.window.x, y, std::span(s.light).subspan(c * width, width));
    if (!request.variance.empty()) {
        grid.variance(request.window.x, y, std::span(s.variance).first(width));
        for (std::size_t x = 0; x < width; ++x)
            s.variance[x] = has_light(s.light, x, width) ? std::max(s.variance[x], least_variance) : 0;
    }
    if (!request.samples.empty()) {
        const auto row = static_cast<std::size_t>(s.row);
        const float share = 1 / static_cast<float>(grid.step() * grid.step());
        for (std::size_t x = 0; x < width; ++x)
            if (has_light(s.light, x, width)) request.samples[row * width + x] = share;
    }
    return std::any_of(s.light.begin(), s.light.end(), [](double light) { return light > 0; });
}

} // namespace obscura::renderer
