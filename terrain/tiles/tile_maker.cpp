// SPDX-License-Identifier: Apache-2.0
#include "terrain/tiles/tile_maker.hpp"

#include "terrain/tiles/tile_kernels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace obscura::terrain {
namespace {

/// Distances of the reference surface from the centre.
struct Radii {
    double least, largest;
};

/// Over a tile, from nine points of it: between them the square of the distance is close to linear, and
/// differs from it by less than the square of their angle.
Radii radii_over(const SurfaceDomain& domain, TileKey key) {
    const Vec3 r = domain.radii_m();
    const double smallest = std::min({r.x, r.y, r.z}), greatest = std::max({r.x, r.y, r.z});
    if (key.level < 2 || smallest == greatest) return {smallest, greatest};
    Radii radii{greatest, smallest};
    for (int j = 0; j <= tile_cells; j += tile_cells / 2)
        for (int i = 0; i <= tile_cells; i += tile_cells / 2) {
            const double at = length(domain.point(key.face, SurfaceDomain::coordinate(key.level, key.i, i),
                                                  SurfaceDomain::coordinate(key.level, key.j, j)));
            radii = {std::min(radii.least, at), std::max(radii.largest, at)};
        }
    const double step = std::ldexp(1.0, -key.level);
    const double ratio = greatest / smallest;
    const double slack = 4 * (greatest - smallest) * ratio * ratio * step * step;
    return {std::max(radii.least - slack, smallest), std::min(radii.largest + slack, greatest)};
}

void make_pyramid(SurfaceTile& tile) {
    std::uint32_t edge = tile_cells / 2;
    float* const finest = tile.maxima.data() + SurfaceTile::pyramid_offset(1);
    for (std::uint32_t j = 0; j < edge; ++j) {
        const auto row = static_cast<std::int32_t>(2 * j);
        make_row_maxima(tile.vertex(0, row), tile.vertex(0, row + 1), tile.vertex(0, row + 2),
                        finest + std::size_t{j} * edge);
    }
    for (int level = 2; level <= pyramid_levels; ++level) {
        const float* const finer = tile.maxima.data() + SurfaceTile::pyramid_offset(level - 1);
        float* const here = tile.maxima.data() + SurfaceTile::pyramid_offset(level);
        edge /= 2;
        for (std::uint32_t j = 0; j < edge; ++j)
            for (std::uint32_t i = 0; i < edge; ++i) {
                const float* const four = finer + std::size_t{4} * edge * j + std::size_t{2} * i;
                here[j * edge + i] =
                    std::max(std::max(four[0], four[1]), std::max(four[2 * edge], four[2 * edge + 1]));
            }
    }
}

} // namespace

TileMaker::TileMaker(SurfaceDomain domain, std::vector<std::shared_ptr<const HeightLayer>> layers)
    : domain_(domain), layers_(std::move(layers)) {}

Cap TileMaker::cap(TileKey key) const {
    return cap_of(domain_, key);
}

std::size_t TileMaker::lowest_seen(const Cap& cap) const {
    std::size_t first = layers_.size();
    while (first > 0)
        if (layers_[--first]->hides_below(cap)) return first;
    return 0;
}

double TileMaker::sample_spacing_m(std::size_t layer, Vec3 position_m) const {
    double spacing_m = std::numeric_limits<double>::infinity();
    for (std::size_t below = 0; below < layer; ++below)
        if (const double own = layers_[below]->sample_spacing_m(position_m); own > 0)
            spacing_m = std::min(spacing_m, own);
    return spacing_m;
}

HeightRange TileMaker::layers_range(const Cap& cap, double spacing_m) const {
    HeightRange range;
    for (std::size_t k = lowest_seen(cap); k < layers_.size(); ++k)
        range = layers_[k]->range(cap, spacing_m, range);
    return range;
}

