// SPDX-License-Identifier: Apache-2.0
// Maker of surface tiles from the layers of a terrain.
#pragma once

#include "terrain/height_layer.hpp"
#include "terrain/surface_domain.hpp"
#include "terrain/tiles/surface_tile.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace obscura::terrain {

/// Bounds of the reduced heights (see SurfaceTile) of a tile and of all finer ones below it, m.
struct ReducedRange {
    double least = 0, largest = 0;
};

/// Slopes that cells are too coarse for: means at so many points of a tile each way, that many cells apart.
inline constexpr int slope_cells = 16, slope_edge = tile_cells / slope_cells + 1;
using LostSlopes = std::array<float, std::size_t{slope_edge} * slope_edge>;

/// Applies the layers in order at the vertices of a tile. Immutable; thread-safe. Takes what layers take to
/// read files; allocates.
class TileMaker {
public:
    /// Scratch space of one call, to be used again.
    struct Scratch {
        std::vector<Vec3> positions_m;
        std::vector<double> heights_m, sample_spacings_m, reductions;
    };

    TileMaker(SurfaceDomain domain, std::vector<std::shared_ptr<const HeightLayer>> layers);

    [[nodiscard]] const SurfaceDomain& domain() const { return domain_; }
    /// In the order in which they are applied.
    [[nodiscard]] const std::vector<std::shared_ptr<const HeightLayer>>& layers() const { return layers_; }

    /// Fills `out`. Heights beyond range() of the tile are set to its nearer end, so that rays can rely on
    /// the bounds of a layer that states them wrongly; returns how many there were, which is a fault of the
    /// layer.
    std::size_t make(TileKey key, Scratch& scratch, SurfaceTile& out) const;
    /// Mean squared slopes that the tile lacks, rows along u: HeightLayer::add_lost_slopes(). `scratch`: as
    /// make() of that tile left it. Neighbouring tiles of a level agree where they meet.
    [[nodiscard]] LostSlopes lost_slopes(TileKey key, const Scratch& scratch) const;
    /// From the layers' own bounds, without making anything.
    [[nodiscard]] ReducedRange range(TileKey key) const;
    /// Distance of the finest samples below a layer, by its number, at a position; infinite: there are none.
    [[nodiscard]] double sample_spacing_m(std::size_t layer, Vec3 position_m) const;
    /// Part of the reference surface that the tile and its margin lie in.
    [[nodiscard]] Cap cap(TileKey key) const;

private:
    void make_positions(TileKey key, Scratch& scratch) const;
    [[nodiscard]] HeightRange layers_range(const Cap& cap, double spacing_m) const;
    /// Index of the lowest layer that is not hidden below another one all over the cap.
    [[nodiscard]] std::size_t lowest_seen(const Cap& cap) const;

    SurfaceDomain domain_;
    std::vector<std::shared_ptr<const HeightLayer>> layers_;
};

} // namespace obscura::terrain
