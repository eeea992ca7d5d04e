#include "renderer/block_tracer.hpp"

#include "renderer/frames.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// The estimate of a pixel's error errs on the safe side, and most pixels need nothing: the error over all
/// pixels is this much smaller than that aimed at in each (see the test of adaptive sampling, which measures
/// it).
constexpr double error_margin = 2.3;
/// The same for pixels that share a grid, whose error is estimated by what is left of its points about a
/// plane: most of that is detail that the grid still resolves.
constexpr double shared_error_margin = 7;
/// The pixels that need more are then few.
constexpr double refined_error_margin = 3.5;

/// Which of 16 directions lie within `chord2` of `axis`.
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

BlockTracer::BlockTracer(const Projection& projection, const Footprint& footprint, const Psf* psf,
                         const Sampling& sampling, const RowState& row, Tracer& tracer,
                         std::vector<std::int32_t>& candidates)
    : projection_(projection),
      footprint_(footprint),
      psf_(psf),
      sampling_(sampling),
      row_(row),
      tracer_(tracer),
      candidates_(candidates) {}

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
}

NearBodies BlockTracer::find_near(std::int32_t block, std::int32_t y) {
    Vec3s centre;
    set_block(block, y, centre);
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
        found.reference = std::max(found.reference, body.reference_radiance);
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

void BlockTracer::take_calm(const LatticeKernel& kernel, const Lattice& lattice, const NearBodies& near,
                            BlockResult& result, std::uint32_t (&wanted)[packet_size]) const {
    const std::size_t channels = tracer_.channels();
    Doubles mean{};
    for (std::size_t c = 0; c < channels; ++c) {
        Doubles value;
        lattice.gather(kernel, c, first_x_, y_, value);
        for (int i = 0; i < packet_size; ++i) {
            result.mean[c][i] = value.v[i];
            mean.v[i] += value.v[i] / static_cast<double>(channels);
        }
    }
    const double floor = std::pow(kernel.noise, -3.0);
    Doubles deviation;
    Doubles residual;
    lattice.roughness(channels, first_x_, y_, deviation, residual);
    for (int i = 0; i < packet_size; ++i) {
        wanted[i] = 0;
        const double error = kernel.noise * residual.v[i];
        result.variance[i] = error * error;
        result.samples[i] = result.covered[i] ? 1 : 0;
        if (!result.covered[i]) continue;
        const double aim = shared_error_margin * sampling_.target_error *
                           std::max(near.reference * solid_angle_.v[i], mean.v[i]);
        // Fewer than the points that the grid puts into a pixel would be no better than it.
        if (error > aim)
            wanted[i] = samples_for(
                std::max(deviation.v[i] / aim * (shared_error_margin / refined_error_margin), floor), 1, 1);
    }
}

bool BlockTracer::trace(std::int32_t block, std::int32_t y, BlockResult& result, const LatticeKernel* kernel,
                        const Lattice* lattice) {
    NearBodies near;
    if (lattice != nullptr) {
        near = lattice->near(block * packet_size, y);
        // Small bodies are not left to one point a pixel.
        if (!near.large) lattice = nullptr;
    }
    if (lattice == nullptr) near = find_near(block, y);
    for (int i = 0; i < packet_size; ++i)
        result.covered[i] = (near.covered >> i & 1u) != 0;
    if (near.samples == 0) return false;

    Sums sums;
    const std::size_t channels = tracer_.channels();
    for (std::size_t c = 0; c < channels; ++c)
        std::fill(std::begin(sums.channel[c]), std::end(sums.channel[c]), 0.0);
    std::fill(std::begin(sums.least), std::end(sums.least), no_hit);
    std::fill(std::begin(sums.most), std::end(sums.most), -no_hit);
    std::uint32_t wanted[packet_size];
    int round = 0;
    double margin = error_margin;
    if (lattice != nullptr) {
        Vec3s centre;
        set_block(block, y, centre);
        take_calm(*kernel, *lattice, near, result, wanted);
        if (std::all_of(std::begin(wanted), std::end(wanted), [](std::uint32_t n) { return n == 0; }))
            return true;
        (void)find_near(block, y);
        round = 1;
        margin = refined_error_margin;
    } else {
        for (int i = 0; i < packet_size; ++i)
            wanted[i] = result.covered[i] ? near.samples : 0;
    }
    pixel_seeds(sampling_.seed, sampling_.frame_id, first_x_, y, lens_seed_, light_seed_);
    sample(wanted, sums);

    for (; sampling_.target_error > 0 && round < 2; ++round) {
        bool more = false;
        for (int i = 0; i < packet_size; ++i) {
            const std::uint32_t n = sums.count[i];
            if (n == 0) continue;
            double spread = 0;
            if (round == 0) {
                // Few samples of its own: the range over the pixel and its neighbours stands in for twice
                // the deviation.
                double least = sums.least[i];
                double largest = sums.most[i];
                for (const int k : {i - 1, i + 1})
                    if (k >= 0 && k < packet_size && result.covered[k]) {
                        least = std::min(least, sums.least[k]);
                        largest = std::max(largest, sums.most[k]);
                    }
                spread = (largest - least) / 2;
            } else {
                const double mean = sums.sum[i] / n;
                spread = std::sqrt(std::max(0.0, (sums.square[i] - sums.sum[i] * mean) / (n - 1)));
            }
            const double aim = margin * sampling_.target_error *
                               std::max(near.reference * solid_angle_.v[i], sums.sum[i] / n);
            if (!(spread > aim)) continue;
            const std::uint32_t count = samples_for(spread, aim, near.samples);
            if (count > n) {
                wanted[i] = count;
                more = true;
            }
        }
        if (!more) break;
        sample(wanted, sums);
    }

    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        result.samples[i] = sums.count[i];
        const double mean = sums.sum[i] / n;
        for (std::size_t c = 0; c < channels; ++c)
            result.mean[c][i] = sums.channel[c][i] / n;
        result.variance[i] =
            n > 1 ? std::max(0.0, (sums.square[i] - sums.sum[i] * mean) / (n - 1) / (n * std::sqrt(n))) : 0;
    }
    return true;
}

