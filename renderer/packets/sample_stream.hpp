// SPDX-License-Identifier: Apache-2.0
// Sample stream: pairs of random numbers of 16 paths, one pair after another.
#pragma once

#include "renderer/packets/sampler.hpp"

namespace obscura::renderer {

/// Each pair of dimensions is a scrambled Sobol sequence of its own, evaluated at the index of the sample:
/// all samples of a pixel are stratified in each pair, and the pairs are independent.
class SampleStream {
public:
    /// `first_pair`: number of pairs to skip.
    SampleStream(const Words& index, const Words& seed, std::uint32_t first_pair = 0)
        : index_(index), seed_(seed), pair_(first_pair) {}

    void next(Doubles& u, Doubles& v) {
        Words seed;
        for (int i = 0; i < packet_size; ++i)
            seed.v[i] = seed_.v[i] + pair_ * 0x9e3779b9u;
        ++pair_;
        sobol_pair(index_, seed, u, v);
    }

    /// Skips one pair.
    void skip() { ++pair_; }

private:
    const Words& index_;
    const Words& seed_;
    std::uint32_t pair_;
};

} // namespace obscura::renderer
