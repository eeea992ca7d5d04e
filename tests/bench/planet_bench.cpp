// SPDX-License-Identifier: Apache-2.0
// Rays per second of processor time on a planet of tiles, as JSON on standard output: with cells by distance,
// of at most --cell PX (1) pixels, and with the same grid everywhere. Options: --level N, finest grid, of 256
// * 2^N cells per face (5). --map FILE: heights of the whole Moon with a PDS3 label; without it, waves.
// --only TEXT: views with it in their names. --repeat N: the best of N runs (3). --threads 2: also the rays
// of two threads at once. --mesh N: also the mesh of the vertices of that level, through Embree. --tiles N:
// only makes N tiles of each of some levels.
#include "renderer/planets/terrain_shape.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "terrain/cube_sphere.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/maps/raster_layer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace {

using namespace obscura;
using namespace obscura::renderer;

constexpr double radius_m = 1737400;
constexpr double degree = std::numbers::pi / 180;
constexpr int frame = 512; ///< pixels along the edge of a view

double cpu_seconds(clockid_t clock = CLOCK_PROCESS_CPUTIME_ID) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Relief of about a kilometre down to some cells.
double waves(Vec3 p) {
    double sum = 0;
    for (double scale = 8; scale < 300; scale *= 1.7)
        sum += std::sin(scale * p.x + 1) * std::cos(scale * (p.y - p.z)) / scale;
    return 0.004 * sum;
}

