// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/terrain_shape.hpp"

#include "renderer/planets/sun_lookup.hpp"
#include "renderer/planets/sun_visibility.hpp"
#include "renderer/planets/umbra.hpp"
#include "renderer/shapes/own_surface.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

Vec3 inverse_radii(const terrain::SurfaceDomain& domain) {
    if (domain.is_plane()) return Vec3{1, 1, 1} / domain.half_edge_m();
    const Vec3 radii = domain.radii_m();
    return {1 / radii.x, 1 / radii.y, 1 / radii.z};
}

/// Place on a cell of hits that no sunlight can reach, of rays that were not traced. Others are from 0 to 1.
constexpr float dark_place = -1;
bool is_dark(const HitPacket& hits, int i) {
    return hits.u[i] == dark_place;
}

Doubles limits(const RayPacket& rays, const HitPacket& hits) {
    Doubles t_max;
    for (int i = 0; i < packet_size; ++i)
        t_max[i] = std::min(rays.t_max[i], hits.t[i]);
    return t_max;
}

double bounding_radius(const SurfaceTiles& tiles) {
    const double unit_m = tiles.domain().unit_m();
    if (!tiles.domain().is_plane()) return unit_m * (1 + tiles.largest()) * (1 + 1e-12);
    const double high = std::max(std::abs(tiles.least()), std::abs(tiles.largest()));
    return unit_m * std::hypot(std::numbers::sqrt2, high) * (1 + 1e-12);
}

} // namespace

TerrainShape::TerrainShape(const terrain::SurfaceDomain& domain,
                           std::vector<std::shared_ptr<const terrain::HeightLayer>> layers,
                           const Settings& settings)
    : tiles_(terrain::TileMaker(domain, std::move(layers)), settings.tiles),
      fixed_level_(settings.fixed_level),
      query_level_(settings.query_level),
      plane_(domain.is_plane()),
      inverse_radii_(inverse_radii(domain)),
      bounding_radius_m_(bounding_radius(tiles_)),
      rocks_(settings.rocks.forms.empty() ? nullptr
                                          : std::make_unique<const RockTracer>(tiles_, settings.rocks)),
      found_(settings.found) {
    if (rocks_) tiles_.set_rocks(*rocks_);
}

void TerrainShape::set_levels(const RayPacket& rays, ScaledRays& scaled_rays) const {
    scaled_rays.view = fixed_level_ >= 0 ? nullptr : rays.detail;
    scaled_rays.fixed_level = fixed_level_ >= 0 ? fixed_level_ : query_level_;
    // Between one and two times the distance at which cells are as small as asked for, so that none is wider.
    for (int i = 0; i < packet_size; ++i)
        scaled_rays.reach[i] =
            scaled_rays.view == nullptr ? 0 : (1 + rays.level_u[i]) / scaled_rays.view->cell_rad;
}

LevelChoice TerrainShape::levels(const RayPacket& rays, int i) const {
    ScaledRays scaled_rays;
    set_levels(rays, scaled_rays);
    return scaled_rays.levels(i);
}

Vec3 TerrainShape::raised(Vec3 point, double height) const {
    const Vec3 p = scaled(point);
    if (tiles_.domain().is_plane())
        return p.z < height ? Vec3{point.x, point.y, height * tiles_.domain().half_edge_m()} : point;
    const double radius = length(p);
    return radius < 1 + height ? point * ((1 + height) / radius) : point;
}

void TerrainShape::trace(const RayPacket& rays, const Doubles& t_max, bool any, TileCrossings& found,
                         ScaledRays& scaled_rays) const {
    const auto scale = [](const Doubles& from, double by, Doubles& to) {
        for (int i = 0; i < packet_size; ++i)
            to[i] = from[i] * by;
    };
    const auto scale_all = [&](const Vec3s& from, Vec3s& to) {
        scale(from.x, inverse_radii_.x, to.x);
        scale(from.y, inverse_radii_.y, to.y);
        scale(from.z, inverse_radii_.z, to.z);
    };
    scale_all(rays.origin, scaled_rays.origin);
    scale_all(rays.direction, scaled_rays.direction);
    set_levels(rays, scaled_rays);
    scaled_rays.t_max = t_max;
    first_crossings(tiles_, scaled_rays, any, found);
}

