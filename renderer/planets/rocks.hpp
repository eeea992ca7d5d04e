// SPDX-License-Identifier: Apache-2.0
// Boulders near the camera as bodies of their own, which overhang: instances of a few meshes on tiles.
#pragma once

#include "renderer/planets/packet_tracer.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/shapes/shape.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Which rocks there may be, and what they look like.
struct RockSettings {
    std::vector<std::shared_ptr<const Shape>> forms; ///< extent -1 to 1 along each axis; empty: no rocks
    double cells = 0;                                ///< Boulders::Settings::rock_cells
    double min_m = 0, largest_m = 0;                 ///< longest axes
};

/// Where the terrain's layers have rocks in a tile, on the ground of its vertices. `sample_spacings_m`: as
/// TileMaker::make() left them in its scratch space.
[[nodiscard]] std::vector<Rock> place_rocks(const terrain::TileMaker& maker, const terrain::SurfaceTile& tile,
                                            std::span<const double> sample_spacings_m);

/// Rays against the rocks of tiles. A tile has those that its parent has as domes in its heights: a ray meets
/// them if, by its LevelChoice, it takes that tile or finer ones there, so never meets both a rock and its
/// dome. As that choice is made at random for each sample, the expected image changes continuously when the
/// camera comes near. Tiles that rays miss are made, or asked for, as those of the surface. Immutable;
/// thread-safe; neither blocks nor allocates unless rays wait for tiles. The caller holds a
/// SurfaceTiles::Pin.
class RockTracer {
public:
    /// `tiles` outlives this.
    RockTracer(const SurfaceTiles& tiles, RockSettings settings);

    /// As Shape::intersect() and Shape::occlude(), for active lanes of `scaled`, the same rays in scaled
    /// space with their levels.
    void intersect(const RayPacket& rays, const ScaledRays& scaled, std::int32_t body, HitPacket& hits) const;
    void occlude(RayPacket& rays, const ScaledRays& scaled) const;
    /// Whether a hit of the terrain is one of a rock.
    [[nodiscard]] static bool is_hit(const HitPacket& hits, int i) { return hits.u[i] == rock_place; }
    /// Fills the lanes of `out` whose hits are such.
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body, SurfacePacket& out) const;

private:
    class Walk;

    /// HitPacket::u of rocks; those of cells are not above 1.
    static constexpr float rock_place = 2;

    const SurfaceTiles& tiles_;
    RockSettings settings_;
    int first_level_, last_level_; ///< of tiles with rocks
};

} // namespace obscura::renderer
