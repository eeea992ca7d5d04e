// SPDX-License-Identifier: Apache-2.0
// Cumulative Poisson probabilities for integer means, for sampling by table inversion.
#pragma once

#include <array>
#include <cstdint>

namespace obscura::sensors {

/// For each mean q = 0, 1, ... 63: the thresholds 2^32 P(N <= k), and for each value of a random word's top
/// byte the first k that is possible. A word w gives the smallest k with w < threshold[k]. Words and
/// thresholds are compared as signed numbers, so both have their top bit flipped.
struct PoissonTable {
    static constexpr std::int32_t means = 64;
    static constexpr std::int32_t counts = 128; ///< P(N > 126) < 2^-32 for all means

    alignas(64) std::array<std::int32_t, means * counts> threshold;
    /// One byte per value of the top byte, and padding for kernels that read 32 bits at a time.
    alignas(64) std::array<std::uint8_t, means * 256 + 4> guide;

    PoissonTable() noexcept;
    /// The shared table, computed at the first call.
    static const PoissonTable& get() noexcept;
};

} // namespace obscura::sensors
