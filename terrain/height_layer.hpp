// SPDX-License-Identifier: Apache-2.0
// One layer of a terrain's heights: a map, a patch over it, or procedural detail.
#pragma once

#include "core/geometry.hpp"
#include "terrain/surface_domain.hpp"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace obscura::terrain {

/// Smallest and largest height, m, and the largest distance of the samples that they were made from.
struct HeightRange {
    double least = 0, largest = 0;
    double sample_spacing_m = std::numeric_limits<double>::infinity();
};

/// Part of the reference surface: all within `radius_m` of `centre_m` (chord).
struct Cap {
    Vec3 centre_m;
    double radius_m = 0;
};

/// Part of the reference surface that a tile with its margin lies in.
[[nodiscard]] Cap cap_of(const SurfaceDomain& domain, TileKey key);

/// Vertices at which heights are asked for. A height depends on the vertex's position and on the spacing
/// alone, never on what else is asked for with it: neighbouring tiles agree at shared vertices, bit for bit,
/// and tiles may be made in any order, by any thread.
struct VertexGrid {
    TileKey tile;
    /// tile_vertices points of the reference surface, rows of j from -1 to tile_cells + 1. Vertices of the
    /// margin beyond the edge of a face are the neighbouring face's (SurfaceDomain::point).
    std::span<const Vec3> positions_m;
    /// Distance of neighbouring vertices (SurfaceDomain::spacing_m of the tile's level): what is shorter than
    /// about twice this is left out or replaced by its mean.
    double spacing_m = 0;
    /// Contains all positions.
    Cap cap;
};

class FeatureSearch;
struct SurfaceFeature;

/// Boulder that overhangs: no part of the heights of fine tiles, but a body of its own that stands on them.
struct StandingRock {
    std::uint64_t id = 0;   ///< as that of its SurfaceFeature
    Vec3 position_m;        ///< of its centre on the reference surface
    Vec3 along, across;     ///< its two longer axes, unit, parallel to the reference surface
    Vec3 semi_axes_m;       ///< along, across and up
    double height_m = 0;    ///< of its top above the ground below its centre
    std::uint32_t form = 0; ///< random bits that choose its form
};

/// Layers are applied from the coarsest map upwards. Immutable; thread-safe. Called by loader threads and, in
/// offline rendering, by render threads; may allocate and read files.
class HeightLayer {
public:
    virtual ~HeightLayer() = default;

    /// `heights_m`: what the layers below made at the vertices, first 0; on return, with this layer.
    /// `sample_spacings_m`: distance of the samples that the heights were made from, first infinite; a layer
    /// of samples writes its own, blended where the heights are: with share w of its heights,
    /// 1 / spacing = (1 - w) / below + w / own. Procedural detail leaves them: it fills in what is between
    /// the samples.
    virtual void apply(const VertexGrid& grid, std::span<double> heights_m,
                       std::span<double> sample_spacings_m) const = 0;
    /// Whether apply() leaves nothing of the layers below at any position of the cap.
    [[nodiscard]] virtual bool hides_below(const Cap& /*cap*/) const { return false; }
    /// Bounds of what apply() makes at any position of the cap, at any spacing up to `spacing_m`, if the
    /// heights of the layers below are within `below` there.
    [[nodiscard]] virtual HeightRange range(const Cap& cap, double spacing_m, HeightRange below) const = 0;
    /// Spacing of the layer's own finest samples at a position, m: infinite where it has none, 0 if there is
    /// detail at every scale. A layer above may fill in what is between the samples.
    [[nodiscard]] virtual double sample_spacing_m(Vec3 /*position_m*/) const {
        return std::numeric_limits<double>::infinity();
    }

    /// Mean squared slope (of the gradient: both directions) that heights made at a spacing lack for cells of
    /// that width. `lost`: that of the layers below, first 0; on return, with this layer.
    /// `sample_spacings_m`: as apply() left them. At positions far from each other: means over what is
    /// between them.
    virtual void add_lost_slopes(std::span<const Vec3> /*positions_m*/, double /*spacing_m*/,
                                 std::span<const double> /*sample_spacings_m*/,
                                 std::span<double> /*lost*/) const {}

    /// Appends the rocks that stand on a tile and on all finer ones there: those with centres in it that
    /// apply() leaves out of its heights, but not out of its parent's.
    virtual void add_rocks(TileKey /*tile*/, std::vector<StandingRock>& /*rocks*/) const {}
    /// What apply() adds to the ground at a vertex of a tile for features of the rocks' kind: rocks do not
    /// stand on each other.
    [[nodiscard]] virtual double above_ground_m(Vec3 /*vertex_m*/, double /*spacing_m*/) const { return 0; }

    /// Lists the layer's own features, such as craters. Takes no memory but that of the search.
    virtual void find_features(FeatureSearch& /*search*/) const {}
    /// Share of one of its features that is left at its centre, where samples of the layers below are
    /// `sample_spacing_m` apart: later ones of the same layer, and samples, take the rest.
    [[nodiscard]] virtual double share_left(const SurfaceFeature& /*feature*/,
                                            double /*sample_spacing_m*/) const {
        return 1;
    }
};

} // namespace obscura::terrain
