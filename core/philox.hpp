// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: Philox 4x32-10.
#pragma once

#include <array>
#include <cstdint>

namespace obscura {

/// Four 32-bit words of random numbers for one (counter, key). No state: the same (seed, frame, pixel,
/// effect) gives the same numbers in any order, on any number of threads, in the whole frame or a window of
/// it. Salmon et al., Parallel Random Numbers: As Easy as 1, 2, 3, SC11; 10 rounds.
constexpr std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                                  std::array<std::uint32_t, 2> key) noexcept {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t p0 = std::uint64_t{0xD2511F53} * counter[0];
        const std::uint64_t p1 = std::uint64_t{0xCD9E8D57} * counter[2];
        counter = {static_cast<std::uint32_t>(p1 >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(p1),
                   static_cast<std::uint32_t>(p0 >> 32) ^ counter[3] ^ key[1],
                   static_cast<std::uint32_t>(p0)};
        key[0] += 0x9E3779B9;
        key[1] += 0xBB67AE85;
    }
    return counter;
}

/// Philox key made from a 64-bit seed.
constexpr std::array<std::uint32_t, 2> philox_key(std::uint64_t seed) noexcept {
    return {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
}

/// Uniform in (0,1): never 0 and never 1, so that logarithms of it are finite. 23 bits, because
/// the half added for that takes the last bit of a float.
constexpr float uniform_float(std::uint32_t word) noexcept {
    return (static_cast<float>(word >> 9) + 0.5F) * 0x1p-23F;
}
/// Uniform in (0,1) with 32 bits.
constexpr double uniform_double(std::uint32_t word) noexcept {
    return (static_cast<double>(word) + 0.5) * 0x1p-32;
}

} // namespace obscura