void TerrainShape::leave_dark(const RayPacket& rays, std::int32_t body, const Doubles& t_max, Lanes& active,
                              HitPacket& hits) const {
    const Vec3 sun = scaled(rays.detail->sun.centre_m);
    const double widest = std::max({inverse_radii_.x, inverse_radii_.y, inverse_radii_.z});
    const Umbra umbra(sun, rays.detail->sun.radius_m * widest, tiles_.least(), tiles_.largest());
    if (!umbra.exists()) return;
    for (int i = 0; i < packet_size; ++i) {
        if (active.on[i] == 0) continue;
        const double t = umbra.dark_entry(scaled(rays.origin.lane(i)), scaled(rays.direction.lane(i)));
        if (!(t < t_max[i])) continue;
        active.on[i] = 0;
        hits.t[i] = t;
        hits.body[i] = body;
        hits.primitive[i] = 0;
        hits.u[i] = hits.v[i] = dark_place;
    }
}

void TerrainShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    Lanes active = rays.active;
    if (rays.sunlight_only && rays.detail != nullptr && rays.detail->sun.radius_m > 0 && !plane_)
        leave_dark(rays, body, limits(rays, hits), active, hits);
    if (!active.any()) return;
    const HitPacket before = hits;
    intersect_all(rays, active, body, hits);
    leave_own_surface(
        *this, rays, body, double_rounding(bounding_radius_m_), before, hits,
        [&](const RayPacket& rest, HitPacket& next) { intersect_all(rest, rest.active, body, next); });
}

void TerrainShape::intersect_all(const RayPacket& rays, const Lanes& active, std::int32_t body,
                                 HitPacket& hits) const {
    const Doubles t_max = limits(rays, hits);
    TileCrossings found;
    ScaledRays scaled_rays;
    scaled_rays.active = active;
    trace(rays, t_max, false, found, scaled_rays);
    for (int i = 0; i < packet_size; ++i) {
        if (scaled_rays.active.on[i] == 0 || found.t[i] == no_hit) continue;
        const SurfaceNode& node = *found.node[static_cast<std::size_t>(i)];
        hits.t[i] = found.t[i];
        hits.body[i] = body;
        hits.primitive[i] = node.slot << 16 | found.cell[static_cast<std::size_t>(i)];
        hits.u[i] = static_cast<float>(found.s[i]);
        hits.v[i] = static_cast<float>(found.r[i]);
        const LevelChoice choice = scaled_rays.levels(i);
        if (choice.view == nullptr || choice.view->counts == nullptr) continue;
        DetailCounts& counts = *choice.view->counts;
        ++counts.hits;
        if (!choice.splits(node)) continue;
        const double ratio = choice.coarseness(node);
        for (std::size_t k = 0; k < counts.coarser.size() && ratio > static_cast<double>(1u << k); ++k)
            ++counts.coarser[k];
    }
    if (rocks_) rocks_->intersect(rays, scaled_rays, body, hits);
}

void TerrainShape::occlude(RayPacket& rays) const {
    TileCrossings found;
    ScaledRays scaled_rays;
    scaled_rays.active = rays.active;
    trace(rays, rays.t_max, true, found, scaled_rays);
    for (int i = 0; i < packet_size; ++i)
        if (found.t[i] != no_hit) rays.active.on[i] = 0;
    if (rocks_ && rays.active.any()) rocks_->occlude(rays, scaled_rays);
}

void TerrainShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                           SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 direction = rays.direction.lane(i);
        const bool hit = hits.body[i] == body && !RockTracer::is_hit(hits, i);
        const double t = hit ? hits.t[i] : 0.0;
        const Vec3 point = rays.origin.lane(i) + t * direction;
        const SurfaceNode& node = hit ? tiles_.in_slot(hits.primitive[i] >> 16) : *tiles_.root(0);
        const TileGradients gradients = TileTracer::gradients(
            tiles_.domain(), node, hit ? hits.primitive[i] & 0xffffu : 0,
            static_cast<double>(hit ? hits.u[i] : 0.0F), static_cast<double>(hit ? hits.v[i] : 0.0F));
        Vec3 facet = normalized(scaled(gradients.facet));
        Vec3 normal = normalized(scaled(gradients.smooth));
        const bool outside = dot(facet, direction) <= 0;
        if (!outside) {
            facet = -facet;
            normal = -normal;
        }
        out.position.set(i, point);
        out.normal.set(i, normal);
        out.facet_normal.set(i, facet);
        out.outside.on[i] = outside ? -1 : 0;
        // Secondary rays start clear of the rounding of the crossing, which is that of the body's size and of
        // the distance travelled so far; from a wall between levels, above the tile that it belongs to.
        const Vec3 base = outside && hit ? raised(point, gradients.height) : point;
        out.shadow_origin.set(i, base + (1e-10 * bounding_radius_m_ + 1e-13 * t) * facet);
    }
    if (rocks_) rocks_->surface(rays, hits, body, out);
}

bool TerrainShape::unresolved_slopes(const HitPacket& hits, std::int32_t body, Doubles& squared) const {
    if (!tiles_.keeps_lost_slopes()) return false;
    using terrain::slope_cells;
    for (int i = 0; i < packet_size; ++i) {
        squared[i] = 0;
        if (hits.body[i] != body || is_dark(hits, i) || RockTracer::is_hit(hits, i)) continue;
        const terrain::LostSlopes& kept = tiles_.in_slot(hits.primitive[i] >> 16).lost_slopes;
        const std::uint32_t cell = hits.primitive[i] & 0xffffu;
        const std::uint32_t ci = cell % terrain::tile_cells, cj = cell / terrain::tile_cells;
        const double s = (ci % slope_cells + static_cast<double>(hits.u[i])) / slope_cells;
        const double r = (cj % slope_cells + static_cast<double>(hits.v[i])) / slope_cells;
        const float* const corner = kept.data() + cj / slope_cells * terrain::slope_edge + ci / slope_cells;
        const auto at = [&](std::size_t n) { return static_cast<double>(corner[n]); };
        squared[i] = (1 - r) * ((1 - s) * at(0) + s * at(1)) +
                     r * ((1 - s) * at(terrain::slope_edge) + s * at(terrain::slope_edge + 1));
    }
    return true;
}

namespace {

/// What the widths and places of look-ups depend on, of 16 hits.
struct HitTiles {
    Doubles x, y;             ///< cells from the corner of the tile
    Doubles first_u, first_v; ///< cells of the face before the tile
    Doubles half_cells, spacing_m;
    Doubles shrink, beside_u, beside_v; ///< to the tile above that has the Sun's visibility
};

/// The footprint of a ray is as wide as `width_m` across it, and longer where the surface is seen obliquely;
/// cells are smaller off the middle of a face. Both by the root of the area.
OBSCURA_VECTOR_CLONES
void place_lookups(const HitTiles& tiles, const RayPacket& rays, const Vec3s& points, const Doubles& width_m,
                   bool plane, SunLookups& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double u = (tiles.first_u.v[i] + tiles.x.v[i]) / tiles.half_cells.v[i] - 1;
        const double v = (tiles.first_v.v[i] + tiles.y.v[i]) / tiles.half_cells.v[i] - 1;
        const double q2 = plane ? 1 : 1 + u * u + v * v;
        const double spacing_m = tiles.spacing_m.v[i] / std::sqrt(q2 * std::sqrt(q2));
        const double px = points.x.v[i], py = points.y.v[i], pz = points.z.v[i];
        const double dx = rays.direction.x.v[i], dy = rays.direction.y.v[i], dz = rays.direction.z.v[i];
        const double down =
            plane ? -dz : -(px * dx + py * dy + pz * dz) / std::sqrt(px * px + py * py + pz * pz);
        const double stretched = 1 / (down > 0.05 ? down : 0.05);
        const double shrink = tiles.shrink.v[i];
        out.x.v[i] = (tiles.x.v[i] + tiles.beside_u.v[i]) * shrink;
        out.y.v[i] = (tiles.y.v[i] + tiles.beside_v.v[i]) * shrink;
        out.width.v[i] = sun_texel_widths * width_m.v[i] * std::sqrt(stretched) / spacing_m * shrink;
    }
}