std::shared_ptr<const Shape> mesh_of(const TerrainShape& shape, int level) {
    const std::uint32_t cells = static_cast<std::uint32_t>(terrain::tile_cells) << level;
    const LevelChoice levels{nullptr, 0, level};
    const TileTracer tracer(*shape.tiles(), levels);
    TriangleMesh mesh;
    for (const terrain::CubeFace& face : terrain::cube_faces) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (std::uint32_t j = 0; j <= cells; ++j)
            for (std::uint32_t i = 0; i <= cells; ++i) {
                const Vec3 q =
                    normalized(terrain::cube_point(face, 2.0 * i / cells - 1, 2.0 * j / cells - 1));
                const Vec3 p = radius_m * (1 + tracer.below(q).t) * q;
                mesh.vertices.push_back(
                    {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
            }
        for (std::uint32_t j = 0; j < cells; ++j)
            for (std::uint32_t i = 0; i < cells; ++i) {
                const std::uint32_t a = first + j * (cells + 1) + i, c = a + cells + 1;
                mesh.triangles.push_back({a, a + 1, c});
                mesh.triangles.push_back({a + 1, c + 1, c});
            }
    }
    return std::make_shared<MeshShape>(std::make_shared<const EmbreeDevice>(), std::move(mesh));
}

/// Packets of 4 x 4 pixels of a view.
std::vector<RayPacket> view(Vec3 from, Vec3 boresight, double half_field, const DetailView* detail) {
    Vec3 right, down;
    orthonormal_basis(boresight, right, down);
    std::vector<RayPacket> packets;
    for (int y = 0; y < frame; y += 4)
        for (int x = 0; x < frame; x += 4) {
            RayPacket& rays = packets.emplace_back();
            for (int i = 0; i < packet_size; ++i) {
                const double u = half_field * (2.0 * (x + i % 4 + 0.5) / frame - 1);
                const double v = half_field * (2.0 * (y + i / 4 + 0.5) / frame - 1);
                rays.origin.set(i, from);
                rays.direction.set(i, normalized(boresight + u * right + v * down));
                rays.t_max[i] = no_hit;
                rays.active.on[i] = -1;
                rays.level_u[i] = std::fmod(0.618033988749895 * (x + i % 4 + 7.3 * (y + i / 4)), 1.0);
            }
            rays.detail = detail;
        }
    return packets;
}

/// So many packets are traced between looks at the clock; before that, they are read: a renderer has made
/// them just then.
constexpr std::size_t batch = 32;

/// Calls `trace` with each of the packets; returns the seconds of the clock that it took.
template<typename Packets, typename Trace>
double seconds_of(Packets& packets, clockid_t clock, const Trace& trace) {
    double seconds = 0;
    for (std::size_t first = 0; first < packets.size(); first += batch) {
        const auto some = std::span(packets).subspan(first, std::min(batch, packets.size() - first));
        const auto bytes = std::as_bytes(some);
        std::byte read{};
        for (std::size_t k = 0; k < bytes.size(); k += 64)
            read ^= bytes[k];
        asm volatile("" ::"r"(read));
        const double begin = cpu_seconds(clock);
        for (auto& packet : some)
            trace(packet);
        seconds += cpu_seconds(clock) - begin;
    }
    return seconds;
}

/// Million rays a second; `met`: share of the rays that meet the shape.
double primary_rate(const Shape& shape, std::span<const RayPacket> packets, double& met,
                    clockid_t clock = CLOCK_PROCESS_CPUTIME_ID) {
    std::size_t hit = 0;
    const double seconds = seconds_of(packets, clock, [&](const RayPacket& rays) {
        HitPacket hits;
        hits.clear();
        shape.intersect(rays, 0, hits);
        for (const std::int32_t body : hits.body)
            hit += body == 0 ? 1 : 0;
    });
    const double rays = packet_size * static_cast<double>(packets.size());
    met = static_cast<double>(hit) / rays;
    return rays / seconds / 1e6;
}

/// Sum of the rates of two threads at once, each by its own processor time, over that of one: 2 if they share
/// nothing that slows them.
double two_threads(const Shape& shape, const std::vector<RayPacket>& packets, int repeats) {
    const std::span<const RayPacket> all(packets);
    const auto rate = [&](std::size_t thread, std::size_t threads) {
        const std::size_t each = all.size() / threads;
        double met = 0;
        return primary_rate(shape, all.subspan(thread * each, each), met, CLOCK_THREAD_CPUTIME_ID);
    };
    double one = 0, two = 0;
    for (int k = 0; k < repeats; ++k) {
        one = std::max(one, rate(0, 1));
        std::array<double, 2> rates{};
        {
            std::jthread other([&] { rates[1] = rate(1, 2); });
            rates[0] = rate(0, 2);
        }
        two = std::max(two, rates[0] + rates[1]);
    }
    return two / one;
}

/// Rays towards the Sun from the hits of `packets`; `met`: share of the surface that is dark.
double shadow_rate(const Shape& shape, const std::vector<RayPacket>& packets, Vec3 sun, double& met) {
    std::vector<RayPacket> shadows;
    for (const RayPacket& rays : packets) {
        HitPacket hits;
        hits.clear();
        shape.intersect(rays, 0, hits);
        SurfacePacket surface;
        shape.surface(rays, hits, 0, surface);
        RayPacket& shadow = shadows.emplace_back();
        shadow.origin = surface.shadow_origin;
        shadow.detail = rays.detail;
        shadow.level_u = rays.level_u;
        for (int i = 0; i < packet_size; ++i) {
            shadow.direction.set(i, sun);
            shadow.t_max[i] = no_hit;
            shadow.active.on[i] = hits.body[i] == 0 ? -1 : 0;
        }
    }
    int rays = 0, lit = 0;
    for (const RayPacket& shadow : shadows)
        rays += shadow.active.count();
    const double seconds = seconds_of(shadows, CLOCK_PROCESS_CPUTIME_ID, [&](RayPacket& shadow) {
        shape.occlude(shadow);
        lit += shadow.active.count();
    });
    met = 1 - static_cast<double>(lit) / rays;
    return rays / seconds / 1e6;
}

/// Heights of a function of the direction, m.
class FunctionLayer final : public terrain::HeightLayer {
public:
    FunctionLayer(std::function<double(Vec3)> height_m, double min_m, double largest_m)
        : height_m_(std::move(height_m)), range_{min_m, largest_m} {}

    void apply(const terrain::VertexGrid& grid, std::span<double> heights_m,
               std::span<double> /*sample_spacings_m*/) const override {
        for (std::size_t k = 0; k < heights_m.size(); ++k)
            heights_m[k] = height_m_(grid.positions_m[k]);
    }
    [[nodiscard]] terrain::HeightRange range(const terrain::Cap& /*cap*/, double /*spacing_m*/,
                                             terrain::HeightRange /*below*/) const override {
        return range_;
    }

private:
    std::function<double(Vec3)> height_m_;
    terrain::HeightRange range_;
};

/// Milliseconds of processor time to make a tile of that level.
double tile_ms(const terrain::TileMaker& maker, int level, int count) {
    terrain::TileMaker::Scratch scratch;
    const auto tile = std::make_unique<terrain::SurfaceTile>();
    const double begin = cpu_seconds();
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(count); ++k) {
        const std::uint32_t mask = (1u << level) - 1, mixed = (k + 1) * 0x9e3779b9u;
        maker.make({static_cast<std::uint8_t>(k % 6), static_cast<std::uint8_t>(level), mixed >> 16 & mask,
                    mixed >> 4 & mask},
                   scratch, *tile);
    }
    return 1e3 * (cpu_seconds() - begin) / count;
}

} // namespace

