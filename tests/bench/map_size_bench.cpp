// SPDX-License-Identifier: Apache-2.0
// Cost of views of one terrain from giant textures of 2 MB to 1 TB of heights, as JSON on standard output:
// processor time of the tiles that a view needs, rays per second, memory. All files have the same content, at
// finer and finer samples: the cost would grow with the data if any of it did.
//
// The files are sparse: of levels with more than 4096 columns only tiles within 8 of their size of the point
// under the cameras are written, which is more than the views read; they say the size of all. Options:
// --folder PATH, where they are made one after the other and removed (the system's temporary folder; 300 MB
// at most); --columns N: one file, of that many samples around the equator.
#include "renderer/planets/terrain_shape.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/maps/raster_layer.hpp"
#include "terrain/obt/obt_tile_writer.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace obscura;
using namespace obscura::renderer;
using terrain::obt::margin;
using terrain::obt::stored_tile_edge;
using terrain::obt::tile_samples;

constexpr double radius_m = 1737400;
constexpr double pi = std::numbers::pi;
constexpr int frame = 512; ///< pixels along the edge of a view
constexpr std::int64_t whole_columns = 4096;
constexpr double near_tiles = 8;
const Vec3 under = normalized(Vec3{0.6, -0.7, 0.3}); ///< the point under the cameras

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double resident_mib() {
    std::ifstream statm("/proc/self/statm");
    double pages = 0, resident = 0;
    statm >> pages >> resident;
    return resident * 4096 / (1 << 20);
}

/// Metres; nothing shorter than 50 km, so that the coarsest file has all of it.
double height_m(Vec3 p) {
    double sum = 0;
    for (double scale = 8; scale < 220; scale *= 1.7)
        sum += std::sin(scale * p.x + 1) * std::cos(scale * (p.y - p.z)) / scale;
    return 0.004 * radius_m * sum;
}

/// A texture of the whole Moon with that many columns.
std::filesystem::path write_map(const std::filesystem::path& folder, std::int64_t columns) {
    terrain::ObtMetadata m;
    m.kind = terrain::ObtKind::heights;
    m.type = terrain::SampleType::u16;
    m.width = columns;
    m.height = columns / 2;
    m.scale = 0.125;
    m.offset = -4096;
    m.semi_axes_m = {radius_m, radius_m, radius_m};
    m.projection = terrain::Projection::of_sphere(terrain::ProjectionKind::simple_cylindrical, radius_m);
    const double step = 2 * pi * radius_m / static_cast<double>(columns);
    m.transform = {-pi * radius_m, step, 0, pi * radius_m / 2, 0, -step};
    const terrain::MapFrame map = m.frame();
    const auto file = folder / "map.obt";
    terrain::ObtTileWriter writer(file, m, std::uint64_t{1} << 42, false);
    const terrain::SamplePlace middle = map.place(under);
    std::vector<float> numbers(terrain::obt::tile_count);
    for (int level = 0; level < writer.layout().levels(); ++level) {
        const double scale = std::ldexp(1.0, level);
        const std::int64_t across = writer.layout().tiles_across(level),
                           down = writer.layout().tiles_down(level);
        const double i0 = middle.x / scale / tile_samples, j0 = middle.y / scale / tile_samples;
        const bool whole = (columns >> level) <= whole_columns;
        const auto first = [&](double at) {
            return whole ? 0 : std::max<std::int64_t>(0, static_cast<std::int64_t>(at - near_tiles));
        };
        const auto last = [&](double at, std::int64_t count) {
            return whole ? count - 1 : std::min(count - 1, static_cast<std::int64_t>(at + near_tiles));
        };
        for (std::int64_t j = first(j0); j <= last(j0, down); ++j)
            for (std::int64_t i = first(i0); i <= last(i0, across); ++i) {
                float least = 65535, largest = 0;
                for (int y = 0; y < stored_tile_edge; ++y)
                    for (int x = 0; x < stored_tile_edge; ++x) {
                        const double column = static_cast<double>(i * tile_samples + x - margin) + 0.5;
                        const double row = static_cast<double>(j * tile_samples + y - margin) + 0.5;
                        const Vec3 p = map.position({column * scale - 0.5, row * scale - 0.5});
                        const auto number =
                            static_cast<float>(std::round((height_m(p) - m.offset) / m.scale));
                        numbers[static_cast<std::size_t>(y * stored_tile_edge + x)] = number;
                        least = std::min(least, number);
                        largest = std::max(largest, number);
                    }
                writer.write({0, level, i, j}, numbers, {least, largest, 0});
            }
    }
    (void)writer.finish();
    return file;
}

