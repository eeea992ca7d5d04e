// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/block_tracer.hpp"

#include "renderer/camera/aberration.hpp"
#include "renderer/integrators/near_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

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

/// Into which samples are sorted by the place of the body that they fall on.
constexpr int parts = 16;

/// n^0.75
double three_quarter_power(double n) {
    const double root = std::sqrt(n);
    return root * std::sqrt(root);
}

} // namespace

struct BlockTracer::Batch {
    static constexpr std::size_t most = Tracer::batch_size * packet_size;

    /// The samples, those of a pixel in order.
    int pixel[most];
    std::uint32_t index[most];
    int slot[most]; ///< packet times packet_size plus lane; -1: no body is near, no ray
    std::size_t count = 0;

    std::size_t packets = 0;
    CameraRays rays[Tracer::batch_size];
    int pixel_at[Tracer::batch_size][packet_size];
    Lanes active[Tracer::batch_size];
    Doubles solid_angle[Tracer::batch_size];
    Channels psf_weight[Tracer::batch_size]; ///< with a Psf: see Psf::displace()
};

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

void BlockTracer::set_places(std::size_t body) {
    // Where the block's ends fall on the body, about, at the first instant and at the last: body frame.
    const auto place = [&](const RowState& row, int lane) {
        const BodyState& b = row.bodies[body];
        const double radius_m = b.shape->bounding_radius_m();
        const double near_m = std::max(length(b.camera_m) - radius_m, 0.1 * radius_m);
        return b.camera_m + b.from_camera * centre_.lane(lane) * near_m;
    };
    const Vec3 begin = place(instants_.states().front(), 0);
    const Vec3 along = place(instants_.states().front(), packet_size - 1) - begin;
    const Vec3 moved = place(instants_.states().back(), 0) - begin;
    // Order them along the longer diagonal of the parallelogram between those four.
    const Vec3 axis = dot(along, moved) < 0 ? along - moved : along + moved;
    const double by_pixel = dot(along, axis);
    const double by_time = dot(moved, axis);
    const double scale = parts / std::max(by_pixel + std::abs(by_time), std::numeric_limits<double>::min());
    place_of_pixel_ = by_pixel * scale / (packet_size - 1);
    place_of_time_ = by_time * scale;
    first_place_ = by_time < 0 ? -by_time * scale : 0;
}