int main(int argc, char** argv) {
    int finest = 5, mesh_level = -1, tiles = 0, repeats = 3;
    double cell_px = 1;
    std::optional<std::string> map;
    std::string only;
    bool threads = false;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--level") == 0) finest = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--mesh") == 0) mesh_level = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--cell") == 0) cell_px = std::atof(argv[i + 1]);
        if (std::strcmp(argv[i], "--tiles") == 0) tiles = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--repeat") == 0) repeats = std::atoi(argv[i + 1]);
        if (std::strcmp(argv[i], "--threads") == 0) threads = std::atoi(argv[i + 1]) == 2;
        if (std::strcmp(argv[i], "--only") == 0) only = argv[i + 1];
        if (std::strcmp(argv[i], "--map") == 0) map = argv[i + 1];
    }
    const auto domain = terrain::SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m});
    std::vector<std::shared_ptr<const terrain::HeightLayer>> layers;
    if (map) {
        terrain::MapKeys keys;
        keys.file = *map;
        terrain::MapFindings found;
        layers.push_back(std::make_shared<terrain::RasterLayer>(domain, open_map(keys, domain, found)));
    } else {
        layers.push_back(std::make_shared<FunctionLayer>(
            [](Vec3 p) { return radius_m * waves(p / radius_m); }, -0.0013 * radius_m, 0.0013 * radius_m));
    }
    if (tiles > 0) {
        const terrain::TileMaker maker(domain, layers);
        const char* comma = "";
        fmt::print("{{\n  \"tile_cpu_ms\": [");
        for (const int level : {0, 2, 3, 5, 8, 12}) {
            fmt::print("{}\n    {{\"level\": {}, \"cpu_ms\": {:.2f}}}", comma, level,
                       tile_ms(maker, level, tiles));
            comma = ",";
        }
        fmt::print("\n  ]\n}}\n");
        return 0;
    }
    const auto shape_at = [&](int level) {
        TerrainShape::Settings settings;
        settings.fixed_level = level;
        settings.tiles.arena_bytes = std::uint64_t{4} << 30;
        return std::make_unique<TerrainShape>(domain, layers, settings);
    };
    const Vec3 up = normalized(Vec3{0.3, -0.8, 0.5});
    Vec3 east, north;
    orthonormal_basis(up, east, north);

    const char* separator = "";
    const auto measure = [&](const char* name, const Shape& shape) {
        const auto print = [&](std::string_view view, double rate, double met) {
            fmt::print("{}\n    {{\"surface\": \"{}\", \"view\": \"{}\", \"Mrays_per_s\": {:.2f}, "
                       "\"met\": {:.4f}}}",
                       separator, name, view, rate, met);
            separator = ",";
            std::fflush(stdout);
        };
        const auto show = [&](const char* view_name, double altitude_m, double off_nadir, double half_field,
                              bool shadows) {
            if (std::string_view(view_name).find(only) == std::string_view::npos) return;
            const Vec3 from = (radius_m + altitude_m) * up;
            const DetailView detail{.eye_m = from, .cell_rad = cell_px * 2 * half_field / frame};
            const auto packets = view(from, normalized(std::sin(off_nadir) * east - std::cos(off_nadir) * up),
                                      half_field, &detail);
            double met = 0;
            primary_rate(shape, packets, met); // makes the tiles
            double rate = 0;
            for (int k = 0; k < repeats; ++k)
                rate = std::max(rate, primary_rate(shape, packets, met));
            print(view_name, rate, met);
            if (threads)
                fmt::print(
                    "{}\n    {{\"surface\": \"{}\", \"view\": \"{}\", \"two_threads_over_one\": {:.2f}}}",
                    separator, name, view_name, two_threads(shape, packets, repeats));
            if (!shadows) return;
            for (const double elevation : {60.0, 20.0, 5.0, 1.5}) {
                const Vec3 sun = std::sin(elevation * degree) * up + std::cos(elevation * degree) * north;
                shadow_rate(shape, packets, sun, met);
                double shadows_per_s = 0;
                for (int k = 0; k < repeats; ++k)
                    shadows_per_s = std::max(shadows_per_s, shadow_rate(shape, packets, sun, met));
                print(fmt::format("shadow, Sun at {} deg", elevation), shadows_per_s, met);
            }
        };
        show("disc, 6000 km", 6e6, 0, 0.24, false);
        show("limb, 100 km", 1e5, std::asin(radius_m / (radius_m + 1e5)), 0.1, false);
        show("grazing, 20 km", 2e4, std::asin(radius_m / (radius_m + 2e4)) - 0.02, 0.1, false);
        show("nadir, 100 km", 1e5, 0, 0.6, false);
        show("nadir, 15 km", 1.5e4, 0, 0.6, true);
    };
    fmt::print("{{\n  \"views\": [");
    {
        const auto shape = shape_at(-1);
        const SurfaceTiles::Pin pin = shape->tiles()->pin();
        const double begin = cpu_seconds();
        shape->tiles()->make_pinned();
        const double tile_s = (cpu_seconds() - begin) / 120;
        measure(fmt::format("cells of at most {} px", cell_px).c_str(), *shape);
        const SurfaceTiles::Usage usage = shape->tiles()->usage();
        fmt::print("\n  ],\n  \"tile_cpu_ms\": {:.2f}, \"tiles\": {}, \"arena_MiB\": {:.0f},\n  \"grids\": [",
                   1e3 * tile_s, usage.tiles,
                   static_cast<double>(usage.tiles * SurfaceTiles::slot_bytes()) / (1 << 20));
        separator = "";
    }
    for (const int level : {0, 2, 5, 6})
        if (level <= finest) {
            const auto shape = shape_at(level);
            const SurfaceTiles::Pin pin = shape->tiles()->pin();
            measure(fmt::format("{} cells", terrain::tile_cells << level).c_str(), *shape);
        }
    if (mesh_level >= 0) {
        const auto shape = shape_at(mesh_level);
        measure(fmt::format("mesh, {} cells", terrain::tile_cells << mesh_level).c_str(),
                *mesh_of(*shape, mesh_level));
    }
    fmt::print("\n  ]\n}}\n");
}
