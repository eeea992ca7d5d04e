// SPDX-License-Identifier: Apache-2.0
// The random numbers of 16 samples, one pair after another along their paths.
#pragma once

#include "renderer/packets/sampler.hpp"

namespace obscura::renderer {

/// Each pair comes from its own scrambled Sobol sequence, of which a sample has the point of its index: all
/// samples of a pixel together are well spread in each pair, and the pairs are independent.
class SampleStream {
public:
    /// `first_pair`: pairs to leave out.
    SampleStream(const Words& index, const Words& seed, std::uint32_t first_pair = 0)
        : index_(index), seed_(seed), pair_(first_pair) {}

    void next(Doubles& u, Doubles& v) {
        Words seed;
        for (int i = 0; i < packet_size; ++i)
            seed.v[i] = seed_.v[i] + pair_ * 0x9e3779b9u;
        ++pair_;
        sobol_pair(index_, seed, u, v);
    }

    /// Leaves one pair out.
    void skip() { ++pair_; }

private:
    const Words& index_;
    const Words& seed_;
    std::uint32_t pair_;
};

} // namespace obscura::renderer