ReducedRange TileMaker::range(TileKey key) const {
    const HeightRange metres = layers_range(cap(key), domain_.spacing_m(key.level));
    const double step = height_step_m(domain_, key.level);
    if (domain_.is_plane()) return {metres.least - step, metres.largest + step};
    const Radii radii = radii_over(domain_, key);
    const double near = domain_.unit_m() / radii.least, far = domain_.unit_m() / radii.largest;
    return {metres.least * (metres.least < 0 ? near : far) - step,
            metres.largest * (metres.largest > 0 ? near : far) + step};
}

void TileMaker::make_positions(TileKey key, Scratch& scratch) const {
    scratch.positions_m.resize(tile_vertices);
    scratch.reductions.resize(tile_vertices);
    const auto beyond = [](double coordinate) { return std::abs(coordinate) > 1; };
    TileRow u{};
    for (int i = 0; i < tile_edge; ++i)
        u[static_cast<std::size_t>(i)] = SurfaceDomain::coordinate(key.level, key.i, i - tile_margin);
    for (int j = 0; j < tile_edge; ++j) {
        const double v = SurfaceDomain::coordinate(key.level, key.j, j - tile_margin);
        const std::size_t row = static_cast<std::size_t>(j) * tile_edge;
        const auto one_by_one = [&](std::size_t i) {
            const Vec3 p = domain_.point(key.face, u[i], v);
            scratch.positions_m[row + i] = p;
            scratch.reductions[row + i] = domain_.is_plane() ? 1 : domain_.unit_m() / length(p);
        };
        if (domain_.is_plane() || beyond(v)) {
            for (std::size_t i = 0; i < std::size_t{tile_edge}; ++i)
                one_by_one(i);
            continue;
        }
        make_row_points(domain_, key.face, u, v, scratch.positions_m.data() + row,
                        scratch.reductions.data() + row);
        for (const std::size_t i : {std::size_t{0}, std::size_t{tile_edge - 1}})
            if (beyond(u[i])) one_by_one(i);
    }
}

std::size_t TileMaker::make(TileKey key, Scratch& scratch, SurfaceTile& out) const {
    scratch.heights_m.assign(tile_vertices, 0);
    scratch.sample_spacings_m.assign(tile_vertices, std::numeric_limits<double>::infinity());
    make_positions(key, scratch);
    const VertexGrid grid{key, scratch.positions_m, domain_.spacing_m(key.level), cap(key)};
    for (std::size_t k = lowest_seen(grid.cap); k < layers_.size(); ++k)
        layers_[k]->apply(grid, scratch.heights_m, scratch.sample_spacings_m);

    const double step = height_step_m(domain_, key.level);
    const ReducedRange bounds = range(key);
    const QuantizedRange made =
        quantize({step, bounds.least, bounds.largest}, scratch.heights_m.data(),
                 domain_.is_plane() ? nullptr : scratch.reductions.data(), tile_vertices);
    out.key = key;
    out.min_m = made.least;
    out.offset_m = step * std::nearbyint((made.least + made.largest) / 2 / step);
    store_heights(scratch.heights_m.data(), out.offset_m, tile_vertices, out.heights.data());
    make_pyramid(out);
    return made.outside;
}

LostSlopes TileMaker::lost_slopes(TileKey key, const Scratch& scratch) const {
    constexpr std::size_t count = std::tuple_size_v<LostSlopes>;
    std::vector<Vec3> positions;
    std::vector<double> spacings, lost(count);
    for (int j = 0; j <= tile_cells; j += slope_cells)
        for (int i = 0; i <= tile_cells; i += slope_cells) {
            const std::size_t n = static_cast<std::size_t>(j + tile_margin) * tile_edge +
                                  static_cast<std::size_t>(i + tile_margin);
            positions.push_back(scratch.positions_m[n]);
            spacings.push_back(scratch.sample_spacings_m[n]);
        }
    for (std::size_t k = lowest_seen(cap(key)); k < layers_.size(); ++k)
        layers_[k]->add_lost_slopes(positions, domain_.spacing_m(key.level), spacings, lost);
    LostSlopes out;
    for (std::size_t n = 0; n < count; ++n)
        out[n] = static_cast<float>(lost[n]);
    return out;
}

} // namespace obscura::terrain
