// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/elevation_guide.hpp"

#include "core/geometry.hpp"
#include "renderer/materials/hemisphere.hpp"
#include "renderer/packets/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace obscura::renderer {
namespace {

/// Packets of parallel rays that find points of the surface from outside.
constexpr std::uint32_t packets = 64;
/// Share of the rays that stay cosine-weighted, for what other bodies reflect.
constexpr double cosine_share = 0.5;
/// Least chance to meet the body that Russian roulette expects, for places that are unlike the rest of it.
constexpr double min_chance = 0.15;

/// Random numbers of the 16 rays of a packet, stratified over all packets.
void pairs(std::uint32_t packet, std::uint32_t purpose, Doubles& u, Doubles& v) {
    Words index;
    Words seed;
    for (int i = 0; i < packet_size; ++i) {
        index[i] = packet * packet_size + static_cast<std::uint32_t>(i);
        seed[i] = purpose * 0x9e3779b9u;
    }
    sobol_pair(index, seed, u, v);
}

/// Rays from outside the bounding sphere towards points of discs across it, in all directions.
RayPacket rays_from_outside(std::uint32_t packet, double radius_m) {
    Doubles z;
    Doubles turn;
    Doubles ring;
    Doubles azimuth;
    pairs(packet, 1, z, turn);
    pairs(packet, 2, ring, azimuth);
    RayPacket rays;
    rays.coherent = false;
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 from = around({0, 0, 1}, 2 * z[i] - 1, turn[i]);
        const Vec3 across = around(from, 0, azimuth[i]);
        rays.origin.set(i, 2 * radius_m * from + std::sqrt(ring[i]) * radius_m * across);
        rays.direction.set(i, -1 * from);
        rays.t_max[i] = no_hit;
        rays.active.on[i] = -1;
    }
    return rays;
}

} // namespace

ElevationGuide::ElevationGuide(const Shape& shape, bool alone) {
    std::array<double, intervals> width{};
    for (std::size_t k = 0; k < intervals; ++k) {
        first_[k] = k == 0 ? 0 : std::ldexp(1.0, static_cast<int>(k) - static_cast<int>(intervals));
        width[k] = k == 0 ? std::ldexp(1.0, 1 - static_cast<int>(intervals)) : first_[k];
    }
    std::array<std::uint64_t, intervals> met{};
    std::uint64_t tried = 0;
    for (std::uint32_t packet = 0; packet < packets; ++packet) {
        const RayPacket seen = rays_from_outside(packet, shape.bounding_radius_m());
        HitPacket hits;
        hits.clear();
        shape.intersect(seen, 0, hits);
        Lanes found;
        for (int i = 0; i < packet_size; ++i)
            found.on[i] = hits.body[i] == 0 ? -1 : 0;
        if (!found.any()) continue;
        SurfacePacket surface;
        shape.surface(seen, hits, 0, surface);
        tried += static_cast<std::uint64_t>(found.count());
        for (std::size_t k = 0; k < intervals; ++k) {
            Doubles u;
            Doubles v;
            pairs(packet, 3 + static_cast<std::uint32_t>(k), u, v);
            RayPacket up;
            up.coherent = false;
            up.origin = surface.shadow_origin;
            up.active = found;
            for (int i = 0; i < packet_size; ++i) {
                up.t_max[i] = no_hit;
                up.direction.set(i, {0, 0, 1});
                if (found.on[i] == 0) continue;
                const Vec3 direction =
                    around(surface.facet_normal.lane(i), std::sqrt(first_[k] + u[i] * width[k]), v[i]);
                up.direction.set(i, direction);
            }
            shape.occlude(up);
            for (int i = 0; i < packet_size; ++i)
                met[k] += found.on[i] != 0 && up.active.on[i] == 0 ? 1 : 0;
        }
    }
    if (tried == 0) return;
    double sum = 0;
    for (std::size_t k = 0; k < intervals; ++k) {
        const double share = static_cast<double>(met[k]) / static_cast<double>(tried);
        density_[k] = std::sqrt(share);
        expectation_[k] = alone ? std::max(share, min_chance) : 1;
        sum += density_[k] * width[k];
    }
    if (!(sum > 0)) return;
    guides_ = true;
    for (std::size_t k = 0; k < intervals; ++k) {
        density_[k] = cosine_share + (1 - cosine_share) * density_[k] / sum;
        expectation_[k] *= density_[k];
        inverse_density_[k] = 1 / density_[k];
        cumulated_[k + 1] = cumulated_[k] + density_[k] * width[k];
    }
}

OBSCURA_VECTOR_CLONES
void ElevationGuide::sample(const Doubles& u, Doubles& cos2, Doubles& density, Doubles& expectation) const {
    // The interval of each number: how many of them begin at or below it.
    std::array<double, packet_size> interval{};
    for (std::size_t k = 1; k < intervals; ++k) {
        const double from = cumulated_[k];
        for (int i = 0; i < packet_size; ++i)
            interval[static_cast<std::size_t>(i)] += u.v[i] >= from ? 1.0 : 0.0;
    }
    for (int i = 0; i < packet_size; ++i) {
        const auto k = static_cast<std::size_t>(interval[static_cast<std::size_t>(i)]);
        const double value = first_[k] + (u.v[i] - cumulated_[k]) * inverse_density_[k];
        cos2.v[i] = std::min(value, 0x1.fffffffffffffp-1);
        density.v[i] = density_[k];
        expectation.v[i] = expectation_[k];
    }
}

double ElevationGuide::density(double cos2) const {
    std::size_t k = intervals - 1;
    while (k > 0 && cos2 < first_[k])
        --k;
    return density_[k];
}

} // namespace obscura::renderer
