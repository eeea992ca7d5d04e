// SPDX-License-Identifier: Apache-2.0
// Terrains of functions, and random directions, for tests and benches.
#pragma once

#include "renderer/planets/terrain_shape.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>

namespace obscura::test {

using namespace obscura::renderer;

/// Heights that are a function of the position, within bounds.
class FunctionLayer final : public terrain::HeightLayer {
public:
    FunctionLayer(std::function<double(Vec3)> height_m, double min_m, double largest_m)
        : height_m_(std::move(height_m)), min_m_(min_m), largest_m_(largest_m) {}

    void apply(const terrain::VertexGrid& grid, std::span<double> heights_m,
               std::span<double> /*sample_spacings_m*/) const override {
        for (std::size_t k = 0; k < heights_m.size(); ++k)
            heights_m[k] += height_m_(grid.positions_m[k]);
    }
    [[nodiscard]] terrain::HeightRange range(const terrain::Cap& /*cap*/, double /*spacing_m*/,
                                             terrain::HeightRange below) const override {
        return {below.least + min_m_, below.largest + largest_m_, below.sample_spacing_m};
    }

private:
    std::function<double(Vec3)> height_m_;
    double min_m_, largest_m_;
};

inline std::vector<std::shared_ptr<const terrain::HeightLayer>>
layers_of(std::function<double(Vec3)> height_m, double min_m, double largest_m) {
    return {std::make_shared<FunctionLayer>(std::move(height_m), min_m, largest_m)};
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
    explicit Directions(std::uint64_t seed = 1) : engine_(seed) {}
    double number() { return uniform_(engine_); }
    /// Uniform over the sphere.
    Vec3 operator()() {
        const double z = 2 * number() - 1, turn = 2 * std::numbers::pi * number(), rho = std::sqrt(1 - z * z);
        return {rho * std::cos(turn), rho * std::sin(turn), z};
    }

private:
    std::mt19937_64 engine_;
    std::uniform_real_distribution<double> uniform_{0, 1};
};

} // namespace obscura::test
