// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/block_tracer.hpp"

#include "renderer/packets/frames.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Ratio of the target error of each pixel to the resulting error over all pixels: the estimates are
/// conservative, and most pixels need no further samples (measured by the test of adaptive sampling).
constexpr double error_margin = 2.3;
/// As error_margin, for pixels that share a grid: their error is estimated by the residual of its points from
/// a plane, most of which is detail that the grid still resolves.
constexpr double shared_error_margin = 7;
/// As error_margin, for the number of samples of pixels which the grid is too coarse for.
constexpr double shared_refined_margin = 3.5;
/// As error_margin, for further rounds, in which few pixels take part: the ratio of the error of these pixels
/// to that over all.
constexpr double refined_error_margin = 1.5;
/// As error_margin, for indirect light, whose error is much the same in all pixels.
constexpr double indirect_error_margin = 0.85;
/// The error of n samples of indirect light falls with this power of n.
constexpr double indirect_power = 0.575;
/// Variance of a filtered pixel over that which independent errors of the grid's points would cause, for
/// direct sunlight: the points err together along an edge, but second differences take the edge itself for
/// noise as well (measured by noise_estimate_test.cpp).
constexpr double direct_grid_noise = 0.58;

/// n^0.75
double three_quarter_power(double n) {
    const double root = std::sqrt(n);
    return root * std::sqrt(root);
}

/// Sets `near` to those of 16 directions that lie within `chord2` of `axis`.
OBSCURA_VECTOR_CLONES
void near_axis(const Vec3s& direction, Vec3 axis, double chord2, Lanes& near) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = direction.x.v[i] - axis.x;
        const double y = direction.y.v[i] - axis.y;
        const double z = direction.z.v[i] - axis.z;
        near.on[i] = x * x + y * y + z * z <= chord2 ? -1 : 0;
    }
}

} // namespace

struct BlockTracer::Batch {
    CameraRays rays[Tracer::batch_size];
    Doubles x[Tracer::batch_size], y[Tracer::batch_size];
    Doubles solid_angle[Tracer::batch_size];
    Channels psf_weight[Tracer::batch_size]; ///< with a Psf: see Psf::displace()
    int pixel[Tracer::batch_size][packet_size];
    std::size_t packets = 0; ///< full packets
    int lanes = 0;           ///< used lanes of the packet after those
};

BlockTracer::BlockTracer(const Projection& projection, const GaussianPsf& gaussian_psf, const Psf* psf,
                         const Sampling& sampling, const RowState& row, Tracer& tracer,
                         std::vector<std::int32_t>& candidates)
    : projection_(projection),
      gaussian_psf_(gaussian_psf),
      psf_(psf),
      sampling_(sampling),
      row_(row),
      tracer_(tracer),
      candidates_(candidates),
      sunlight_only_(tracer.sunlight_only()) {}

void BlockTracer::set_block(std::int32_t block, std::int32_t y, Vec3s& centre) {
    first_x_ = block * packet_size;
    y_ = y;
    Doubles x;
    Doubles row_y;
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] = first_x_ + i;
        row_y.v[i] = y;
    }
    projection_.rays(x, row_y, centre, solid_angle_);
    pixel_seeds(sampling_.seed, sampling_.frame_id, first_x_, y, lens_seed_, light_seed_);
}

NearBodies BlockTracer::find_near(const Vec3s& centre) {
    NearBodies found;
    candidates_.clear();
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
        const BodyState& body = row_.bodies[b];
        Lanes near;
        near_axis(centre, body.direction, body.reach_chord2, near);
        if (!near.any()) continue;
        if (!body.targeted) {
            RayPacket rays;
            transform(body.from_camera, centre, {}, rays.direction);
            set_all(rays.origin, body.camera_m);
            body.shape->cull(rays, row_.reach_rad, near);
            if (!near.any()) continue;
        }
        // Targeted bodies hide what is behind them, but their own light is splatted.
        candidates_.push_back(static_cast<std::int32_t>(b));
        if (body.targeted) continue;
        for (int i = 0; i < packet_size; ++i)
            if (near.on[i] != 0) found.covered = static_cast<std::uint16_t>(found.covered | 1u << i);
        found.samples = std::max(found.samples, body.samples);
        found.large = found.large && body.large;
        found.reference = std::max(found.reference, tracer_.reference_radiance(body));
    }
    return found;
}

