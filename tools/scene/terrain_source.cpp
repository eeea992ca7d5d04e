// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/terrain_source.hpp"

#include "core/io/stop_reading.hpp"
#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::tools {

using namespace terrain;

namespace {

constexpr std::size_t kept_tiles = 512;
/// Samples of a block that a thread makes at a time: about the width of a tile.
constexpr int block_edge = 128;

/// Weights of Catmull-Rom splines for the four samples about a place.
std::array<double, 4> cubic_weights(double t) {
    return {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t), t * (0.5 + t * (2 - 1.5 * t)),
            t * t * (-0.5 + 0.5 * t)};
}

} // namespace

TerrainSource::TerrainSource(const TileMaker& maker, const MapFrame& frame, double spacing_m)
    : maker_(maker), frame_(frame), tiles_(kept_tiles) {
    while (level_ < deepest_level && maker.domain().spacing_m(level_) > 0.5 * spacing_m)
        ++level_;
}

std::shared_ptr<const SurfaceTile> TerrainSource::tile(TileKey key, TileMaker::Scratch& scratch) {
    if (auto there = tiles_.find(key)) return there;
    auto made = std::make_shared<SurfaceTile>();
    maker_.make(key, scratch, *made);
    tiles_.insert(key, made);
    return made;
}

double TerrainSource::height_m(SamplePlace place, TileMaker::Scratch& scratch,
                               std::shared_ptr<const SurfaceTile>& last) {
    const SurfaceDomain& domain = maker_.domain();
    const Vec3 p = frame_.position(place);
    TileKey key;
    key.level = static_cast<std::uint8_t>(level_);
    double u = 0, v = 0, to_metres = 1;
    if (domain.is_plane()) {
        u = p.x / domain.half_edge_m();
        v = p.y / domain.half_edge_m();
    } else {
        const Vec3 r = domain.radii_m();
        const Vec3 q = normalized(Vec3{p.x / r.x, p.y / r.y, p.z / r.z});
        key.face = static_cast<std::uint8_t>(cube_face_of(q));
        const CubeFace& face = cube_faces[key.face];
        const double w = face.sign * component(q, face.axis);
        u = component(q, face.u_axis) / w;
        v = component(q, face.v_axis) / w;
        to_metres = length(Vec3{q.x * r.x, q.y * r.y, q.z * r.z}) / domain.unit_m();
    }
    const double cells = std::ldexp(double{tile_cells}, level_);
    const double x = std::clamp((u + 1) / 2, 0.0, 1.0) * cells, y = std::clamp((v + 1) / 2, 0.0, 1.0) * cells;
    const auto cell = [&](double at) { return std::min(std::floor(at), cells - 1); };
    key.i = static_cast<std::uint32_t>(cell(x) / tile_cells);
    key.j = static_cast<std::uint32_t>(cell(y) / tile_cells);
    if (!last || last->key != key) last = tile(key, scratch);
    const auto i = static_cast<std::int32_t>(cell(x) - double{tile_cells} * key.i);
    const auto j = static_cast<std::int32_t>(cell(y) - double{tile_cells} * key.j);
    const std::array<double, 4> across = cubic_weights(x - cell(x)), down = cubic_weights(y - cell(y));
    double height = 0;
    for (std::int32_t b = 0; b < 4; ++b) {
        const float* const line = last->vertex(i - 1, j - 1 + b);
        double sum = 0;
        for (std::size_t a = 0; a < 4; ++a)
            sum += across[a] * static_cast<double>(line[a]);
        height += down[static_cast<std::size_t>(b)] * sum;
    }
    return (last->offset_m + height) * to_metres;
}

void TerrainSource::read(std::uint32_t /*plane*/, std::int64_t x, std::int64_t y, int columns, int rows,
                         std::span<float> out) {
    const int across = (columns + block_edge - 1) / block_edge, down = (rows + block_edge - 1) / block_edge;
    std::atomic<int> next{0};
    std::exception_ptr error;
    std::mutex mutex;
    const auto work = [&] {
        TileMaker::Scratch scratch;
        std::shared_ptr<const SurfaceTile> last;
        try {
            for (int block = next++; block < across * down; block = next++)
                for (int row = block / across * block_edge;
                     row < std::min(rows, (block / across + 1) * block_edge); ++row) {
                    check_reading();
                    for (int column = block % across * block_edge;
                         column < std::min(columns, (block % across + 1) * block_edge); ++column)
                        out[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                            static_cast<std::size_t>(column)] =
                            static_cast<float>(
                                height_m({static_cast<double>(x + column), static_cast<double>(y + row)},
                                         scratch, last));
                }
        } catch (...) {
            const std::lock_guard lock(mutex);
            error = std::current_exception();
            next = across * down;
        }
    };
    std::vector<std::thread> threads;
    for (unsigned k = 1; k < std::thread::hardware_concurrency(); ++k)
        threads.emplace_back(work);
    work();
    for (std::thread& thread : threads)
        thread.join();
    if (error) std::rethrow_exception(error);
}

} // namespace obscura::tools
