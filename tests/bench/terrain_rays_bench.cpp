// SPDX-License-Identifier: Apache-2.0
// Long checks of rays in terrains: none slips through between cells, tiles, levels and faces, and all meet
// the surface where marching over all cells in long double does. Arguments: rays from inside (1e8), rays
// marched (1e6). How far it is goes to standard error. Ends with 1 if any is wrong. The tests of the
// renderer have short forms of both.
#include "tests/unit/renderer/terrain_march.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>

using namespace obscura;
using namespace obscura::test;
using terrain::SurfaceDomain;

namespace {

constexpr double radius_m = 1000;
constexpr std::int64_t chunk = 1 << 14;

double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Calls `use(any, count)` for chunks of rays, each with random numbers of its own. Says every tenth.
template<typename Use>
void for_chunks(const char* name, std::int64_t rays, const Use& use) {
    std::atomic<std::int64_t> done{0};
    const auto tenths = [&](std::int64_t count) { return 10 * count / rays; };
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, (rays + chunk - 1) / chunk, 1),
                      [&](const tbb::blocked_range<std::int64_t>& chunks) {
                          for (std::int64_t k = chunks.begin(); k < chunks.end(); ++k) {
                              Directions any(static_cast<std::uint64_t>(k) + 1);
                              const std::int64_t count = std::min(chunk, rays - k * chunk);
                              use(any, count);
                              const std::int64_t before = done.fetch_add(count);
                              if (tenths(before + count) > tenths(before))
                                  fmt::print(stderr, "{}: {} of {} rays\n", name, before + count, rays);
                          }
                      });
}

/// Rays from inside towards vertices, tile corners, border planes and anywhere, that meet nothing.
std::int64_t escapes(std::int64_t rays) {
    const TerrainShape shape(SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m}),
                             layers_of(rough_m, -80, 80));
    // So near that tiles of several levels meet.
    const Vec3 eye = 1090 * normalized(Vec3{1, 0.95, 0.9});
    const DetailView detail{.eye_m = eye, .cell_rad = 0.02};
    std::atomic<std::int64_t> escaped{0};
    for_chunks("watertight", rays, [&](Directions& any, std::int64_t count) {
        const SurfaceTiles::Pin pin = shape.tiles()->pin();
        std::int64_t out = 0;
        for (std::int64_t done = 0; done < count; done += packet_size) {
            RayPacket packet;
            HitPacket hits{};
            hits.clear();
            packet.detail = &detail;
            const auto lanes = static_cast<int>(std::min<std::int64_t>(packet_size, count - done));
            for (int i = 0; i < packet_size; ++i) {
                const terrain::CubeFace& face =
                    terrain::cube_faces[static_cast<std::size_t>(6 * any.number())];
                const double lattice = terrain::tile_cells << static_cast<int>(5 * any.number());
                const auto place = [&] {
                    const double at = any.number();
                    return (any.number() < 0.6 ? std::round(lattice * at) / lattice : at) * 2 - 1;
                };
                Vec3 aim = normalized(terrain::cube_point(face, place(), place()));
                if (i % 4 == 0) aim = normalized(eye / radius_m + 0.2 * any());
                const Vec3 within = i % 4 == 1 ? Vec3{0, 0, 0} : 850 * any.number() * any();
                packet.origin.set(i, within);
                packet.direction.set(i, normalized(radius_m * aim - within));
                packet.t_max[i] = no_hit;
                packet.level_u[i] = any.number();
                packet.active.on[i] = i < lanes ? -1 : 0;
            }
            shape.intersect(packet, 0, hits);
            for (int i = 0; i < lanes; ++i)
                out += hits.t[i] == no_hit ? 1 : 0;
        }
        escaped += out;
    });
    return escaped;
}

struct Marched {
    std::atomic<std::int64_t> met{0}, missed{0}, phantom{0};
    std::atomic<double> worst_m{0};
};

/// Rays from outside, one in four grazing the relief, against marching.
void march(std::int64_t rays, Marched& result) {
    const TerrainShape shape(SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m}),
                             layers_of(waves_m, -waves_most_m, waves_most_m), at_level(0));
    const March truth(shape, 0);
    for_chunks("marched", rays, [&](Directions& any, std::int64_t count) {
        for (std::int64_t k = 0; k < count; ++k) {
            const Vec3 up = any();
            const Vec3 origin = k % 4 == 0 ? 1.075 * up : up * (1.08 + 3 * any.number());
            const Vec3 direction = normalized(any() * (1.06 * any.number()) - origin);
            constexpr double reach = 1.08;
            const double along = -dot(origin, direction);
            const double half2 = reach * reach - length_squared(origin + along * direction);
            double wanted = no_hit;
            if (half2 > 0)
                wanted = truth.first(origin, direction, std::max(0.0, along - std::sqrt(half2)),
                                     along + std::sqrt(half2));
            RayPacket packet;
            HitPacket hits{};
            hits.clear();
            for (int i = 0; i < packet_size; ++i) {
                packet.origin.set(i, radius_m * origin);
                packet.direction.set(i, direction);
                packet.t_max[i] = no_hit;
                packet.active.on[i] = i == 0 ? -1 : 0;
            }
            shape.intersect(packet, 0, hits);
            if (wanted == no_hit || hits.t[0] == no_hit) {
                result.missed += wanted != no_hit ? 1 : 0;
                result.phantom += hits.t[0] != no_hit ? 1 : 0;
                continue;
            }
            ++result.met;
            const double off = std::abs(hits.t[0] - radius_m * wanted);
            for (double worst = result.worst_m;
                 off > worst && !result.worst_m.compare_exchange_weak(worst, off);) {
            }
        }
    });
}

} // namespace

int main(int count, char** arguments) {
    const auto rays_of = [&](int index, double otherwise) {
        return static_cast<std::int64_t>(count > index ? std::atof(arguments[index]) : otherwise);
    };
    const std::int64_t from_inside = rays_of(1, 1e8), marched = rays_of(2, 1e6);
    auto begin = std::chrono::steady_clock::now();
    const std::int64_t escaped = escapes(from_inside);
    fmt::print("{{\"watertight\": {{\"rays\": {}, \"escapes\": {}, \"seconds\": {:.1f}}},\n", from_inside,
               escaped, seconds_since(begin));
    begin = std::chrono::steady_clock::now();
    Marched result;
    march(marched, result);
    fmt::print(
        " \"marched\": {{\"rays\": {}, \"met\": {}, \"missed\": {}, \"phantom\": {}, \"worst_m\": {:.3g}, "
        "\"seconds\": {:.1f}}}}}\n",
        marched, result.met.load(), result.missed.load(), result.phantom.load(), result.worst_m.load(),
        seconds_since(begin));
    const bool right = escaped == 0 && result.missed == 0 && result.phantom == 0 && result.worst_m < 1e-5;
    return right ? EXIT_SUCCESS : EXIT_FAILURE;
}