OBSCURA_VECTOR_CLONES
void split_means(const Vec3s& mean, SunlitPacket& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = mean.x.v[i], y = mean.y.v[i], z = mean.z.v[i];
        const double visible = std::sqrt(x * x + y * y + z * z), per = 1 / (visible > 0 ? visible : 1);
        out.visible.v[i] = visible;
        out.normal.x.v[i] = x * per;
        out.normal.y.v[i] = y * per;
        out.normal.z.v[i] = visible > 0 ? z * per : 1;
    }
}

} // namespace

bool TerrainShape::sunlit(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                          const Doubles& width_m, SunlitPacket& out) const {
    const SunVisibility* const kept = tiles_.sun_visibility();
    if (kept == nullptr || rays.detail == nullptr) return false;
    HitTiles places;
    SunLookups lookups;
    // Neighbouring rays mostly meet the same tile.
    const SurfaceNode* last = nullptr;
    const SunTile* found = nullptr;
    int levels = 0;
    for (int i = 0; i < packet_size; ++i) {
        const bool hit = hits.body[i] == body, dark = hit && is_dark(hits, i);
        out.position.set(i, rays.origin.lane(i) + (hit ? hits.t[i] : 0.0) * rays.direction.lane(i));
        out.known.on[i] = dark ? -1 : 0;
        places.x[i] = places.y[i] = places.first_u[i] = places.first_v[i] = 0;
        places.beside_u[i] = places.beside_v[i] = 0;
        places.half_cells[i] = places.spacing_m[i] = places.shrink[i] = 1;
        if (!hit || dark || RockTracer::is_hit(hits, i)) continue;
        SurfaceNode& node = tiles_.in_slot(hits.primitive[i] >> 16);
        if (&node != last) found = kept->find(node, *rays.detail, levels);
        last = &node;
        if (found == nullptr) continue;
        out.known.on[i] = -1;
        lookups.tile[static_cast<std::size_t>(i)] = found;
        const std::uint32_t cell = hits.primitive[i] & 0xffffu;
        places.x[i] = cell % terrain::tile_cells + static_cast<double>(hits.u[i]);
        places.y[i] = cell / terrain::tile_cells + static_cast<double>(hits.v[i]);
        const terrain::TileKey key = node.tile.key;
        places.first_u[i] = key.i * double{terrain::tile_cells};
        places.first_v[i] = key.j * double{terrain::tile_cells};
        places.half_cells[i] = node.half_cells;
        places.spacing_m[i] = node.spacing_m;
        if (levels == 0) continue;
        const std::uint32_t within = (1u << levels) - 1;
        places.shrink[i] = std::ldexp(1.0, -levels);
        places.beside_u[i] = (key.i & within) * double{terrain::tile_cells};
        places.beside_v[i] = (key.j & within) * double{terrain::tile_cells};
    }
    place_lookups(places, rays, out.position, width_m, plane_, lookups);
    Vec3s mean;
    sun_means(lookups, mean);
    split_means(mean, out);
    return true;
}

} // namespace obscura::renderer
