// SPDX-License-Identifier: Apache-2.0
// Gradient noise in three dimensions on a rotated lattice, by hash: band-limited, bounded, reproducible.
#pragma once

#include "core/geometry.hpp"

#include <cstdint>
#include <span>

namespace obscura::terrain {

/// Lattice of one octave. Rotations differ, so that the lattices of octaves never line up.
struct NoiseLattice {
    Mat3 per_spacing;       ///< from metres to lattice spacings
    Vec3 offset;            ///< lattice spacings
    std::uint32_t seed = 0; ///< of the hash
};

/// Octave number `octave` of a seed. Positions must be within 2^30 spacings of the origin.
[[nodiscard]] NoiseLattice noise_lattice(std::uint64_t seed, int octave, double spacing_m);

/// Perlin's noise (Improving Noise, SIGGRAPH 2002) with gradients uniform in a cube, rms 1, clamped to
/// +- noise_bound. `out` has the size of `positions_m`. The same bytes with every set of vector instructions.
void gradient_noise(const NoiseLattice& lattice, std::span<const Vec3> positions_m, std::span<float> out);
inline constexpr float noise_bound = 3.5F;

/// Mean square difference of the (unclamped) noise between points `distance` lattice spacings apart, over all
/// places and directions: from 0 to 2.
[[nodiscard]] double noise_structure(double distance);

} // namespace obscura::terrain
