// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/single_ray.hpp"

#include <algorithm>
#include <cstddef>

namespace obscura::renderer {

namespace {

template<typename Origin>
void trace_packets(const Shape& shape, const Origin& origin_of, std::span<const Vec3> directions,
                   std::span<double> distances, const DetailView* detail) {
    for (std::size_t first = 0; first < directions.size(); first += packet_size) {
        const std::size_t count = std::min(directions.size() - first, std::size_t{packet_size});
        RayPacket rays;
        HitPacket hits;
        hits.clear();
        rays.detail = detail;
        for (std::size_t i = 0; i < packet_size; ++i) {
            const int lane = static_cast<int>(i);
            const std::size_t ray = first + std::min(i, count - 1);
            rays.origin.set(lane, origin_of(ray));
            rays.direction.set(lane, directions[ray]);
            rays.t_max[lane] = no_hit;
            rays.active.on[i] = i < count ? -1 : 0;
            rays.level_u[lane] = 0.5;
        }
        shape.intersect(rays, 0, hits);
        std::copy_n(hits.t.v, count, distances.begin() + static_cast<std::ptrdiff_t>(first));
    }
}

} // namespace

void distances_along(const Shape& shape, std::span<const Vec3> origins, std::span<const Vec3> directions,
                     std::span<double> distances, const DetailView* detail) {
    trace_packets(
        shape, [&](std::size_t i) { return origins[i]; }, directions, distances, detail);
}

void distances_along(const Shape& shape, Vec3 origin, std::span<const Vec3> directions,
                     std::span<double> distances, const DetailView* detail) {
    trace_packets(
        shape, [&](std::size_t /*i*/) { return origin; }, directions, distances, detail);
}

double distance_along(const Shape& shape, Vec3 origin, Vec3 direction, const DetailView* detail) {
    double distance = no_hit;
    distances_along(shape, origin, {&direction, 1}, {&distance, 1}, detail);
    return distance;
}

} // namespace obscura::renderer
