// SPDX-License-Identifier: Apache-2.0
// Tiles made from height layers, for tests.
#pragma once

#include "terrain/height_layer.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace obscura::terrain {

/// Reference positions and heights of a tile with its margin.
struct MadeTile {
    TileKey key;
    std::vector<Vec3> positions_m;
    std::vector<double> heights_m;
    double spacing_m = 0;
    Cap cap;

    /// i and j from -1 to tile_cells + 1.
    [[nodiscard]] static std::size_t index(int i, int j) {
        return static_cast<std::size_t>(j + tile_margin) * tile_edge +
               static_cast<std::size_t>(i + tile_margin);
    }
    [[nodiscard]] double at(int i, int j) const { return heights_m[index(i, j)]; }
    [[nodiscard]] Vec3 position(int i, int j) const { return positions_m[index(i, j)]; }
};

inline MadeTile make_tile(const SurfaceDomain& domain, TileKey key,
                          std::span<const HeightLayer* const> layers) {
    MadeTile tile;
    tile.key = key;
    for (int j = -tile_margin; j <= tile_cells + tile_margin; ++j)
        for (int i = -tile_margin; i <= tile_cells + tile_margin; ++i)
            tile.positions_m.push_back(domain.point(key.face, SurfaceDomain::coordinate(key.level, key.i, i),
                                                    SurfaceDomain::coordinate(key.level, key.j, j)));
    tile.spacing_m = domain.spacing_m(key.level);
    tile.cap.centre_m = tile.position(tile_cells / 2, tile_cells / 2);
    for (const Vec3 p : tile.positions_m)
        tile.cap.radius_m = std::max(tile.cap.radius_m, length(p - tile.cap.centre_m));
    tile.heights_m.assign(tile_vertices, 0);
    std::vector<double> spacings(tile_vertices, std::numeric_limits<double>::infinity());
    const VertexGrid grid{key, tile.positions_m, tile.spacing_m, tile.cap};
    for (const HeightLayer* const layer : layers)
        layer->apply(grid, tile.heights_m, spacings);
    return tile;
}

/// Tile of that level for any number; numbers are spread evenly over all tiles of the level.
inline TileKey tile_of_number(const SurfaceDomain& domain, int level, std::uint64_t number) {
    number *= 0x9E3779B97F4A7C15ull;
    const std::uint32_t mask = (1u << level) - 1;
    return {static_cast<std::uint8_t>((number >> 58) % domain.faces()), static_cast<std::uint8_t>(level),
            static_cast<std::uint32_t>(number >> 32) & mask, static_cast<std::uint32_t>(number >> 8) & mask};
}

/// Compares a layer's range over a tile with the heights of the tile and of finer ones in it. Returns how
/// much wider the range is than the tile's own heights.
inline double check_bounds(const SurfaceDomain& domain, const HeightLayer& layer, int level,
                           std::uint64_t number) {
    TileKey key = tile_of_number(domain, level, number);
    HeightRange range;
    double excess = 0;
    for (unsigned deeper = 0; deeper < 4; ++deeper) {
        const HeightLayer* const layers[] = {&layer};
        const MadeTile tile = make_tile(domain, key, layers);
        const auto [low, high] = std::minmax_element(tile.heights_m.begin(), tile.heights_m.end());
        if (deeper == 0) {
            range = layer.range(tile.cap, tile.spacing_m, {});
            excess = (range.largest - range.least) / (*high - *low);
        }
        CHECK(*low >= range.least);
        CHECK(*high <= range.largest);
        key = key.child((static_cast<unsigned>(number) + deeper) % 4);
    }
    return excess;
}

} // namespace obscura::terrain
