// SPDX-License-Identifier: Apache-2.0
// Samples of BlockTracer: their batches, sorted by instant and place, aimed and traced.
#include "renderer/integrators/block_tracer.hpp"
#include "renderer/integrators/near_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace obscura::renderer {
namespace {

/// Parts into which samples are sorted by the place of the body that they fall on.
constexpr int parts = 16;

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

} // namespace obscura::renderer
