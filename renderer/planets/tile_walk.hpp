// SPDX-License-Identifier: Apache-2.0
// Descent of a packet's rays through the quadtree of tiles, several at once in vector registers.
#pragma once

#include "renderer/packets/packet.hpp"
#include "terrain/cube_sphere.hpp"

#include <array>
#include <cstdint>

namespace obscura::renderer {

/// Rays by their parameter x, which is 0 at the point `near`: of a sphere that closest to its centre, of a
/// plane the origin.
struct alignas(64) WalkRays {
    Vec3s near, direction;
    Doubles along; ///< of the ray's own parameter where x is 0
    /// Sphere: squares of the closest distance and of the speed. Plane: height at x = 0 and its derivative.
    Doubles miss2, speed2;
    Doubles from, to; ///< part of the ray that may meet the terrain; empty if not from < to
    Doubles inner;    ///< sphere: half of the chord in which no terrain is; 0: none
};

/// Lanes, a bit each.
struct WalkBegin {
    std::uint32_t begun;   ///< not empty
    std::uint32_t beneath; ///< of them, those that begin in the inner sphere
    std::uint32_t within;  ///< of them, those that begin at their origin, in the shell
};

/// Sets up rays about a sphere in the shell of unit heights `least` to `largest`. Inactive lanes are empty.
/// What lies beyond the inner sphere is left out, unless the ray begins in it.
[[nodiscard]] WalkBegin begin_walk(const Vec3s& origin, const Vec3s& direction, const Doubles& t_max,
                                   const Lanes& active, double least, double largest, WalkRays& rays);

/// Lines of the rays on a face: u and v are the quotients of those of u and v by that of w.
struct alignas(64) WalkLines {
    Doubles ua, ub, va, vb, wa, wb;
};

/// Parts of the rays of a packet in a tile; empty where not from < to.
struct alignas(64) WalkParts {
    Doubles from, to;
};

/// Lanes whose parts begin and end on a face of the cube, a bit each.
using FaceLanes = std::array<std::uint32_t, terrain::cube_face_count>;
[[nodiscard]] FaceLanes whole_on_faces(const WalkRays& rays, std::uint32_t lanes);

/// Places on a face, u and v.
struct WalkBox {
    double u0, u1, v0, v1;
};

/// Narrows parts, all of which are in one tile, to where rays are between two unit heights, or come from
/// above into what is between them, and to `best`. Returns a box that holds all that is left; u0 > u1:
/// nothing.
[[nodiscard]] WalkBox narrow_walk(const WalkRays& rays, const WalkLines& lines, const Doubles& best,
                                  double highest, double least, bool plane, WalkParts& parts);

/// What the walk needs of a tile.
struct WalkTile {
    double u_middle, v_middle;   ///< its middle planes
    double distance2_m2;         ///< of its centre from the eye
    double radius_m, spacing_m;  ///< see SurfaceNode
    double highest;              ///< unit height of its own highest vertex
    const double* child_highest; ///< unit heights of the four children
    bool can_split;              ///< it has children
    double fixed_reach;          ///< of all rays; negative: their own
};

/// Parts in the four quarters of the rays that take finer tiles, and the lanes that take the tile itself;
/// neither where they are above all that is there.
struct alignas(64) WalkSplit {
    std::array<WalkParts, 4> quarter;
    std::array<std::uint32_t, 4> lanes; ///< that are in the quarter, a bit each
    std::uint32_t here;                 ///< lanes that take this tile
};

/// `best`: parameter of each ray's nearest crossing so far. Narrows `parts` to it. No lane's parts depend on
/// another lane.
void split_walk(const WalkRays& rays, const WalkLines& lines, const Doubles& reach, const Doubles& best,
                const WalkTile& tile, bool plane, WalkParts& parts, WalkSplit& split);

/// Lanes whose parts are not empty.
[[nodiscard]] std::uint32_t lanes_left(const WalkParts& parts, const Doubles& best);

} // namespace obscura::renderer
