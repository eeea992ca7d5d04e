// SPDX-License-Identifier: Apache-2.0
// Adds a round profile to a block of vertices, with the widest vectors of the CPU.
#pragma once

#include "core/geometry.hpp"

#include <array>
#include <cstddef>

namespace obscura::terrain {

/// Vertices of a block and quantities of them.
inline constexpr std::size_t stamp_block_edge = 8, stamp_block_size = stamp_block_edge * stamp_block_edge;
using BlockValues = std::array<double, stamp_block_size>;
struct BlockPoints {
    alignas(64) BlockValues x, y, z;
};

/// Profile around a point.
struct ProfileStamp {
    Vec3 centre;
    /// Heights at even steps of the squared distance; steps + 2 values, the last two 0.
    const double* profile;
    std::size_t steps;
    double steps_per_square; ///< per square of the distance
    double scale;            ///< of the heights
    /// Up to `removed` steps older things are removed by `removal` (0 to 1), from `kept` not at all.
    double removed, kept, removal;
};

/// Adds the profile to `sums` and writes the share of older things that is left. False: all is left, `left`
/// is not written. Both aligned to 64 bytes. The same bytes with every set of vector instructions.
bool add_profile(const BlockPoints& points, const ProfileStamp& stamp, BlockValues& sums, BlockValues& left);

/// values *= left, both aligned to 64 bytes.
void scale_block(BlockValues& values, const BlockValues& left);

/// total += values clamped to least and largest, all aligned to 64 bytes.
void add_clamped(BlockValues& total, const BlockValues& values, double least, double largest);

} // namespace obscura::terrain