std::uint32_t BlockTracer::samples_for(double spread, double aim, std::uint32_t least) const {
    // n^0.75 = spread / aim, rounded up to a power of two: Sobol points are best there.
    const std::uint32_t most = std::max(least, sampling_.max_samples);
    const double ratio2 = spread * spread / (aim * aim);
    std::uint32_t count = 1;
    while (count < most && static_cast<double>(count) * count * count < ratio2 * ratio2)
        count *= 2;
    return std::min(count, most);
}

std::uint32_t BlockTracer::indirect_samples_for(double error, double count, double aim,
                                                std::uint32_t least) const {
    if (!(error > aim)) return 1;
    const std::uint32_t most = std::max(least, sampling_.max_samples);
    const double needed = count * std::pow(error / aim, 1 / indirect_power);
    std::uint32_t n = 1;
    while (n < most && n < needed)
        n *= 2;
    return std::min(n, most);
}

double BlockTracer::goal(const NearBodies& near, int pixel, double mean, double block_mean) const {
    const double value = sunlight_only_ ? mean : (mean + block_mean) / 2;
    return sampling_.target_error * std::max(near.reference * solid_angle_.v[pixel], value);
}

void BlockTracer::take_smooth(const SampleGridKernel& kernel, const SampleGrid& grid, const NearBodies& near,
                              BlockResult& result, std::uint32_t (&wanted)[packet_size]) const {
    const std::size_t channels = tracer_.channels();
    Doubles mean{};
    for (std::size_t c = 0; c < channels; ++c) {
        Doubles value;
        grid.gather(kernel, c, first_x_, y_, value);
        for (int i = 0; i < packet_size; ++i) {
            result.mean[c][i] = value.v[i];
            mean.v[i] += value.v[i] / static_cast<double>(channels);
        }
    }
    const GridRoughness rough = grid.roughness(channels, first_x_, y_);
    double block_mean = 0;
    double block_noise2 = 0;
    double pixels = 0;
    for (int i = 0; i < packet_size; ++i) {
        if (!result.covered[i]) continue;
        block_mean += mean.v[i];
        block_noise2 += rough.noise2.v[i];
        pixels += 1;
    }
    block_mean /= std::max(pixels, 1.0);
    block_noise2 /= std::max(pixels, 1.0);
    // At least as many as the grid's effective samples per pixel: fewer would be no better.
    const double floor = std::pow(kernel.noise, -3.0);
    for (int i = 0; i < packet_size; ++i) {
        // Smooth along the row, with pixels that will have samples of their own: they are where the grid is
        // rough, and without them the smooth rest would look better than it is.
        const double left = rough.noise2.v[std::max(i - 1, 0)];
        const double right = rough.noise2.v[std::min(i + 1, packet_size - 1)];
        result.variance[i] = (sunlight_only_ ? direct_grid_noise : 1.0) * kernel.independent *
                             (left + 2 * rough.noise2.v[i] + right) / 4;
        wanted[i] = 0;
        result.samples[i] = result.covered[i] ? 1 : 0;
        if (!result.covered[i]) continue;
        const double aim = goal(near, i, mean.v[i], block_mean);
        if (kernel.noise * rough.residual.v[i] > shared_error_margin * aim)
            wanted[i] =
                samples_for(std::max(rough.deviation.v[i] / (shared_refined_margin * aim), floor), 1, 1);
        if (sunlight_only_) continue;
        const double noise2 = std::max(rough.noise2.v[i], block_noise2);
        if (noise2 * kernel.independent > indirect_error_margin * indirect_error_margin * aim * aim)
            wanted[i] = std::max(wanted[i],
                                 indirect_samples_for(std::sqrt(noise2), 1, indirect_error_margin * aim, 2));
    }
}

