// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/terrain_shape.hpp"

#include "renderer/planets/sun_visibility.hpp"

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
      notes_(settings.notes) {}

LevelChoice TerrainShape::levels(const RayPacket& rays, int i) const {
    if (fixed_level_ >= 0) return {nullptr, 0, fixed_level_};
    if (rays.detail == nullptr) return {nullptr, 0, query_level_};
    // Between one and two times the distance at which cells are as small as asked for, so that none is wider.
    return {rays.detail, (1 + rays.level_u[i]) / rays.detail->cell_rad, 0};
}

Vec3 TerrainShape::raised(Vec3 point, double height) const {
    const Vec3 p = scaled(point);
    if (tiles_.domain().is_plane())
        return p.z < height ? Vec3{point.x, point.y, height * tiles_.domain().half_edge_m()} : point;
    const double radius = length(p);
    return radius < 1 + height ? point * ((1 + height) / radius) : point;
}

void TerrainShape::trace(const RayPacket& rays, const Doubles& t_max, bool any,
                         std::array<TileCrossing, packet_size>& found, ScaledRays& scaled_rays) const {
    for (int i = 0; i < packet_size; ++i) {
        if (rays.active.on[i] == 0) continue;
        scaled_rays.origin.set(i, scaled(rays.origin.lane(i)));
        scaled_rays.direction.set(i, scaled(rays.direction.lane(i)));
        scaled_rays.levels[static_cast<std::size_t>(i)] = levels(rays, i);
    }
    scaled_rays.t_max = t_max;
    scaled_rays.active = rays.active;
    first_crossings(tiles_, scaled_rays, any, found);
}

void TerrainShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    Doubles t_max;
    for (int i = 0; i < packet_size; ++i)
        t_max[i] = std::min(rays.t_max[i], hits.t[i]);
    std::array<TileCrossing, packet_size> found;
    ScaledRays scaled_rays;
    trace(rays, t_max, false, found, scaled_rays);
    for (int i = 0; i < packet_size; ++i) {
        const TileCrossing& crossing = found[static_cast<std::size_t>(i)];
        if (rays.active.on[i] == 0 || crossing.t == no_hit) continue;
        hits.t[i] = crossing.t;
        hits.body[i] = body;
        hits.primitive[i] = crossing.node->slot << 16 | crossing.cell;
        hits.u[i] = static_cast<float>(crossing.s);
        hits.v[i] = static_cast<float>(crossing.r);
        const LevelChoice& choice = scaled_rays.levels[static_cast<std::size_t>(i)];
        if (choice.view == nullptr || choice.view->counts == nullptr) continue;
        DetailCounts& counts = *choice.view->counts;
        ++counts.hits;
        if (!choice.splits(*crossing.node)) continue;
        const double ratio = choice.coarseness(*crossing.node);
        for (std::size_t k = 0; k < counts.coarser.size() && ratio > static_cast<double>(1u << k); ++k)
            ++counts.coarser[k];
    }
}

void TerrainShape::occlude(RayPacket& rays) const {
    std::array<TileCrossing, packet_size> found;
    ScaledRays scaled_rays;
    trace(rays, rays.t_max, true, found, scaled_rays);
    for (int i = 0; i < packet_size; ++i)
        if (found[static_cast<std::size_t>(i)].t != no_hit) rays.active.on[i] = 0;
}

void TerrainShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                           SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 direction = rays.direction.lane(i);
        const bool hit = hits.body[i] == body;
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
}

bool TerrainShape::sunlit(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                          const Doubles& width_m, SunlitPacket& out) const {
    const SunVisibility* const kept = tiles_.sun_visibility();
    if (kept == nullptr || rays.detail == nullptr) return false;
    for (int i = 0; i < packet_size; ++i) {
        out.known.on[i] = 0;
        out.visible[i] = 0;
        const Vec3 direction = rays.direction.lane(i);
        const bool hit = hits.body[i] == body;
        const Vec3 point = rays.origin.lane(i) + (hit ? hits.t[i] : 0.0) * direction;
        out.position.set(i, point);
        out.normal.set(i, {0, 0, 1});
        if (!hit) continue;
        SurfaceNode& node = tiles_.in_slot(hits.primitive[i] >> 16);
        int levels = 0;
        const SunTile* const tile = kept->find(node, *rays.detail, levels);
        if (tile == nullptr) continue;
        out.known.on[i] = -1;
        const std::uint32_t cell = hits.primitive[i] & 0xffffu, row = cell / terrain::tile_cells;
        double x = cell % terrain::tile_cells + static_cast<double>(hits.u[i]),
               y = row + static_cast<double>(hits.v[i]);
        // Cells are smaller off the middle of a face: by the root of the ratio of areas.
        const terrain::TileKey key = node.tile.key;
        const double u = (key.i * double{terrain::tile_cells} + x) / node.half_cells - 1,
                     v = (key.j * double{terrain::tile_cells} + y) / node.half_cells - 1;
        const double q2 = plane_ ? 1 : 1 + u * u + v * v;
        const double spacing_m = node.spacing_m / std::sqrt(q2 * std::sqrt(q2));
        // The footprint is longer where the surface is seen obliquely; again by the root of the area.
        const Vec3 outwards = plane_ ? Vec3{0, 0, 1} : normalized(point);
        const double stretched = 1 / std::max(-dot(outwards, direction), 0.05);
        double width = sun_texel_widths * width_m[i] * std::sqrt(stretched) / spacing_m;
        for (const SurfaceNode* at = &node; levels > 0; --levels, at = at->parent) {
            x = (x + (at->tile.key.i & 1u) * terrain::tile_cells) / 2;
            y = (y + (at->tile.key.j & 1u) * terrain::tile_cells) / 2;
            width /= 2;
        }
        const Vec3 mean = tile->mean(x, y, width);
        const double visible = length(mean);
        if (!(visible > 0)) continue;
        out.visible[i] = visible;
        out.normal.set(i, mean / visible);
    }
    return true;
}

} // namespace obscura::renderer
