// SPDX-License-Identifier: Apache-2.0
// Processor time of procedural detail per tile of the Moon, by level.
#include "terrain/detail/boulders.hpp"
#include "terrain/detail/craters.hpp"
#include "terrain/detail/octaves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <limits>

using namespace obscura;
using namespace obscura::terrain;

namespace {

double processor_ms() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

} // namespace

int main() {
    const SurfaceDomain moon = SurfaceDomain::ellipsoid({1737400, 1737400, 1737400});
    const auto craters = std::make_shared<Craters>(moon, Craters::Settings{}, 1);
    const Octaves octaves(moon, SlopeTable::of_class(TerrainClass::highlands), 1, false);
    const Boulders boulders(moon, Boulders::Settings{}, 1, craters);
    struct Row {
        const char* name;
        const HeightLayer& layer;
    };
    fmt::print("{{\"tile_ms\": [\n");
    for (const int level : {2, 5, 8, 11, 14, 17, 20}) {
        fmt::print("{}  {{\"level\": {}, \"spacing_m\": {:.4g}", level > 2 ? ",\n" : "", level,
                   moon.spacing_m(level));
        for (const Row& row :
             {Row{"octaves", octaves}, Row{"craters", *craters}, Row{"boulders", boulders}}) {
            constexpr int tiles = 20;
            double spent = 0;
            for (std::uint32_t n = 0; n < tiles; ++n) {
                const std::uint32_t mask = (1u << level) - 1;
                const TileKey key{static_cast<std::uint8_t>(n % 6), static_cast<std::uint8_t>(level),
                                  (n * 2654435761u >> 5) & mask, (n * 2246822519u >> 7) & mask};
                std::vector<Vec3> positions;
                for (int j = -tile_margin; j <= tile_cells + tile_margin; ++j)
                    for (int i = -tile_margin; i <= tile_cells + tile_margin; ++i)
                        positions.push_back(moon.point(key.face, SurfaceDomain::coordinate(level, key.i, i),
                                                       SurfaceDomain::coordinate(level, key.j, j)));
                Cap cap{positions[tile_vertices / 2], 0};
                for (const Vec3 p : positions)
                    cap.radius_m = std::max(cap.radius_m, length(p - cap.centre_m));
                std::vector<double> heights(tile_vertices),
                    spacings(tile_vertices, std::numeric_limits<double>::infinity());
                const double begin = processor_ms();
                row.layer.apply({key, positions, moon.spacing_m(level), cap}, heights, spacings);
                spent += processor_ms() - begin;
            }
            fmt::print(", \"{}\": {:.2f}", row.name, spent / tiles);
        }
        fmt::print("}}");
    }
    fmt::print("\n]}}\n");
    return 0;
}
