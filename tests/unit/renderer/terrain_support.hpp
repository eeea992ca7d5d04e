// SPDX-License-Identifier: Apache-2.0
// Terrain of a function and rays for tests of terrains.
#pragma once

#include "renderer/planets/height_tables.hpp"
#include "renderer/planets/terrain_shape.hpp"
#include "terrain/cube_sphere.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace obscura::test {

using namespace obscura::renderer;

/// Heights that are a function of the position, within bounds.
class FunctionLayer final : public terrain::HeightLayer {
public:
    FunctionLayer(std::function<double(Vec3)> height_m, double least_m, double largest_m)
        : height_m_(std::move(height_m)), least_m_(least_m), largest_m_(largest_m) {}

    void apply(const terrain::VertexGrid& grid, std::span<double> heights_m,
               std::span<double> /*sample_spacings_m*/) const override {
        for (std::size_t k = 0; k < heights_m.size(); ++k)
            heights_m[k] += height_m_(grid.positions_m[k]);
    }
    [[nodiscard]] terrain::HeightRange range(const terrain::Cap& /*cap*/, double /*spacing_m*/,
                                             terrain::HeightRange below) const override {
        return {below.least + least_m_, below.largest + largest_m_, below.sample_spacing_m};
    }

private:
    std::function<double(Vec3)> height_m_;
    double least_m_, largest_m_;
};

inline std::vector<std::shared_ptr<const terrain::HeightLayer>>
layers_of(std::function<double(Vec3)> height_m, double least_m, double largest_m) {
    return {std::make_shared<FunctionLayer>(std::move(height_m), least_m, largest_m)};
}

/// Table of a map of the whole body without a label, from -180 to 180 degrees.
inline HeightTable whole_body_map(const std::string& file) {
    HeightTable table;
    table.file = file;
    table.map.projection = terrain::ProjectionKind::simple_cylindrical;
    return table;
}

inline TerrainShape::Settings at_level(int level, std::uint64_t arena_bytes = std::uint64_t{512} << 20) {
    TerrainShape::Settings settings;
    settings.fixed_level = level;
    settings.tiles.arena_bytes = arena_bytes;
    return settings;
}

/// Random numbers and directions.
class Directions {
public:
    double number() { return uniform_(engine_); }
    /// Uniform over the sphere.
    Vec3 operator()() {
        const double z = 2 * number() - 1, turn = 2 * std::numbers::pi * number(), rho = std::sqrt(1 - z * z);
        return {rho * std::cos(turn), rho * std::sin(turn), z};
    }

private:
    std::mt19937_64 engine_{1};
    std::uniform_real_distribution<double> uniform_{0, 1};
};

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
