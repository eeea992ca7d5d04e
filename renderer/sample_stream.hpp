// The random numbers of 16 samples, one pair after another along their paths.
#pragma once

#include "renderer/sampler.hpp"

namespace obscura::renderer {

/// Each pair comes from its own scrambled Sobol sequence, of which a sample has the point of its index: all
/// samples of a pixel together are well spread in each pair, and the pairs are independent.
class SampleStream {
public:
    SampleStream(const Words& index, const Words& seed) : index_(index), seed_(seed) {}

    void next(Doubles& u, Doubles& v) {
        Words seed;
        for (int i = 0; i < packet_size; ++i)
            seed.v[i] = seed_.v[i] + pair_ * 0x9e3779b9u;
        ++pair_;
        sobol_pair(index_, seed, u, v);
    }

private:
    const Words& index_;
    const Words& seed_;
    std::uint32_t pair_ = 0;
};

} // namespace obscura::renderer
