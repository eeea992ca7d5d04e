// SPDX-License-Identifier: Apache-2.0
// Rays and hits in structure-of-arrays packets of 16, the width of all interfaces of the renderer.
#pragma once

#include "core/geometry.hpp"
#include "core/math/vector_clones.hpp"

#include <cstdint>
#include <limits>

namespace obscura::renderer {

struct DetailView;

constexpr int packet_size = 16;
constexpr double no_hit = std::numeric_limits<double>::infinity();

struct alignas(64) Doubles {
    double v[packet_size];
    double& operator[](int i) { return v[i]; }
    double operator[](int i) const { return v[i]; }
};

/// Mask of active lanes of a packet: -1 or 0 each, as Embree expects.
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
    bool coherent = true; ///< similar directions: a hint for traversal
    /// Lengths in this frame of a unit of the distances that callers count, where the body moves along the
    /// light (renderer/world/light_time.hpp); only if `stretched`, else 1.
    Doubles stretch;
    bool stretched = false;
    /// Level of detail of terrain (detail_view.hpp), for the body that is traced next; null: a fixed one.
    const DetailView* detail = nullptr;
    /// Only direct sunlight is wanted of the hits: where none can be, they need not be exact.
    bool sunlight_only = false;
    /// Rounding of the origins beyond that of lengths of the body's size, m: of coordinates far from it.
    double origin_error_m = 0;
    Doubles level_u; ///< with `detail`: the sample's own random number, in [0,1), the same along its path
};

/// Nearest hits of the rays of a packet. A shape replaces a hit only by a nearer one.
struct HitPacket {
    Doubles t; ///< distance along the ray, m; no_hit: none
    alignas(64) std::int32_t body[packet_size];
    alignas(64) std::uint32_t primitive[packet_size];
    alignas(64) float u[packet_size]; ///< barycentric; meaning set by the shape
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

/// Surface at the hits of one body, in the body frame.
struct SurfacePacket {
    Vec3s position;
    Vec3s shadow_origin; ///< origin of secondary rays: clear of the surface, outside
    Vec3s normal;        ///< shading normal, unit
    Vec3s facet_normal;  ///< geometric normal, unit
    Lanes outside;       ///< -1 where the ray came from outside
};

constexpr std::size_t max_channels = 16;

/// Spectral values of 16 samples, one Doubles per channel.
struct Channels {
    Doubles v[max_channels];
};

/// Mean over a ray's width of the surface that sees the Sun, where it is kept, in the body frame.
struct SunlitPacket {
    Lanes known;     ///< -1 where it is kept
    Vec3s position;  ///< of the hit
    Vec3s normal;    ///< mean of the normals that see the Sun, unit
    Doubles visible; ///< its length before: the share of the Sun that is seen, where normals agree
};

/// Texture coordinates at the hits of one body, lane by lane.
struct UvPacket {
    Doubles u, v;         ///< u to the right, v down; 1 each across the image
    Vec3s grad_u, grad_v; ///< their gradients on the surface, body frame, 1/m
};

} // namespace obscura::renderer