void BlockTracer::aberrate_at(const Words& instant, Vec3s& direction) const {
    if (!aberration_) return;
    for (int i = 0; i < packet_size; ++i)
        direction.set(i, aberrate(direction.lane(i), -1.0 * instants_.at(instant, i).beta));
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
                         const Sums& sums, const Doubles& variance,
                         std::uint32_t (&wanted)[packet_size]) const {
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

void BlockTracer::sample(const std::uint32_t (&wanted)[packet_size], Sums& sums) {
    Batch batch;
    for (int p = 0; p < packet_size; ++p) {
        for (std::uint32_t s = sums.count[p]; s < wanted[p] && !sampling_.is_cancelled(); ++s) {
            batch.pixel[batch.count] = p;
            batch.index[batch.count] = s;
            if (++batch.count == Batch::most) trace(batch, sums);
        }
        sums.count[p] = std::max(sums.count[p], wanted[p]);
    }
    if (batch.count > 0) trace(batch, sums);
}

void BlockTracer::arrange(Batch& batch) const {
    std::int32_t order[Batch::most];
    Words instants[Tracer::batch_size];
    const int used =
        instants_.one() ? static_cast<int>(batch.count) : sort_by_instant(batch, instants, order);
    const std::int32_t count = static_cast<std::int32_t>(batch.count);
    if (instants_.one()) std::iota(order, order + count, 0);
    batch.packets = static_cast<std::size_t>((used + packet_size - 1) / packet_size);
    for (int k = 0; k < static_cast<int>(batch.packets); ++k) {
        CameraRays& rays = batch.rays[k];
        for (int i = 0; i < packet_size; ++i) {
            // Unused lanes repeat the last used one, switched off.
            const int slot = k * packet_size + i;
            const std::int32_t sample = order[std::min(slot, used - 1)];
            batch.pixel_at[k][i] = batch.pixel[sample];
            rays.index.v[i] = batch.index[sample];
            if (!instants_.one()) rays.instant.v[i] = instants[sample / packet_size].v[sample % packet_size];
            batch.active[k].on[i] = slot < used ? -1 : 0;
            if (slot < used) batch.slot[sample] = slot;
        }
    }
}

int BlockTracer::sort_by_instant(Batch& batch, Words (&instants)[Tracer::batch_size],
                                 std::int32_t (&order)[Batch::most]) const {
    const auto count = static_cast<int>(batch.count);
    // Counting sort.
    int begin[parts + 1] = {};
    std::int32_t part[Batch::most];
    bool test_hulls = true;
    for (int first = 0; first < count; first += packet_size) {
        Doubles u;
        Vec3s centre;
        choose_instants(batch, first, u, instants[first / packet_size], centre);
        Lanes near;
        test_hulls = find_near_at(instants[first / packet_size], centre, test_hulls, near);
        for (int i = 0; i < packet_size && first + i < count; ++i) {
            const double place =
                first_place_ + place_of_pixel_ * batch.pixel[first + i] + place_of_time_ * u.v[i];
            part[first + i] = near.on[i] != 0 ? std::clamp(static_cast<int>(place), 0, parts - 1) : parts;
            ++begin[part[first + i]];
            batch.slot[first + i] = -1;
        }
    }
    int used = 0;
    for (int p = 0; p < parts; ++p)
        used += std::exchange(begin[p], used);
    for (int s = 0; s < count; ++s)
        if (part[s] < parts) order[begin[part[s]]++] = s;
    return used;
}

void BlockTracer::choose_instants(const Batch& batch, int first, Doubles& u, Words& instant,
                                  Vec3s& centre) const {
    Words index;
    Words seed;
    for (int i = 0; i < packet_size; ++i) {
        const int sample = std::min(first + i, static_cast<int>(batch.count) - 1);
        const int pixel = batch.pixel[sample];
        index.v[i] = batch.index[sample];
        seed.v[i] = lens_seed_.v[pixel];
        centre.set(i, centre_.lane(pixel));
    }
    sobol_third(index, seed, u);
    for (int i = 0; i < packet_size; ++i)
        instant.v[i] = static_cast<std::uint32_t>(u.v[i] * static_cast<double>(instants_.count()));
    aberrate_at(instant, centre);
}

bool BlockTracer::find_near_at(const Words& instant, const Vec3s& centre, bool test_hulls,
                               Lanes& near) const {
    Lanes in_cone{};
    near = {};
    for (const std::int32_t body : candidates_) {
        Lanes own;
        if (!near_cone_at(instants_, body, instant, centre, own)) continue;
        for (int i = 0; i < packet_size; ++i)
            in_cone.on[i] |= own.on[i];
        if (test_hulls) near_hull_at(instants_, body, instant, centre, own);
        for (int i = 0; i < packet_size; ++i)
            near.on[i] |= own.on[i];
    }
    // Where few rays would miss, tracing them costs less than finding them.
    return test_hulls && (4 * near.count() < 3 * in_cone.count() || !in_cone.any());
}

void BlockTracer::aim(Batch& batch, std::size_t k, Doubles& x, Doubles& y) const {
    CameraRays& rays = batch.rays[k];
    Words lens;
    for (int i = 0; i < packet_size; ++i) {
        lens.v[i] = lens_seed_.v[batch.pixel_at[k][i]];
        rays.light_seed.v[i] = light_seed_.v[batch.pixel_at[k][i]];
    }
    Doubles u;
    Doubles v;
    sobol_pair(rays.index, lens, u, v);
    if (psf_ != nullptr) {
        for (int i = 0; i < packet_size; ++i) {
            x.v[i] = first_x_ + batch.pixel_at[k][i];
            y.v[i] = y_;
        }
        psf_->displace(u, v, tracer_.channels(), x, y, batch.psf_weight[k]);
        return;
    }
    gaussian_psf_.x.offsets(u, x);
    gaussian_psf_.y.offsets(v, y);
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] += first_x_ + batch.pixel_at[k][i];
        y.v[i] += y_;
    }
}

void BlockTracer::trace(Batch& batch, Sums& sums) {
    arrange(batch);
    for (std::size_t k = 0; k < batch.packets; ++k) {
        Doubles x;
        Doubles y;
        aim(batch, k, x, y);
        intersect(x, y, batch.active[k], batch.rays[k], batch.solid_angle[k]);
    }
    tracer_.radiance({batch.rays, batch.packets});
    const std::size_t channels = tracer_.channels();
    for (std::size_t k = 0; k < batch.packets; ++k)
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i) {
                double& value = batch.rays[k].radiance.v[c].v[i];
                value *= batch.solid_angle[k].v[i];
                if (psf_ != nullptr) value *= batch.psf_weight[k].v[c].v[i];
            }
    for (std::size_t s = 0; s < batch.count; ++s) {
        const int p = batch.pixel[s];
        double v = 0;
        if (const int slot = batch.slot[s]; slot >= 0) {
            const Channels& radiance = batch.rays[slot / packet_size].radiance;
            for (std::size_t c = 0; c < channels; ++c) {
                const double value = radiance.v[c].v[slot % packet_size];
                sums.channel[c][p] += value;
                v += value;
            }
            if (channels > 1) v /= static_cast<double>(channels);
        }
        if (sampling_.target_error > 0) {
            sums.least[p] = std::min(sums.least[p], v);
            sums.most[p] = std::max(sums.most[p], v);
        }
        if (sums.adds_to_noise) sums.noise.add(p, v);
    }
    batch.count = 0;
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