bool BlockTracer::refine(const NearBodies& near, const BlockResult& result, bool first_round,
                         const Sums& sums, std::uint32_t (&wanted)[packet_size]) const {
    Doubles variance;
    sums.noise.variance(sunlight_only_, variance);
    double block_mean = 0;
    double block_spread2 = 0; // squares of what one sample would err by, if its error fell as n^-0.75
    double pixels = 0;
    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        block_mean += sums.noise.mean(i);
        block_spread2 += variance[i] * n * std::sqrt(n);
        pixels += 1;
    }
    if (pixels == 0) return false;
    block_mean /= pixels;
    block_spread2 /= pixels;
    bool more = false;
    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        const double aim = goal(near, i, sums.noise.mean(i), block_mean);
        double spread = std::sqrt(variance[i]) * three_quarter_power(n);
        double margin = refined_error_margin;
        if (first_round) {
            // Few samples: half the range over the pixel and its neighbours estimates the standard
            // deviation, and sees edges between pixels which all samples of a pixel miss.
            double least = sums.least[i];
            double largest = sums.most[i];
            for (const int k : {i - 1, i + 1})
                if (k >= 0 && k < packet_size && result.covered[k]) {
                    least = std::min(least, sums.least[k]);
                    largest = std::max(largest, sums.most[k]);
                }
            spread = (largest - least) / 2;
            margin = error_margin;
        }
        std::uint32_t count = 1;
        if (spread > margin * aim) count = samples_for(spread, margin * aim, near.samples);
        if (!sunlight_only_) {
            const double error = std::sqrt(std::max(variance[i], block_spread2 / (n * std::sqrt(n))));
            count =
                std::max(count, indirect_samples_for(error, n, indirect_error_margin * aim, near.samples));
        }
        if (count > sums.count[i]) {
            wanted[i] = count;
            more = true;
        }
    }
    return more;
}

bool BlockTracer::trace(std::int32_t block, std::int32_t y, BlockResult& result, NoiseSums* noise,
                        const SampleGridKernel* kernel, const SampleGrid* grid) {
    NearBodies near;
    if (grid != nullptr) {
        near = grid->near(block * packet_size, y);
        // Small bodies need more than one grid point per pixel.
        if (!near.large) grid = nullptr;
    }
    if (grid != nullptr && near.samples == 0) {
        std::fill(std::begin(result.covered), std::end(result.covered), false);
        return false;
    }
    Vec3s centre;
    set_block(block, y, centre);
    if (grid == nullptr) near = find_near(centre);
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
    sums.more = noise;
    std::uint32_t wanted[packet_size];
    int round = 0;
    if (grid != nullptr) {
        take_smooth(*kernel, *grid, near, result, wanted);
        if (std::all_of(std::begin(wanted), std::end(wanted), [](std::uint32_t n) { return n == 0; }))
            return true;
        // The grid knows only whether bodies are near; list them.
        near = find_near(centre);
        round = 1;
    } else {
        for (int i = 0; i < packet_size; ++i)
            wanted[i] = result.covered[i] ? near.samples : 0;
    }
    first_sample_ =
        sampling_.instant * std::max(near.samples, sampling_.target_error > 0 ? sampling_.max_samples : 0);
    sample(wanted, sums);

    // Further rounds: estimate the error, add samples where it exceeds the target.
    for (; sampling_.target_error > 0 && round < 2 && refine(near, result, round == 0, sums, wanted); ++round)
        sample(wanted, sums);

    // Compute means.
    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        result.samples[i] = sums.count[i];
        for (std::size_t c = 0; c < channels; ++c)
            result.mean[c][i] = sums.channel[c][i] / n;
    }
    return true;
}

