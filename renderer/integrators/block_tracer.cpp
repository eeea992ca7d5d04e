// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/block_tracer.hpp"

#include "renderer/camera/aberration.hpp"
#include "renderer/integrators/near_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace obscura::renderer {

BlockTracer::BlockTracer(const Projection& projection, const GaussianPsf& gaussian_psf, const Psf* psf,
                         const Sampling& sampling, const Instants& instants, std::span<const SweptBody> swept,
                         Tracer& tracer, std::vector<std::int32_t>& candidates)
    : projection_(projection),
      gaussian_psf_(gaussian_psf),
      psf_(psf),
      sampling_(sampling),
      instants_(instants),
      row_(instants_.front()),
      swept_(swept),
      tracer_(tracer),
      candidates_(candidates),
      sunlight_only_(tracer.sunlight_only()),
      aberration_(std::any_of(instants_.states().begin(), instants_.states().end(),
                              [](const RowState& row) { return length_squared(row.beta) > 0; })) {}

void BlockTracer::set_block(std::int32_t block, std::int32_t y) {
    first_x_ = block * packet_size;
    y_ = y;
    Doubles x;
    Doubles row_y;
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] = first_x_ + i;
        row_y.v[i] = y;
    }
    projection_.rays(x, row_y, centre_, solid_angle_);
}

void BlockTracer::set_seeds() {
    pixel_seeds(sampling_.seed, sampling_.frame_id, first_x_, y_, lens_seed_, light_seed_);
}

NearBodies BlockTracer::find_near() {
    NearBodies found;
    candidates_.clear();
    const auto add = [&](const Lanes& near, const auto& body, const BodyState& brightest) {
        for (int i = 0; i < packet_size; ++i)
            if (near.on[i] != 0) found.covered = static_cast<std::uint16_t>(found.covered | 1u << i);
        found.samples = std::max(found.samples, body.samples);
        found.large = found.large && body.large;
        found.small = found.small || body.small;
        found.reference = std::max(found.reference, tracer_.reference_radiance(brightest));
    };
    Lanes near;
    if (!instants_.one()) {
        Vec3s middle = centre_;
        Words instant;
        std::fill(std::begin(instant.v), std::end(instant.v),
                  static_cast<std::uint32_t>(instants_.count() / 2));
        aberrate_at(instant, middle);
        for (std::size_t b = 0; b < swept_.size(); ++b) {
            if (!near_axis(middle, swept_[b].direction, swept_[b].reach_chord2, near)) continue;
            candidates_.push_back(static_cast<std::int32_t>(b));
            if (swept_[b].brightest == nullptr) continue;
            if (found.samples == 0) set_places(b);
            add(near, swept_[b], *swept_[b].brightest);
        }
        return found;
    }
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
        const BodyState& body = row_.bodies[b];
        if (!near_body(body, centre_, body.reach_chord2, row_.reach_rad, near)) continue;
        // Targeted bodies hide what is behind them, but their own light is splatted.
        candidates_.push_back(static_cast<std::int32_t>(b));
        if (!body.targeted) add(near, body, body);
    }
    return found;
}

void BlockTracer::aberrate_at(const Words& instant, Vec3s& direction) const {
    if (!aberration_) return;
    for (int i = 0; i < packet_size; ++i)
        direction.set(i, aberrate(direction.lane(i), -1.0 * instants_.at(instant, i).beta));
}