void BlockTracer::trace_lattice(std::int32_t block, std::int32_t y, const LatticeKernel& kernel,
                                Lattice& lattice) {
    const NearBodies near = find_near(block, y);
    lattice.near(block * packet_size, y) = near;
    if (near.samples == 0) return;
    pixel_seeds(sampling_.seed, sampling_.frame_id, first_x_, y, lens_seed_, light_seed_);
    Doubles x;
    Doubles row_y;
    Words index{};
    Lanes active;
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] = first_x_ + i + kernel.shift_x;
        row_y.v[i] = y + kernel.shift_y;
        active.on[i] = (near.covered >> i & 1u) != 0 ? -1 : 0;
    }
    Channels value;
    trace_points(x, row_y, index, light_seed_, active, value);
    for (std::size_t c = 0; c < tracer_.channels(); ++c) {
        float* out = lattice.row(c, y) + (first_x_ - lattice.first_x());
        for (int i = 0; i < packet_size; ++i)
            out[i] = active.on[i] != 0 ? static_cast<float>(value.v[c].v[i]) : 0.0F;
    }
}

void BlockTracer::sample(const std::uint32_t (&wanted)[packet_size], Sums& sums) {
    int pixel[packet_size];
    Words index;
    Lanes active;
    int lanes = 0;
    const std::size_t channels = tracer_.channels();
    const auto flush = [&] {
        for (int i = lanes; i < packet_size; ++i) {
            // Unused lanes repeat the last used one, switched off.
            pixel[i] = pixel[lanes - 1];
            index.v[i] = index.v[lanes - 1];
        }
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = i < lanes ? -1 : 0;
        Channels value;
        trace_lanes(pixel, index, active, value);
        for (int i = 0; i < lanes; ++i) {
            const int p = pixel[i];
            double v = 0;
            for (std::size_t c = 0; c < channels; ++c) {
                sums.channel[c][p] += value.v[c].v[i];
                v += value.v[c].v[i];
            }
            v /= static_cast<double>(channels);
            sums.sum[p] += v;
            sums.square[p] += v * v;
            sums.least[p] = std::min(sums.least[p], v);
            sums.most[p] = std::max(sums.most[p], v);
        }
        lanes = 0;
    };
    for (int p = 0; p < packet_size; ++p) {
        for (std::uint32_t s = sums.count[p]; s < wanted[p]; ++s) {
            pixel[lanes] = p;
            index.v[lanes] = s;
            if (++lanes == packet_size) flush();
        }
        sums.count[p] = std::max(sums.count[p], wanted[p]);
    }
    if (lanes > 0) flush();
}

void BlockTracer::trace_lanes(const int (&pixel)[packet_size], const Words& index, const Lanes& active,
                              Channels& value) {
    Words lens;
    Words light;
    for (int i = 0; i < packet_size; ++i) {
        lens.v[i] = lens_seed_.v[pixel[i]];
        light.v[i] = light_seed_.v[pixel[i]];
    }
    Doubles u;
    Doubles v;
    sobol_pair(index, lens, u, v);
    Doubles x;
    Doubles y;
    if (psf_ != nullptr) {
        for (int i = 0; i < packet_size; ++i) {
            x.v[i] = first_x_ + pixel[i];
            y.v[i] = y_;
        }
        Channels worth;
        psf_->displace(u, v, tracer_.channels(), x, y, worth);
        trace_points(x, y, index, light, active, value);
        for (std::size_t c = 0; c < tracer_.channels(); ++c)
            for (int i = 0; i < packet_size; ++i)
                value.v[c].v[i] *= worth.v[c].v[i];
        return;
    }
    footprint_.offsets(u, x);
    footprint_.offsets(v, y);
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] += first_x_ + pixel[i];
        y.v[i] += y_;
    }
    trace_points(x, y, index, light, active, value);
}

void BlockTracer::trace_points(const Doubles& x, const Doubles& y, const Words& index,
                               const Words& light_seed, const Lanes& active, Channels& value) {
    Vec3s direction;
    Doubles solid_angle;
    projection_.rays(x, y, direction, solid_angle);
    HitPacket hits;
    tracer_.intersect(direction, active, candidates_, hits);
    tracer_.count_samples(active);
    for (std::int32_t& body : hits.body)
        if (body >= 0 && row_.bodies[static_cast<std::size_t>(body)].targeted) body = -1;
    SampleStream random(index, light_seed);
    tracer_.radiance(direction, hits, random, value);
    for (std::size_t c = 0; c < tracer_.channels(); ++c)
        for (int i = 0; i < packet_size; ++i)
            value.v[c].v[i] *= solid_angle.v[i];
}

} // namespace obscura::renderer
