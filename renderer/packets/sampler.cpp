// SPDX-License-Identifier: Apache-2.0
#include "renderer/packets/sampler.hpp"

#include "core/philox.hpp"

namespace obscura::renderer {
namespace {

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
    x = (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
    x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
    x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
    x = (x & 0x00ff00ffu) << 8 | (x >> 8 & 0x00ff00ffu);
    return x << 16 | x >> 16;
}

/// Owen scrambling of a bit-reversed value; constants by N. Vegdahl, "Building a Better LK Hash" (2021).
constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/// The Pascal matrix modulo 2, the generator of the second Sobol dimension: its value, bit-reversed, of the
/// index.
constexpr std::uint32_t pascal_reversed(std::uint32_t x) {
    x ^= x >> 16;
    x ^= (x & 0xff00ff00u) >> 8;
    x ^= (x & 0xf0f0f0f0u) >> 4;
    x ^= (x & 0xccccccccu) >> 2;
    x ^= (x & 0xaaaaaaaau) >> 1;
    return x;
}

/// Generator matrix of a Sobol dimension: its columns, bit-reversed, for the bits of the index from the
/// least.
struct SobolMatrix {
    std::uint32_t column[32];
};

/// From the first direction numbers `m` and the inner coefficients `a` of a primitive polynomial of `degree`.
constexpr SobolMatrix sobol_matrix(int degree, std::uint32_t a, std::array<std::uint32_t, 3> m) {
    SobolMatrix matrix{};
    std::uint32_t number[32] = {};
    for (int k = 0; k < 32; ++k) {
        if (k < degree) {
            number[k] = m[static_cast<std::size_t>(k)];
        } else {
            number[k] = number[k - degree] ^ number[k - degree] << degree;
            for (int i = 1; i < degree; ++i)
                if ((a >> (degree - 1 - i) & 1u) != 0) number[k] ^= number[k - i] << i;
        }
        matrix.column[k] = reverse_bits(number[k] << (31 - k));
    }
    return matrix;
}

constexpr SobolMatrix third_dimension = sobol_matrix(2, 1, {1, 3, 0});
constexpr SobolMatrix fourth_dimension = sobol_matrix(3, 1, {1, 3, 1});

constexpr std::uint32_t mix(std::uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

/// Signed conversion, which vector units have, of the upper 31 bits.
constexpr double to_unit(std::uint32_t x) {
    return static_cast<double>(static_cast<std::int32_t>(x >> 1)) * 0x1p-31;
}

inline SeedWords seed_words_inline(std::uint64_t seed, std::uint64_t frame, SamplePurpose purpose,
                                   std::int32_t x, std::int32_t y) {
    return philox4x32({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                       static_cast<std::uint32_t>(frame),
                       static_cast<std::uint32_t>(frame >> 32) ^ static_cast<std::uint32_t>(purpose) << 24},
                      philox_key(seed));
}

} // namespace

SeedWords seed_words(std::uint64_t seed, std::uint64_t frame, SamplePurpose purpose, std::int32_t x,
                     std::int32_t y) {
    return seed_words_inline(seed, frame, purpose, x, y);
}

OBSCURA_VECTOR_CLONES
void pixel_seeds(std::uint64_t seed, std::uint64_t frame, std::int32_t x, std::int32_t y, Words& first,
                 Words& second) {
    for (int i = 0; i < packet_size; ++i) {
        const auto words = seed_words_inline(seed, frame, SamplePurpose::pixel, x + i, y);
        first.v[i] = words[0];
        second.v[i] = words[1];
    }
}

OBSCURA_VECTOR_CLONES
void sobol_pair(const Words& index, const Words& seed, Doubles& u, Doubles& v) {
    for (int i = 0; i < packet_size; ++i) {
        const std::uint32_t order = mix(seed.v[i]);
        const std::uint32_t first = mix(seed.v[i] ^ 0x68bc21ebu);
        const std::uint32_t second = mix(seed.v[i] ^ 0x02e5be93u);
        // Shuffling keeps aligned blocks of 2^k points together, so every prefix stays stratified.
        const std::uint32_t shuffled = reverse_bits(scramble_reversed(reverse_bits(index.v[i]), order));
        // Sobol's first dimension is the bit-reversed index: reversed again, the index itself.
        const std::uint32_t a = reverse_bits(scramble_reversed(shuffled, first));
        const std::uint32_t b = reverse_bits(scramble_reversed(pascal_reversed(shuffled), second));
        u.v[i] = to_unit(a);
        v.v[i] = to_unit(b);
    }
}

OBSCURA_VECTOR_CLONES
void sobol_third(const Words& index, const Words& seed, Doubles& u) {
    Words shuffled;
    Words third{};
    for (int i = 0; i < packet_size; ++i)
        shuffled.v[i] = reverse_bits(scramble_reversed(reverse_bits(index.v[i]), mix(seed.v[i])));
    for (int k = 0; k < 32; ++k)
        for (int i = 0; i < packet_size; ++i)
            third.v[i] ^= (0u - (shuffled.v[i] >> k & 1u)) & third_dimension.column[k];
    for (int i = 0; i < packet_size; ++i)
        u.v[i] = to_unit(reverse_bits(scramble_reversed(third.v[i], mix(seed.v[i] ^ 0x1b873593u))));
}

OBSCURA_VECTOR_CLONES
void sobol_second_pair(const Words& index, const Words& seed, Doubles& u, Doubles& v) {
    Words shuffled;
    Words third{};
    Words fourth{};
    for (int i = 0; i < packet_size; ++i)
        shuffled.v[i] = reverse_bits(scramble_reversed(reverse_bits(index.v[i]), mix(seed.v[i])));
    for (int k = 0; k < 32; ++k)
        for (int i = 0; i < packet_size; ++i) {
            const std::uint32_t bit = 0u - (shuffled.v[i] >> k & 1u);
            third.v[i] ^= bit & third_dimension.column[k];
            fourth.v[i] ^= bit & fourth_dimension.column[k];
        }
    for (int i = 0; i < packet_size; ++i) {
        u.v[i] = to_unit(reverse_bits(scramble_reversed(third.v[i], mix(seed.v[i] ^ 0x1b873593u))));
        v.v[i] = to_unit(reverse_bits(scramble_reversed(fourth.v[i], mix(seed.v[i] ^ 0x7a5662dbu))));
    }
}

} // namespace obscura::renderer
