// SPDX-License-Identifier: Apache-2.0
// Heights of a terrain, all layers together, as the samples of a map.
#pragma once

#include "terrain/geometry/map_frame.hpp"
#include "terrain/obt/lru_cache.hpp"
#include "terrain/obt/obt_writer.hpp"
#include "terrain/tiles/tile_maker.hpp"

#include <cstdint>
#include <exception>
#include <span>

namespace obscura::tools {

/// Samples tiles whose cells are at most half as wide as the map's samples, by cubic interpolation, on all
/// processors. Tiles that were used last are kept (about 180 MB). `maker` must outlive it. Thread-bound.
class TerrainSource final : public terrain::ObtSource {
public:
    /// `spacing_m`: distance of samples.
    TerrainSource(const terrain::TileMaker& maker, const terrain::MapFrame& frame, double spacing_m);
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override;
    [[nodiscard]] int level() const { return level_; }

private:
    /// Height above the reference surface along the direction from the centre (planar: along z), m.
    [[nodiscard]] double height_m(terrain::SamplePlace place, terrain::TileMaker::Scratch& scratch,
                                  std::shared_ptr<const terrain::SurfaceTile>& last);
    [[nodiscard]] std::shared_ptr<const terrain::SurfaceTile> tile(terrain::TileKey key,
                                                                   terrain::TileMaker::Scratch& scratch);

    const terrain::TileMaker& maker_;
    terrain::MapFrame frame_;
    int level_ = 0;
    terrain::LruCache<terrain::TileKey, terrain::SurfaceTile> tiles_;
};

} // namespace obscura::tools
