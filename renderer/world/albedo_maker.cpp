// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/albedo_maker.hpp"

#include "core/error.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/obt/obt_file.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace obscura::renderer {
namespace {

static_assert(max_albedo_tables <= NestedAlbedo::max_sources);

AlbedoSource open_source(const AlbedoTable& table, const terrain::SurfaceDomain& domain) {
    terrain::MapLabel label;
    const bool srgb = table.coding == AlbedoCoding::srgb;
    const bool giant = terrain::ObtFile::is_one(table.file);
    if (giant) {
        const terrain::ObtFile texture(table.file);
        const terrain::ObtMetadata& m = texture.metadata();
        if (m.kind == terrain::ObtKind::heights)
            throw std::invalid_argument("a giant texture of heights, wanted is one of albedo");
        label.projection = m.projection;
        label.transform = m.transform;
        label.registration = m.registration;
    }
    AlbedoSource source;
    source.name = table.file;
    source.priority = table.priority;
    if (table.feather_m > 0) source.feather_m = table.feather_m;
    source.map = read_map_texture(
        table.file, srgb ? TextureCoding::srgb : TextureCoding::linear,
        [&](std::int64_t width, std::int64_t height) {
            if (!giant) label = terrain::read_map_label(table.file, width, height);
            source.frame = terrain::map_frame(table.map, label, domain, width, height);
            return source.frame.period() > 0 ? Texture::Edge::clamp : Texture::Edge::clamp_both;
        });
    source.gain = table.scale;
    if (!giant && !srgb && (label.scale_m != 1 || label.offset_m != 0)) {
        source.gain = table.scale * label.scale_m * source.map.full_scale;
        source.offset = table.scale * label.offset_m;
    }
    return source;
}

/// The reference surface as text.
std::string surface_of_body(const terrain::SurfaceDomain& domain) {
    const Vec3 r = domain.radii_m();
    return fmt::format("{} {} {} {}", domain.half_edge_m(), r.x, r.y, r.z);
}

} // namespace

std::shared_ptr<const NestedAlbedo> open_albedo(const std::vector<AlbedoTable>& tables,
                                                const terrain::SurfaceDomain& domain,
                                                const std::vector<SpectralBand>& bands) {
    if (tables.empty()) return nullptr;
    std::vector<AlbedoSource> sources;
    for (const AlbedoTable& table : tables)
        try {
            sources.push_back(open_source(table, domain));
        } catch (const std::invalid_argument& error) {
            throw InputError(fmt::format("{}: {}", table.file, error.what()));
        }
    return std::make_shared<const NestedAlbedo>(domain, std::move(sources), bands);
}

std::shared_ptr<const NestedAlbedo> AlbedoMaker::make(const scene::Shape& shape) {
    const auto opened = [&](const auto* p) -> std::shared_ptr<const NestedAlbedo> {
        if (p == nullptr || p->relief.albedos.empty()) return nullptr;
        const terrain::SurfaceDomain domain = domain_of(*p);
        auto& albedo = made_[surface_of_body(domain) + "\n" + identity_of(p->relief.albedos)];
        if (!albedo) albedo = open_albedo(p->relief.albedos, domain, bands_);
        return albedo;
    };
    auto albedo = opened(shape.get_if<PlanetParameters>());
    return albedo ? albedo : opened(shape.get_if<TerrainParameters>());
}

} // namespace obscura::renderer
