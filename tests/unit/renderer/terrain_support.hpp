// SPDX-License-Identifier: Apache-2.0
// Terrain of a function and rays for tests of terrains.
#pragma once

#include "renderer/planets/height_tables.hpp"
#include "terrain_function.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <numbers>

namespace obscura::test {

using namespace obscura::renderer;

/// Table of a map of the whole body without a label, from -180 to 180 degrees.
inline HeightTable whole_body_map(const std::string& file) {
    HeightTable table;
    table.file = file;
    table.map.projection = terrain::ProjectionKind::simple_cylindrical;
    return table;
}

/// One ray in lane 5 of a packet.
struct OneRay {
    static constexpr int lane = 5;
    RayPacket rays;
    HitPacket hits;

    OneRay(Vec3 origin, Vec3 direction, const DetailView* detail = nullptr, double level_u = 0.5) {
        hits.clear();
        for (int i = 0; i < packet_size; ++i) {
            rays.origin.set(i, origin);
            rays.direction.set(i, direction);
            rays.t_max[i] = no_hit;
            rays.active.on[i] = i == lane ? -1 : 0;
            rays.level_u[i] = level_u;
        }
        rays.detail = detail;
    }
    /// Distance to a shape; no_hit: none.
    double meet(const Shape& shape) {
        shape.intersect(rays, 2, hits);
        RayPacket shadow = rays;
        shape.occlude(shadow);
        CHECK((shadow.active.on[lane] == 0) == (hits.body[lane] == 2));
        return hits.t[lane];
    }
    SurfacePacket surface(const Shape& shape) {
        SurfacePacket out;
        shape.surface(rays, hits, 2, out);
        return out;
    }
};

inline double distance_to(const Shape& shape, Vec3 origin, Vec3 direction, const DetailView* detail = nullptr,
                          double level_u = 0.5) {
    return OneRay(origin, direction, detail, level_u).meet(shape);
}

inline Vec3 at_latitude(double latitude_rad, double longitude_rad) {
    return {std::cos(latitude_rad) * std::cos(longitude_rad),
            std::cos(latitude_rad) * std::sin(longitude_rad), std::sin(latitude_rad)};
}

} // namespace obscura::test
