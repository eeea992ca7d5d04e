// SPDX-License-Identifier: Apache-2.0
// Sampler: Owen-scrambled Sobol points keyed by (seed, frame, pixel), the same on any thread.
#pragma once

#include "renderer/packets/packet.hpp"

#include <array>
#include <cstdint>

namespace obscura::renderer {

/// 16 lanes of 32-bit words.
struct alignas(64) Words {
    std::uint32_t v[packet_size];
    std::uint32_t& operator[](int i) { return v[i]; }
    std::uint32_t operator[](int i) const { return v[i]; }
};

/// Purpose of a sample: part of the Philox counter, so that effects share no numbers.
enum class SamplePurpose : std::uint32_t {
    pixel = 1,
    body = 2,
    sample_grid = 3,
    wing_cells = 5,
    wing_points = 6,
    received_light = 7,
    photons = 8
};

/// Random words of one pixel (or body) in one frame: each seeds one pair of dimensions.
using SeedWords = std::array<std::uint32_t, 4>;

[[nodiscard]] SeedWords seed_words(std::uint64_t seed, std::uint64_t frame, SamplePurpose purpose,
                                   std::int32_t x, std::int32_t y);

/// The first two words of the seed words (purpose: pixel) of 16 pixels from (x, y) to the right.
void pixel_seeds(std::uint64_t seed, std::uint64_t frame, std::int32_t x, std::int32_t y, Words& first,
                 Words& second);

/// Point `index` of a two-dimensional Sobol sequence, its order shuffled and its digits scrambled by Owen's
/// method with hashes of `seed`; u, v in [0,1). Pairs with different seeds are independent ("padded").
/// Burley, Practical Hash-based Owen Scrambling, JCGT 9(4), 2020; second dimension by Ahmed, An
/// Implementation Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact, EGSR 2024.
void sobol_pair(const Words& index, const Words& seed, Doubles& u, Doubles& v);

/// Third and fourth dimension of the sequence whose first two are sobol_pair() of the same seed: stratified
/// together with them, where padded pairs are not. Direction numbers: Joe and Kuo, Constructing Sobol
/// Sequences with Better Two-Dimensional Projections, SIAM J. Sci. Comput. 30(5), 2008.
void sobol_second_pair(const Words& index, const Words& seed, Doubles& u, Doubles& v);
/// The third dimension alone. Scrambled: evenly spaced numbers would cancel noise where what moves is as wide
/// as their distance, and so defeat its estimate.
void sobol_third(const Words& index, const Words& seed, Doubles& u);

} // namespace obscura::renderer
