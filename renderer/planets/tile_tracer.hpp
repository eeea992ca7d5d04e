// SPDX-License-Identifier: Apache-2.0
// Exact first crossings of rays with a terrain of tiles, in double precision.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/planets/surface_tiles.hpp"

#include <cstdint>

namespace obscura::renderer {

namespace tile_rays {
struct SphereRay;
} // namespace tile_rays

/// Point where a ray meets a terrain.
struct TileCrossing {
    double t = no_hit; ///< along the ray, in units of its direction
    const SurfaceNode* node = nullptr;
    std::uint32_t cell = 0; ///< j * tile_cells + i
    double s = 0, r = 0;    ///< place in the cell along u and v, 0 to 1
};

/// Gradients of the height above a terrain, outwards, not normalised; its unit height.
struct TileGradients {
    Vec3 facet;  ///< of the bilinear patch
    Vec3 smooth; ///< from differences at the vertices, interpolated: continuous on a level, over faces too
    double height = 0; ///< of the patch
};

/// Rays in the scaled space of a terrain: surface |p| = 1 + H(direction of p) about the unit sphere, or
/// z = H(x, y) over the square of half edge 1. H is bilinear in u and v within a cell, thus continuous within
/// a level, over tiles and faces. Where levels meet there is a wall between them: a ray that enters a tile
/// below its surface meets it at the border.
///
/// Rays descend a quadtree of maxima from front to back (Tevs, Ihrke, Seidel, Maximum Mipmaps for Fast,
/// Accurate, and Scalable Dynamic Height Field Rendering, I3D 2008). All borders of cells are planes through
/// the centre, or vertical ones, so that a ray's interval in a node is split at its two middle planes without
/// gap or overlap: no ray slips through between cells, tiles, levels or faces.
/// Immutable; thread-safe. The caller holds a SurfaceTiles::Pin.
class TileTracer {
public:
    TileTracer(const SurfaceTiles& tiles, const LevelChoice& levels) : tiles_(tiles), levels_(levels) {}

    /// The first crossing of the ray at 0 < t < t_max, from outside to inside, or, if its origin is below the
    /// surface, from inside to outside. `direction`: any length above 0.
    [[nodiscard]] TileCrossing first_crossing(Vec3 origin, Vec3 direction, double t_max) const;
    /// The place of the surface in the direction of `p`, or below it; t is the unit height.
    [[nodiscard]] TileCrossing below(Vec3 p) const { return below(p, -no_hit); }
    /// Whether a point at a unit height is below the surface there.
    [[nodiscard]] bool is_below(Vec3 p, double height) const { return height < below(p, height).t; }

    /// Gradients at a place of a cell, in scaled space.
    [[nodiscard]] static TileGradients gradients(const terrain::SurfaceDomain& domain,
                                                 const SurfaceNode& node, std::uint32_t cell, double s,
                                                 double r);

    /// The child of a tile that splits, as SurfaceTiles::child(); counts those that are missing.
    [[nodiscard]] static SurfaceNode* child(const SurfaceTiles& tiles, const LevelChoice& levels,
                                            SurfaceNode& node, unsigned quarter) {
        if (levels.view == nullptr) return tiles.child(node, quarter, true, 0);
        SurfaceNode* const next = tiles.child(node, quarter, levels.view->wait, levels.view->version);
        if (next == nullptr && levels.view->counts != nullptr) ++levels.view->counts->missed;
        return next;
    }

private:
    /// Ends early at any tile if that and all finer ones are lower than `height`: then t is no more than
    /// that.
    [[nodiscard]] TileCrossing below(Vec3 p, double height) const;
    template<typename Ray>
    bool cross_face(const Ray& ray, std::size_t face, double from, double to, bool inside,
                    TileCrossing& found) const;
    [[nodiscard]] TileCrossing crossing_with_plane(Vec3 origin, Vec3 direction, double t_max) const;
    bool cross_shell(const tile_rays::SphereRay& ray, double from, double to, bool inside,
                     TileCrossing& found) const;

    const SurfaceTiles& tiles_;
    const LevelChoice& levels_;
};

} // namespace obscura::renderer