void BlockTracer::trace_grid(std::int32_t block, std::int32_t y, const SampleGridKernel& kernel,
                             SampleGrid& grid) {
    Vec3s centre;
    set_block(block, y, centre);
    const NearBodies near = find_near(centre);
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

void BlockTracer::sample(const std::uint32_t (&wanted)[packet_size], Sums& sums) {
    Batch batch;
    for (int p = 0; p < packet_size; ++p) {
        for (std::uint32_t s = sums.count[p]; s < wanted[p]; ++s) {
            CameraRays& rays = batch.rays[batch.packets];
            batch.pixel[batch.packets][batch.lanes] = p;
            rays.index.v[batch.lanes] = first_sample_ + s;
            if (++batch.lanes < packet_size) continue;
            aim(batch);
            ++batch.packets;
            batch.lanes = 0;
            if (batch.packets == Tracer::batch_size) trace(batch, sums);
        }
        sums.count[p] = std::max(sums.count[p], wanted[p]);
    }
    if (batch.lanes > 0) aim(batch);
    if (batch.packets > 0 || batch.lanes > 0) trace(batch, sums);
}

void BlockTracer::aim(Batch& batch) const {
    const std::size_t k = batch.packets;
    CameraRays& rays = batch.rays[k];
    for (int i = batch.lanes; i < packet_size; ++i) {
        // Unused lanes repeat the last used one; they are switched off when traced.
        batch.pixel[k][i] = batch.pixel[k][batch.lanes - 1];
        rays.index.v[i] = rays.index.v[batch.lanes - 1];
    }
    Words lens;
    for (int i = 0; i < packet_size; ++i) {
        lens.v[i] = lens_seed_.v[batch.pixel[k][i]];
        rays.light_seed.v[i] = light_seed_.v[batch.pixel[k][i]];
    }
    Doubles u;
    Doubles v;
    sobol_pair(rays.index, lens, u, v);
    Doubles& x = batch.x[k];
    Doubles& y = batch.y[k];
    if (psf_ != nullptr) {
        for (int i = 0; i < packet_size; ++i) {
            x.v[i] = first_x_ + batch.pixel[k][i];
            y.v[i] = y_;
        }
        psf_->displace(u, v, tracer_.channels(), x, y, batch.psf_weight[k]);
        return;
    }
    gaussian_psf_.x.offsets(u, x);
    gaussian_psf_.y.offsets(v, y);
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] += first_x_ + batch.pixel[k][i];
        y.v[i] += y_;
    }
}

void BlockTracer::trace(Batch& batch, Sums& sums) {
    const std::size_t packets = batch.packets + (batch.lanes > 0 ? 1 : 0);
    const auto lanes_of = [&](std::size_t k) { return k < batch.packets ? packet_size : batch.lanes; };
    for (std::size_t k = 0; k < packets; ++k) {
        Lanes active;
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = i < lanes_of(k) ? -1 : 0;
        intersect(batch.x[k], batch.y[k], active, batch.rays[k], batch.solid_angle[k]);
    }
    tracer_.radiance({batch.rays, packets});
    const std::size_t channels = tracer_.channels();
    for (std::size_t k = 0; k < packets; ++k) {
        Channels& value = batch.rays[k].radiance;
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i) {
                value.v[c].v[i] *= batch.solid_angle[k].v[i];
                if (psf_ != nullptr) value.v[c].v[i] *= batch.psf_weight[k].v[c].v[i];
            }
        for (int i = 0; i < lanes_of(k); ++i) {
            const int p = batch.pixel[k][i];
            double v = 0;
            for (std::size_t c = 0; c < channels; ++c) {
                sums.channel[c][p] += value.v[c].v[i];
                v += value.v[c].v[i];
            }
            v /= static_cast<double>(channels);
            if (sampling_.target_error > 0) sums.noise.add(p, v);
            sums.least[p] = std::min(sums.least[p], v);
            sums.most[p] = std::max(sums.most[p], v);
            if (sums.more != nullptr) sums.more->add(p, v);
        }
    }
    batch.packets = 0;
    batch.lanes = 0;
}

void BlockTracer::intersect(const Doubles& x, const Doubles& y, const Lanes& active, CameraRays& rays,
                            Doubles& solid_angle) {
    projection_.rays(x, y, rays.direction, solid_angle);
    tracer_.intersect(rays.direction, active, candidates_, rays.hits);
    tracer_.count_samples(active);
    // Leave out what is splatted.
    for (int i = 0; i < packet_size; ++i) {
        std::int32_t& index = rays.hits.body[i];
        if (index >= 0 && row_.bodies[static_cast<std::size_t>(index)].splatted(rays.direction.lane(i)))
            index = -1;
    }
}

} // namespace obscura::renderer