/// Packets of 4 x 4 pixels.
std::vector<RayPacket> view(Vec3 from, double half_field, const DetailView* detail) {
    Vec3 right, down;
    orthonormal_basis(-under, right, down);
    std::vector<RayPacket> packets;
    for (int y = 0; y < frame; y += 4)
        for (int x = 0; x < frame; x += 4) {
            RayPacket& rays = packets.emplace_back();
            for (int i = 0; i < packet_size; ++i) {
                const double u = half_field * (2.0 * (x + i % 4 + 0.5) / frame - 1);
                const double v = half_field * (2.0 * (y + i / 4 + 0.5) / frame - 1);
                rays.origin.set(i, from);
                rays.direction.set(i, normalized(-under + u * right + v * down));
                rays.t_max[i] = no_hit;
                rays.active.on[i] = -1;
                rays.level_u[i] = std::fmod(0.618033988749895 * (x + i % 4 + 7.3 * (y + i / 4)), 1.0);
            }
            rays.detail = detail;
        }
    return packets;
}

double trace_seconds(const Shape& shape, const std::vector<RayPacket>& packets) {
    const double begin = cpu_seconds();
    for (const RayPacket& rays : packets) {
        HitPacket hits;
        hits.clear();
        shape.intersect(rays, 0, hits);
    }
    return cpu_seconds() - begin;
}

struct View {
    const char* name;
    double altitude_m, half_field;
};
constexpr View views[] = {
    {"disc, 6000 km", 6e6, 0.24}, {"nadir, 100 km", 1e5, 0.6}, {"nadir, 15 km", 1.5e4, 0.6}};

} // namespace

int main(int argc, char** argv) {
    std::filesystem::path folder = std::filesystem::temp_directory_path();
    std::vector<std::int64_t> sizes{1448, 1 << 13, 1 << 15, 1 << 17, 1 << 20};
    for (int i = 1; i + 1 < argc; i += 2)
        if (std::strcmp(argv[i], "--folder") == 0)
            folder = argv[i + 1];
        else if (std::strcmp(argv[i], "--columns") == 0)
            sizes = {std::atoll(argv[i + 1])};
    folder /= fmt::format("map_size_bench.{}", getpid());
    std::filesystem::create_directories(folder);
    const auto domain = terrain::SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m});
    fmt::print("{{\"sizes\": [");
    const char* separator = "";
    for (const std::int64_t columns : sizes) {
        const auto file = write_map(folder, columns);
        struct stat about {};
        stat(file.c_str(), &about);
        {
            terrain::MapKeys keys;
            keys.file = file;
            terrain::MapFindings found;
            TerrainShape::Settings settings;
            const TerrainShape shape(
                domain, {std::make_shared<terrain::RasterLayer>(domain, open_map(keys, domain, found))},
                settings);
            const SurfaceTiles::Pin pin = shape.tiles()->pin();
            shape.tiles()->make_pinned();
            fmt::print(
                "{}\n {{\"data_MB\": {:.0f}, \"written_MB\": {:.0f}, \"sample_m\": {:.3g}, \"views\": [",
                separator, static_cast<double>(columns) * static_cast<double>(columns) / 1e6,
                static_cast<double>(about.st_blocks) * 512 / 1e6,
                2 * pi * radius_m / static_cast<double>(columns));
            separator = "";
            for (const View& v : views) {
                const Vec3 from = (radius_m + v.altitude_m) * under;
                const DetailView detail{.eye_m = from, .cell_rad = v.half_field / frame};
                const auto packets = view(from, v.half_field, &detail);
                const std::uint64_t before = shape.tiles()->usage().made;
                const double first = trace_seconds(shape, packets);
                const auto tiles = static_cast<double>(shape.tiles()->usage().made - before);
                double again = first;
                for (int k = 0; k < 5; ++k)
                    again = std::min(again, trace_seconds(shape, packets));
                fmt::print(
                    "{}{{\"view\": \"{}\", \"tiles\": {}, \"tile_cpu_ms\": {:.2f}, \"Mrays_per_s\": {:.2f}}}",
                    separator, v.name, tiles, 1e3 * (first - again) / std::max(tiles, 1.0),
                    frame * frame / again / 1e6);
                separator = ", ";
            }
            fmt::print("], \"resident_MiB\": {:.0f}}}", resident_mib());
            separator = ",";
            std::fflush(stdout);
        }
        std::filesystem::remove_all(folder);
        std::filesystem::create_directories(folder);
    }
    std::filesystem::remove_all(folder);
    fmt::print("\n]}}\n");
}
