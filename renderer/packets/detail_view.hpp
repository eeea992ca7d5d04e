// SPDX-License-Identifier: Apache-2.0
// Level of detail of terrain in one frame, and counts of what rays met.
#pragma once

#include "core/geometry.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace obscura::renderer {

/// How well the surfaces that rays met were resolved.
struct DetailCounts {
    std::uint64_t hits = 0;
    /// Hits among them on cells wider than asked for by a factor above 1, 2, 4 and 8.
    std::array<std::uint64_t, 4> coarser{};
    std::uint64_t missed = 0; ///< look-ups of tiles that were not there
    /// Rays to shapes of users whose hit, or that they hit nothing, is not sure (models::ShapeHits).
    std::uint64_t doubtful = 0;
};

/// The Sun as a terrain that keeps its visibility sees it, body frame (planets/sun_visibility.hpp).
struct SunSeen {
    Vec3 centre_m;
    double radius_m = 0; ///< 0: none

    bool operator==(const SunSeen&) const = default;
};

/// From where a terrain is seen: its level of detail is a field over positions, the same for primary, shadow
/// and bounce rays. The cells of a tile at distance d from the eye are at most d * cell_rad wide, and at
/// least about a quarter of that: which level a sample takes is chosen by its own RayPacket::level_u, so that
/// the expected image changes continuously as the eye moves. Thread-bound, because of `counts`.
struct DetailView {
    Vec3 eye_m;          ///< body frame, at the middle of the frame's exposure
    double cell_rad = 0; ///< 0: no terrain, only `counts` is used
    /// False: tiles that are missing are replaced by coarser ones and asked for, instead of being made.
    bool wait = true;
    /// Tiles published later than this are not seen.
    std::uint64_t version = std::numeric_limits<std::uint64_t>::max();
    DetailCounts* counts = nullptr;
    SunSeen sun{}; ///< of terrains that keep its visibility
};

} // namespace obscura::renderer
