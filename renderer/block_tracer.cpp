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

BlockTracer::BlockTracer(const Projection& projection, const Footprint& footprint, const Sampling& sampling,
                         const RowState& row, Tracer& tracer, std::vector<std::int32_t>& candidates)
    : projection_(projection),
      footprint_(footprint),
      sampling_(sampling),
      row_(row),
      tracer_(tracer),
      candidates_(candidates) {}

bool BlockTracer::trace(std::int32_t block, std::int32_t y, BlockResult& result) {
    first_x_ = block * packet_size;
    y_ = y;
    Doubles x;
    Doubles row_y;
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] = first_x_ + i;
        row_y.v[i] = y;
    }
    Vec3s centre;
    Doubles solid_angle;
    projection_.rays(x, row_y, centre, solid_angle);

    std::uint32_t samples = 0;
    double reference = 0;
    candidates_.clear();
    std::fill(std::begin(result.covered), std::end(result.covered), false);
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
            result.covered[i] = result.covered[i] || near.on[i] != 0;
        samples = std::max(samples, body.samples);
        reference = std::max(reference, body.reference_radiance);
    }
    if (samples == 0) return false;
    pixel_seeds(sampling_.seed, sampling_.frame_id, first_x_, y, lens_seed_, light_seed_);

    Sums sums;
    const std::size_t channels = tracer_.channels();
    for (std::size_t c = 0; c < channels; ++c)
        std::fill(std::begin(sums.channel[c]), std::end(sums.channel[c]), 0.0);
    std::fill(std::begin(sums.least), std::end(sums.least), no_hit);
    std::fill(std::begin(sums.most), std::end(sums.most), -no_hit);
    std::uint32_t wanted[packet_size];
    for (int i = 0; i < packet_size; ++i)
        wanted[i] = result.covered[i] ? samples : 0;
    sample(wanted, sums);

    const std::uint32_t most = std::max(samples, sampling_.max_samples);
    for (int round = 0; sampling_.target_error > 0 && round < 2; ++round) {
        bool more = false;
        for (int i = 0; i < packet_size; ++i) {
            if (!result.covered[i]) continue;
            const std::uint32_t n = sums.count[i];
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
            const double aim = error_margin * sampling_.target_error *
                               std::max(reference * solid_angle.v[i], sums.sum[i] / n);
            if (!(spread > aim)) continue;
            // n^0.75 = spread / aim, rounded up to a power of two: Sobol points are best there.
            const double ratio2 = spread * spread / (aim * aim);
            std::uint32_t count = 1;
            while (count < most && static_cast<double>(count) * count * count < ratio2 * ratio2)
                count *= 2;
            const auto limited = std::min(count, most);
            if (limited > n) {
                wanted[i] = limited;
                more = true;
            }
        }
        if (!more) break;
        sample(wanted, sums);
    }

    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        result.samples[i] = sums.count[i];
        const double mean = n > 0 ? sums.sum[i] / n : 0;
        for (std::size_t c = 0; c < channels; ++c)
            result.mean[c][i] = n > 0 ? sums.channel[c][i] / n : 0;
        result.variance[i] =
            n > 1 ? std::max(0.0, (sums.square[i] - sums.sum[i] * mean) / (n - 1) / (n * std::sqrt(n))) : 0;
    }
    return true;
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
    footprint_.offsets(u, x);
    footprint_.offsets(v, y);
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] += first_x_ + pixel[i];
        y.v[i] += y_;
    }
    Vec3s direction;
    Doubles solid_angle;
    projection_.rays(x, y, direction, solid_angle);
    HitPacket hits;
    tracer_.intersect(direction, active, candidates_, hits);
    tracer_.count_samples(active);
    for (std::int32_t& body : hits.body)
        if (body >= 0 && row_.bodies[static_cast<std::size_t>(body)].targeted) body = -1;
    SampleStream random(index, light);
    tracer_.radiance(direction, hits, random, value);
    for (std::size_t c = 0; c < tracer_.channels(); ++c)
        for (int i = 0; i < packet_size; ++i)
            value.v[c].v[i] *= solid_angle.v[i];
}

} // namespace obscura::renderer
