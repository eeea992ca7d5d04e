// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/asteroid_200k.hpp"

#include "core/geometry.hpp"
#include "core/philox.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace obscura::bench {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is written as memory lies");

constexpr std::uint32_t cells = 129;
constexpr std::uint32_t side_points = (cells + 1) * (cells + 1);

struct Wave {
    Vec3 k;
    double phase, amplitude;
};

/// Waves of random directions, from the body's size down to a few facets, each octave half as high.
std::vector<Wave> waves() {
    constexpr std::uint32_t octaves = 6;
    constexpr std::uint32_t per_octave = 8;
    std::vector<Wave> out;
    for (std::uint32_t octave = 0; octave < octaves; ++octave)
        for (std::uint32_t i = 0; i < per_octave; ++i) {
            const auto random = philox4x32({octave, i, 0, 0}, {200, 1});
            const double z = 2 * uniform_double(random[0]) - 1;
            const double turn = 2 * std::numbers::pi * uniform_double(random[1]);
            const double across = std::sqrt(1 - z * z);
            const double size = 1.7 * std::exp2(octave);
            out.push_back({Vec3{across * std::cos(turn), across * std::sin(turn), z} * size,
                           2 * std::numbers::pi * uniform_double(random[2]),
                           0.03 * std::exp2(-1.0 * octave)});
        }
    return out;
}

Vec3 cube_point(std::uint32_t side, double a, double b) {
    switch (side) {
    case 0:
        return {1, a, b};
    case 1:
        return {-1, -a, b};
    case 2:
        return {-a, 1, b};
    case 3:
        return {a, -1, b};
    case 4:
        return {-b, a, 1};
    default:
        return {b, a, -1};
    }
}

template<class T>
void put(std::ofstream& out, T value) {
    out.write(reinterpret_cast<const char*>(&value), sizeof value);
}

} // namespace

void write_asteroid_200k(const std::filesystem::path& file) {
    std::ofstream out(file, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << 6 * side_points
        << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << 6 * cells * cells * 2
        << "\nproperty list uchar int vertex_indices\nend_header\n";
    const std::vector<Wave> relief = waves();
    for (std::uint32_t side = 0; side < 6; ++side)
        for (std::uint32_t j = 0; j <= cells; ++j)
            for (std::uint32_t i = 0; i <= cells; ++i) {
                const auto tangent = [](std::uint32_t k) {
                    // The middle of an edge exactly where both sides see it.
                    const double x = (2.0 * k - cells) / cells;
                    return k == 0 ? -1.0 : k == cells ? 1.0 : std::tan(x * std::numbers::pi / 4);
                };
                const Vec3 d = normalized(cube_point(side, tangent(i), tangent(j)));
                double height = 1;
                for (const Wave& w : relief)
                    height += w.amplitude * std::cos(dot(w.k, d) + w.phase);
                put(out, static_cast<float>(500 * d.x * height));
                put(out, static_cast<float>(450 * d.y * height));
                put(out, static_cast<float>(400 * d.z * height));
            }
    for (std::uint32_t side = 0; side < 6; ++side)
        for (std::uint32_t j = 0; j < cells; ++j)
            for (std::uint32_t i = 0; i < cells; ++i) {
                const std::uint32_t a = side * side_points + j * (cells + 1) + i;
                const std::uint32_t b = a + 1;
                const std::uint32_t c = a + cells + 1;
                const std::uint32_t d = c + 1;
                for (const auto& facet : {std::array{a, b, d}, std::array{a, d, c}}) {
                    put(out, std::uint8_t{3});
                    for (const std::uint32_t corner : facet)
                        put(out, corner);
                }
            }
    if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

} // namespace obscura::bench