bool BlockTracer::trace(std::int32_t block, std::int32_t y, BlockResult& result, bool estimates,
                        const SampleGridKernel* kernel, const SampleGrid* grid) {
    NearBodies near;
    if (grid != nullptr) {
        near = grid->near(block * packet_size, y);
        // Small bodies need more than one grid point per pixel.
        if (near.small || !(near.large || sampling_.grid_only)) grid = nullptr;
    }
    if (grid != nullptr && near.samples == 0) {
        std::fill(std::begin(result.covered), std::end(result.covered), false);
        return false;
    }
    set_block(block, y);
    if (grid == nullptr) near = find_near();
    for (int i = 0; i < packet_size; ++i)
        result.covered[i] = (near.covered >> i & 1u) != 0;
    if (near.samples == 0) return false;

    // First round: shared sample grid or the samples that the bodies ask for.
    Sums sums;
    const std::size_t channels = tracer_.channels();
    for (std::size_t c = 0; c < channels; ++c)
        std::fill(std::begin(sums.channel[c]), std::end(sums.channel[c]), 0.0);
    std::fill(std::begin(sums.least), std::end(sums.least), no_hit);
    std::fill(std::begin(sums.most), std::end(sums.most), -no_hit);
    sums.noise.reset();
    sums.adds_to_noise = estimates || sampling_.target_error > 0;
    std::uint32_t wanted[packet_size];
    int round = 0;
    if (grid != nullptr) {
        take_smooth(*kernel, *grid, near, result, wanted);
        if (sampling_.grid_only) return true;
        if (std::all_of(std::begin(wanted), std::end(wanted), [](std::uint32_t n) { return n == 0; }))
            return true;
        // The grid knows only whether bodies are near; list them.
        near = find_near();
        round = 1;
    } else {
        const std::uint32_t first =
            near.small ? near.samples : std::min(near.samples, sampling_.sample_limit);
        for (int i = 0; i < packet_size; ++i)
            wanted[i] = result.covered[i] ? first : 0;
    }
    set_seeds();
    sample(wanted, sums);

    // Further rounds: estimate the error, add samples where it exceeds the target.
    Doubles variance;
    bool estimated = false;
    for (; sampling_.target_error > 0 && round < 2; ++round) {
        sums.noise.variance(sunlight_only_, variance);
        estimated = !refine(near, result, round == 0, sums, variance, wanted);
        if (estimated) break;
        sample(wanted, sums);
    }
    if (estimates && !estimated) sums.noise.variance(sunlight_only_, variance);

    // Compute means.
    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        result.samples[i] = sums.count[i];
        if (estimates) result.variance[i] = variance.v[i];
        for (std::size_t c = 0; c < channels; ++c)
            result.mean[c][i] = sums.channel[c][i] / n;
    }
    return true;
}

void BlockTracer::trace_grid(std::int32_t block, std::int32_t y, const SampleGridKernel& kernel,
                             SampleGrid& grid) {
    set_block(block, y);
    const NearBodies near = find_near();
    grid.near(block * packet_size, y) = near;
    if (near.samples == 0) return;
    Doubles x;
    Doubles row_y;
    Lanes active;
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] = first_x_ + i + kernel.shift_x;
        row_y.v[i] = y + kernel.shift_y;
        active.on[i] = (near.covered >> i & 1u) != 0 ? -1 : 0;
    }
    set_seeds();
    CameraRays rays;
    rays.index = {};
    rays.light_seed = light_seed_;
    Doubles solid_angle;
    intersect(x, row_y, active, rays, solid_angle);
    tracer_.radiance({&rays, 1});
    for (std::size_t c = 0; c < tracer_.channels(); ++c) {
        float* out = grid.row(c, y) + (first_x_ - grid.first_x());
        for (int i = 0; i < packet_size; ++i)
            out[i] =
                active.on[i] != 0 ? static_cast<float>(rays.radiance.v[c].v[i] * solid_angle.v[i]) : 0.0F;
    }
}

void BlockTracer::trace_points(double x, double y, double step, float* out, std::size_t plane) {
    Doubles point_x;
    Doubles point_y;
    for (int i = 0; i < packet_size; ++i) {
        point_x.v[i] = x + i * step;
        point_y.v[i] = y;
    }
    projection_.rays(point_x, point_y, centre_, solid_angle_);
    const auto column = static_cast<std::int32_t>(std::floor(x));
    pixel_seeds(sampling_.seed, sampling_.frame_id, column, static_cast<std::int32_t>(std::floor(y)),
                lens_seed_, light_seed_);
    const NearBodies near = find_near();
    CameraRays rays;
    rays.index = {};
    rays.light_seed = light_seed_;
    Lanes active;
    for (int i = 0; i < packet_size; ++i)
        active.on[i] = (near.covered >> i & 1u) != 0 ? -1 : 0;
    if (near.samples == 0) return;
    Doubles solid_angle;
    intersect(point_x, point_y, active, rays, solid_angle);
    tracer_.radiance({&rays, 1});
    for (std::size_t c = 0; c < tracer_.channels(); ++c)
        for (int i = 0; i < packet_size; ++i)
            out[c * plane + static_cast<std::size_t>(i)] =
                active.on[i] != 0 ? static_cast<float>(rays.radiance.v[c].v[i] * solid_angle.v[i]) : 0.0F;
}

void BlockTracer::intersect(const Doubles& x, const Doubles& y, const Lanes& active, CameraRays& rays,
                            Doubles& solid_angle) {
    projection_.rays(x, y, rays.direction, solid_angle);
    if (!instants_.one()) aberrate_at(rays.instant, rays.direction);
    tracer_.intersect(rays, active, candidates_);
    tracer_.count_samples(active);
    // Leave out what is splatted.
    for (int i = 0; i < packet_size; ++i) {
        std::int32_t& index = rays.hits.body[i];
        if (index >= 0 &&
            instants_.body(index, rays.instant, i).splatted(rays.direction.lane(i), rays.hits.primitive[i]))
            index = -1;
    }
}

} // namespace obscura::renderer
