// SPDX-License-Identifier: Apache-2.0
// Terrain: an ellipsoid or a plane with heights from layers, traced through tiles in double precision.
#pragma once

#include "renderer/planets/packet_tracer.hpp"
#include "renderer/planets/rocks.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/planets/tile_tracer.hpp"
#include "renderer/shapes/shape.hpp"
#include "terrain/height_layer.hpp"
#include "terrain/maps/map_findings.hpp"
#include "terrain/surface_domain.hpp"

#include <memory>
#include <string>
#include <vector>

namespace obscura::renderer {

/// Body frame: that of its SurfaceDomain. Rays with a DetailView take tiles whose cells are as small as it
/// asks for; rays without one, as queries about a scene use them, take the level `query_level`. Shading
/// normals are continuous on a level. A plane is a block whose sides are walls. Thread-safe; see
/// SurfaceTiles.
class TerrainShape final : public Shape {
public:
    struct Settings {
        SurfaceTiles::Settings tiles;
        /// The level of all rays, whatever they ask for; -1: by distance.
        int fixed_level = -1;
        int query_level = 2;
        RockSettings rocks{};
        terrain::MapFindings found{}; ///< see Shape::notes() and warnings()
    };

    /// Throws InputError if the layers' bounds are not those of a body.
    TerrainShape(const terrain::SurfaceDomain& domain,
                 std::vector<std::shared_ptr<const terrain::HeightLayer>> layers, const Settings& settings);
    TerrainShape(const terrain::SurfaceDomain& domain,
                 std::vector<std::shared_ptr<const terrain::HeightLayer>> layers)
        : TerrainShape(domain, std::move(layers), Settings()) {}

    [[nodiscard]] double bounding_radius_m() const override { return bounding_radius_m_; }
    [[nodiscard]] bool shadows_itself() const override { return true; }
    void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const override;
    /// All hits of the lanes `active`, also of the surface on which a ray starts.
    void intersect_all(const RayPacket& rays, const Lanes& active, std::int32_t body, HitPacket& hits) const;
    void occlude(RayPacket& rays) const override;
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                 SurfacePacket& out) const override;
    bool sunlit(const RayPacket& rays, const HitPacket& hits, std::int32_t body, const Doubles& width_m,
                SunlitPacket& out) const override;
    bool unresolved_slopes(const HitPacket& hits, std::int32_t body, Doubles& squared) const override;
    [[nodiscard]] Vec3 up(Vec3 position_m) const override { return plane_ ? Vec3{0, 0, 1} : position_m; }
    [[nodiscard]] const SurfaceTiles* tiles() const override { return &tiles_; }
    [[nodiscard]] std::vector<std::string> notes() const override { return found_.notes; }
    [[nodiscard]] std::vector<std::string> warnings() const override { return found_.warnings; }

    /// Which tiles lane `i` takes.
    [[nodiscard]] LevelChoice levels(const RayPacket& rays, int i) const;

private:
    [[nodiscard]] Vec3 scaled(Vec3 p) const {
        return {p.x * inverse_radii_.x, p.y * inverse_radii_.y, p.z * inverse_radii_.z};
    }

    /// For camera rays that need sunlight alone: fills the hits of those that can only meet the surface where
    /// the body itself hides the whole Sun, and takes them from `active`. Their place is that of the least
    /// sphere.
    void leave_dark(const RayPacket& rays, std::int32_t body, const Doubles& t_max, Lanes& active,
                    HitPacket& hits) const;
    /// Fills `found` for the active lanes of `scaled_rays`, and those: see first_crossings().
    void trace(const RayPacket& rays, const Doubles& t_max, bool any, TileCrossings& found,
               ScaledRays& scaled_rays) const;
    /// Levels of all lanes.
    void set_levels(const RayPacket& rays, ScaledRays& scaled_rays) const;
    /// The point, or that above it at a unit height if it is lower.
    [[nodiscard]] Vec3 raised(Vec3 point, double height) const;

    SurfaceTiles tiles_;
    int fixed_level_, query_level_;
    bool plane_;
    Vec3 inverse_radii_;
    double bounding_radius_m_;
    std::unique_ptr<const RockTracer> rocks_; ///< null: there are none
    terrain::MapFindings found_;
};

} // namespace obscura::renderer
