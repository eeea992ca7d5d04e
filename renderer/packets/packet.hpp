// SPDX-License-Identifier: Apache-2.0
// Rays and hits in structure-of-arrays packets of 16: the width every interface of the renderer works in.
#pragma once

#include "core/geometry.hpp"

#include <cstdint>
#include <limits>

/// Compiles a hot loop for several instruction sets and picks one at start-up. The results are the same on
/// all of them: IEEE operations only, no fusing (-ffp-contract=off). Off under sanitizers, whose run time is
/// not up when the loader resolves the choice.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(OBSCURA_SANITIZED)
#define OBSCURA_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define OBSCURA_VECTOR_CLONES
#endif

namespace obscura::renderer {

constexpr int packet_size = 16;
constexpr double no_hit = std::numeric_limits<double>::infinity();

struct alignas(64) Doubles {
    double v[packet_size];
    double& operator[](int i) { return v[i]; }
    double operator[](int i) const { return v[i]; }
};

/// Which lanes of a packet take part: -1 or 0 each, as Embree wants it.
struct alignas(64) Lanes {
    std::int32_t on[packet_size];

    [[nodiscard]] bool any() const {
        std::int32_t all = 0;
        for (const std::int32_t lane : on)
            all |= lane;
        return all != 0;
    }
    [[nodiscard]] int count() const {
        std::int32_t sum = 0;
        for (const std::int32_t lane : on)
            sum -= lane;
        return sum;
    }
};

struct Vec3s {
    Doubles x, y, z;

    [[nodiscard]] Vec3 lane(int i) const { return {x[i], y[i], z[i]}; }
    void set(int i, Vec3 a) {
        x[i] = a.x;
        y[i] = a.y;
        z[i] = a.z;
    }
};

/// 16 rays in one frame. Directions are unit vectors; `t_max` bounds the search.
struct RayPacket {
    Vec3s origin, direction;
    Doubles t_max;
    Lanes active;
    bool coherent = true; ///< they go much the same way: a hint to who looks for what they meet
};

/// What the rays of a packet met. A shape only ever replaces a farther hit by a nearer one.
struct HitPacket {
    Doubles t; ///< distance along the ray, metres; no_hit where nothing was met
    alignas(64) std::int32_t body[packet_size];
    alignas(64) std::uint32_t primitive[packet_size];
    alignas(64) float u[packet_size]; ///< barycentric, as the shape understands them
    alignas(64) float v[packet_size];

    void clear() {
        for (int i = 0; i < packet_size; ++i) {
            t[i] = no_hit;
            body[i] = -1;
            primitive[i] = 0;
            u[i] = v[i] = 0;
        }
    }
};

/// The surface at the hits of one body, in that body's frame.
struct SurfacePacket {
    Vec3s position;
    Vec3s shadow_origin; ///< where shadow rays start: clear of the surface on its outer side
    Vec3s normal;        ///< for shading, unit
    Vec3s facet_normal;  ///< of the surface itself, unit
    Lanes outside;       ///< -1 where the ray came from outside
};

constexpr std::size_t max_channels = 16;

/// What 16 samples carry, one Doubles per channel.
struct Channels {
    Doubles v[max_channels];
};

/// Where the hits of one body lie in its texture, lane by lane.
struct ChartPacket {
    Doubles u, v;         ///< u to the right, v down; 1 each across the image
    Vec3s grad_u, grad_v; ///< their gradients on the surface, body frame, 1/m
};

} // namespace obscura::renderer
