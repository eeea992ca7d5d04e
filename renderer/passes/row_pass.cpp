// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/row_pass.hpp"

#include "renderer/integrators/block_tracer.hpp"
#include "renderer/integrators/point_splatter.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/passes/grid_pass.hpp"
#include "renderer/passes/point_pass.hpp"
#include "renderer/passes/reprojection_pass.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>

namespace obscura::renderer {
namespace {

constexpr auto min_float = static_cast<double>(std::numeric_limits<float>::min());

/// As std::fill(), which does not become memset for floats.
void clear(std::span<float> values) {
    if (!values.empty()) std::memset(values.data(), 0, values.size_bytes());
}

/// Brings the variance of 16 pixels from the tracer's unit to that of the image: no less than the rounding of
/// the image to float, nor than a float can hold; 0 where there are no samples.
OBSCURA_VECTOR_CLONES
void scale_packet(const double* __restrict light, const double* __restrict variance,
                  const double* __restrict per_pixel, double unit, float* __restrict out) {
    for (int i = 0; i < packet_size; ++i) {
        const double scale = unit * per_pixel[i];
        const double rounded = 0x1p-24 * light[i];
        const double least = rounded * rounded / 12;
        const double own = (variance[i] > least ? variance[i] : least) * scale * scale;
        const double kept = own > min_float ? own : min_float;
        out[i] = static_cast<float>(variance[i] > 0 ? kept : 0);
    }
}

/// Adds what is known of 16 pixels of a block.
OBSCURA_VECTOR_CLONES
void add_estimates(const BlockResult& result, float* __restrict samples, double* __restrict variance) {
    for (int i = 0; i < packet_size; ++i) {
        const auto n = static_cast<float>(static_cast<std::int32_t>(result.samples[i]));
        const double own = result.variance[i] > least_variance ? result.variance[i] : least_variance;
        samples[i] += result.covered[i] ? n : 0.0F;
        variance[i] = result.covered[i] ? own : variance[i];
    }
}

/// Adds a block of a row's pixels. Returns false if no body is near.
bool trace_block(const PassRequest& request, std::int32_t y, std::int32_t block, BlockTracer& blocks,
                 const SampleGridKernel* kernel, const SampleGrid* grid, std::size_t channels, Scratch& s) {
    const auto width = static_cast<std::size_t>(request.window.width);
    BlockResult result;
    const bool estimates = !request.variance.empty();
    if (!blocks.trace(block, y, result, estimates, kernel, grid)) return false;
    s.add_sampled(block * packet_size - request.window.x, packet_size, request.window.width);
    const std::int32_t first = block * packet_size - request.window.x;
    const int begin = std::max(0, -first), end = std::min(packet_size, request.window.width - first);
    const auto row_from = [&](auto& row, std::size_t at) {
        return row.data() + at + (std::ptrdiff_t{first} + begin);
    };
    for (std::size_t c = 0; c < channels; ++c) {
        double* const light = row_from(s.light, c * width);
        for (int i = begin; i < end; ++i)
            if (result.covered[i]) light[i - begin] += result.mean[c][i];
    }
    if (estimates && !request.samples.empty() && end - begin == packet_size) {
        add_estimates(result, row_from(request.samples, static_cast<std::size_t>(s.row) * width),
                      row_from(s.variance, 0));
        return true;
    }
    if (!request.samples.empty()) {
        float* const samples = row_from(request.samples, static_cast<std::size_t>(s.row) * width);
        for (int i = begin; i < end; ++i)
            if (result.covered[i]) samples[i - begin] += static_cast<float>(result.samples[i]);
    }
    if (estimates) {
        double* const variance = row_from(s.variance, 0);
        for (int i = begin; i < end; ++i)
            if (result.covered[i]) variance[i - begin] = std::max(result.variance[i], least_variance);
    }
    return true;
}

/// Traces the blocks with small bodies as at QualityLevel::full.
void trace_small_bodies(const BuiltScene& built, const PassRequest& request, std::int32_t y,
                        const Instants& instants, Tracer& tracer, Scratch& s) {
    const auto width = static_cast<std::size_t>(request.window.width);
    const Sampling how = built.sampling(request.frame_id);
    BlockTracer blocks(instants.one() ? *s.lens : *built.lens, built.gaussian_psf, built.psf.get(), how,
                       instants, s.whole.swept, tracer, s.candidates);
    const std::int32_t first = BlockTracer::block_of(request.window.x);
    const std::int32_t last = BlockTracer::block_of(request.window.x + request.window.width - 1);
    for (std::int32_t block = first; block <= last; ++block) {
        if (const NearBodies near = blocks.near(block, y); near.samples == 0 || !near.small) continue;
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t column = block * packet_size + i - request.window.x;
            if (column < 0 || column >= request.window.width) continue;
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                s.light[c * width + static_cast<std::size_t>(column)] = 0;
            if (!request.variance.empty()) s.variance[static_cast<std::size_t>(column)] = 0;
            if (!request.samples.empty())
                request.samples[static_cast<std::size_t>(s.row) * width + static_cast<std::size_t>(column)] =
                    0;
        }
        trace_block(request, y, block, blocks, nullptr, nullptr, tracer.channels(), s);
    }
}

/// Adds the light of the row's pixel samples. Returns false if no body is near.
bool trace_pixels(const BuiltScene& built, const PassRequest& request, std::int32_t y, const RowBlock& rows,
                  const Instants& instants, std::span<const SweptBody> swept, QualityLevel level,
                  Tracer& tracer, Scratch& s) {
    if (level >= QualityLevel::reprojected) {
        const std::span<const RowState> states = instants.states();
        take_earlier(built, request, request.kept_y(s.row), level, tracer.channels(),
                     states[states.size() / 2], s);
        return true;
    }
    if (std::none_of(instants.states().begin(), instants.states().end(),
                     [&](const RowState& row) { return resolves_any(row, built.field_rad); }))
        return false;
    const bool shared =
        rows.kernel &&
        shares_samples(built, request, request.row_times[static_cast<std::size_t>(s.row)], level, s);
    const bool sparse = level >= QualityLevel::grid && !shared;
    if (sparse && take_sparse(request, y, rows.sparse[sparse_index(level)], tracer.channels(), s))
        return true;
    Sampling how = built.sampling(request.frame_id, level);
    how.cancel = rows.cancel;
    BlockTracer blocks(instants.one() ? *s.lens : *built.lens, built.gaussian_psf, built.psf.get(), how,
                       instants, swept, tracer, s.candidates);
    const std::int32_t last = BlockTracer::block_of(request.window.x + request.window.width - 1);
    const std::int32_t first = BlockTracer::block_of(request.window.x);
    bool near = false;
    for (std::int32_t block = first; block <= last; ++block) {
        // A body may be hidden between the points of a sparse grid.
        if (sparse && blocks.near(block, y).samples > 0) return true;
        if (sparse) continue;
        near = trace_block(request, y, block, blocks, shared ? &*rows.kernel : nullptr,
                           shared ? &rows.grid : nullptr, tracer.channels(), s) ||
               near;
    }
    return near;
}

/// Brings the variance of a row from Scratch::variance to the image's unit.
void scale_variance(const BuiltScene& built, Scratch& s, std::span<float> variance) {
    const double unit = built.plain ? std::accumulate(built.sun_w_m2.begin(), built.sun_w_m2.end(), 0.0) /
                                          static_cast<double>(built.sun_w_m2.size())
                                    : 1;
    const std::size_t width = variance.size();
    const std::size_t channels = s.light.size() / width;
    const double share = 1 / static_cast<double>(channels);
    constexpr std::size_t packet = packet_size;
    const std::size_t first = s.first_sampled / packet * packet;
    const std::size_t end = std::max(first, std::min(width, (s.end_sampled + packet - 1) / packet * packet));
    clear(variance.first(first));
    clear(variance.subspan(end));
    for (std::size_t x = first; x < end; x += packet) {
        const std::size_t count = std::min(packet, width - x);
        if (count == packet && channels == 1) {
            scale_packet(&s.light[x], &s.variance[x], &s.per_pixel[x], unit, &variance[x]);
            continue;
        }
        Doubles light{}, own{}, per_pixel{};
        for (std::size_t c = 0; c < channels; ++c)
            for (std::size_t i = 0; i < count; ++i)
                light.v[i] += share * s.light[c * width + x + i];
        std::copy_n(s.variance.data() + x, count, own.v);
        std::copy_n(s.per_pixel.data() + x, count, per_pixel.v);
        float out[packet];
        scale_packet(light.v, own.v, per_pixel.v, unit, out);
        std::copy_n(out, count, variance.data() + x);
    }
    std::fill(s.variance.begin() + static_cast<std::ptrdiff_t>(first),
              s.variance.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
}

/// Adds the points of a row, at each instant: small bodies, stars and the sky.
void add_points(const BuiltScene& built, const PassRequest& request, const RowBlock& rows, std::int32_t y,
                const Exposure& when, Scratch& s) {
    const std::span states(s.whole.rows.data(), when.instants);
    for (std::uint32_t i = 0; i < when.instants; ++i) {
        set_lens(built, states[i].beta, s);
        with_tracer(built, states[i], s, [&](Tracer& tracer) {
            const StarObserver seen_from =
                star_observer(built.scene, states[i].camera.position_m, when.time_s(i));
            const SplatTarget target{request.window, y,       when.instants, states[i],   seen_from,
                                     when.time_s(i), *s.lens, s.light,       s.starlight, s.candidates};
            splat_bodies(built, request, rows, target, i, tracer, s);
            built.splatter.splat_stars(target, rows.stars.stars,
                                       rows.stars.in_row(static_cast<std::size_t>(request.part.row + s.row)),
                                       tracer);
            built.splatter.splat_sky(target, tracer);
            s.work.lap(RenderPart::points);
        });
    }
}

/// Adds the wings that Scratch::wing_light has of the whole row.
void add_wings_of_part(const PassRequest::Part& part, std::size_t width, Scratch& s) {
    const auto whole = static_cast<std::size_t>(part.width), at = static_cast<std::size_t>(part.column);
    for (std::size_t c = 0; c < s.light.size() / width; ++c)
        for (std::size_t x = 0; x < width; ++x)
            s.light[c * width + x] += s.wing_light[c * whole + at + x];
}

/// Writes a row of the image from Scratch::light and Scratch::starlight.
void write_row(const BuiltScene& built, const PassRequest& request, std::span<float> irradiance,
               const Scratch& s) {
    const auto width = static_cast<std::size_t>(request.window.width);
    for (std::size_t b = 0; b < built.scene.bands.size(); ++b) {
        float* out =
            irradiance.data() +
            (b * static_cast<std::size_t>(request.rows_of_plane()) + static_cast<std::size_t>(s.row)) * width;
        const double* light = s.light.data() + (built.plain ? 0 : b * width);
        const double unit = built.plain ? built.sun_w_m2[b] : 1;
        for (std::size_t x = 0; x < width; ++x)
            out[x] = static_cast<float>((light[x] * unit + s.starlight[b * width + x]) * s.per_pixel[x]);
    }
}

} // namespace

RenderedRow render_row(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                       std::int32_t r, std::span<float> irradiance, Scratch& s) {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::int32_t y = request.sensor_y(r);
    s.row = r;
    const Exposure when = exposure_of(built, request.row_times[static_cast<std::size_t>(r)], s);
    s.starlight.assign(width * built.scene.bands.size(), 0);
    const auto row_of = [&](std::span<float> plane) {
        return plane.empty() ? plane : plane.subspan(static_cast<std::size_t>(r) * width, width);
    };
    clear(row_of(request.samples));
    s.first_sampled = width;
    s.end_sampled = 0;
    // All 0: scale_variance() leaves it so.
    if (!request.variance.empty() && s.variance.size() != width) s.variance.assign(width, 0);
    s.light.assign(width * built.channels(), 0);
    const QualityLevel level = request.level_of(r);
    const Exposure traced =
        level >= QualityLevel::reprojected ? when : exposure_at(built, level, when.row, s);
    RowSetUp& set_up = traced.instants == when.instants ? s.whole : s.fewer;
    begin_rows(built, rows.request, traced, s, set_up);
    if (&set_up == &s.fewer) set_lens(built, set_up.rows[0].beta, s);
    s.work.row_set_up(when.instants);
    const Instants sampled(std::span(set_up.rows.data(), traced.instants));
    bool bodies_near = false;
    with_tracer(
        built, sampled, s,
        [&](Tracer& tracer) {
            bodies_near = trace_pixels(built, request, y, rows, sampled, set_up.swept, level, tracer, s);
        },
        level);
    begin_rows(built, rows.request, when, s, s.whole);
    const std::span states(s.whole.rows.data(), when.instants);
    if (level != QualityLevel::full && has_small(states)) {
        set_lens(built, states[0].beta, s);
        with_tracer(built, Instants(states), s, [&](Tracer& tracer) {
            trace_small_bodies(built, request, y, Instants(states), tracer, s);
        });
    }
    if (request.keep != nullptr) keep_light(built, request, request.kept_y(r), when, s);
    s.work.lap(RenderPart::sampling);
    add_points(built, request, rows, y, when, s);
    if (rows.wings) {
        if (request.part.width == 0)
            rows.wings->add(static_cast<std::size_t>(r), s.light, s.wing_row);
        else
            add_wings_of_part(request.part, width, s);
        s.work.lap(RenderPart::wings);
    }
    s.per_pixel.assign(width, 1);
    if (built.scene.quantity == scene::Quantity::radiance)
        for (std::size_t x = 0; x < width; ++x) {
            const double solid_angle_sr =
                built.lens->solid_angle_sr(request.window.x + static_cast<double>(x), y);
            s.per_pixel[x] = solid_angle_sr > 0 ? 1 / solid_angle_sr : 0;
        }
    if (!request.variance.empty()) scale_variance(built, s, row_of(request.variance));
    for (const StrayMap& map : built.stray)
        map.add(request.window.x, y, built.sun_at_camera(states.back()), built.scene.bands.size(),
                s.starlight);
    write_row(built, request, irradiance, s);
    return {traced.instants, bodies_near ? level : QualityLevel::full};
}

} // namespace obscura::renderer
