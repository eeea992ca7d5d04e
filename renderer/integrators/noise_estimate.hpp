// SPDX-License-Identifier: Apache-2.0
// Variance of the means of 16 pixels, estimated from their samples.
#pragma once

#include "renderer/packets/packet.hpp"

#include <cstdint>

namespace obscura::renderer {

/// Sums of a block of 16 pixels over nested groups of their samples, and the variance of the pixels' means
/// that follows.
///
/// Samples of a pixel are Owen-scrambled Sobol points in order: each aligned group of 2^k is stratified. With
/// V(k) the variance of the mean of such a group and D(k) half the difference of the means of the two groups
/// of 2^k that form one of 2^(k+1), V(k) = V(k+1) + E[D(k)^2] exactly, because both halves have the same
/// distribution. The variance of the whole is therefore the last D^2 times r / (1 - r) with
/// r = V(k+1) / V(k), which needs no assumption about an exponent: r is measured as the ratio of the last two
/// D^2. It is 0.25 where a few samples meet edges, 0.4 at 64 samples on the same edges, 0.47 for light of
/// many reflections (16 frames of each scene of noise_estimate_test.cpp); s^2 / n is r = 0.5.
///
/// With one sample there is no D. Differences between neighbours that remove straight slopes and parabolas,
/// (1 -3 3 -1) along the row, leave the noise: a third difference of independent values has 20 times their
/// variance. This is the method of Immerkaer, Fast Noise Variance Estimation, CVIU 64(2), 1996, with
/// differences along one row instead of two: a block is always traced whole, whereas the rows above and below
/// may belong to another request or another instant.
class NoiseSums {
public:
    void reset();
    /// Adds the next sample of a pixel.
    void add(int pixel, double value);
    [[nodiscard]] std::uint32_t count(int pixel) const { return count_[pixel]; }
    [[nodiscard]] double mean(int pixel) const { return sum_[pixel] / count_[pixel]; }

    /// Variance of the mean of each pixel that has samples; the others are left alone. 0 only where all
    /// samples of a pixel and of its neighbours are equal. `sunlight_only`: see Tracer, the
    /// noise is that of edges.
    void variance(bool sunlight_only, Doubles& variance) const;

private:
    static constexpr int max_levels = 20;

    std::uint32_t count_[packet_size];
    double sum_[packet_size];
    double pending_[max_levels][packet_size]; ///< sum of the group of 2^k that waits for its other half
    double square_[max_levels][packet_size];  ///< of the differences between the sums of such halves
};

} // namespace obscura::renderer
