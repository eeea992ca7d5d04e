// SPDX-License-Identifier: Apache-2.0
// Rays per second of processor time on a planet's height field, and on the mesh of its vertices through
// Embree, as JSON on standard output. Option: --cells N, cells per face (512). --map FILE: heights of a
// PDS3 label of distances from the Moon's centre, left edge at longitude 0; without it, waves.
#include "renderer/planets/planet.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/mesh_shape.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

namespace {

using namespace obscura;
using namespace obscura::renderer;

constexpr double radius_m = 1737400;
constexpr double degree = std::numbers::pi / 180;
constexpr int frame = 512; ///< pixels along the edge of a view

double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Relief of about a kilometre down to some cells.
double waves(Vec3 p) {
    double sum = 0;
    for (double scale = 8; scale < 300; scale *= 1.7)
        sum += std::sin(scale * p.x + 1) * std::cos(scale * (p.y - p.z)) / scale;
    return 0.004 * sum;
}

std::shared_ptr<const Shape> mesh_of(const HeightField& field) {
    const std::uint32_t cells = field.cells_per_edge();
    TriangleMesh mesh;
    for (const terrain::CubeFace& face : terrain::cube_faces) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (std::uint32_t j = 0; j <= cells; ++j)
            for (std::uint32_t i = 0; i <= cells; ++i) {
                const Vec3 q =
                    normalized(terrain::cube_point(face, 2.0 * i / cells - 1, 2.0 * j / cells - 1));
                const Vec3 p = radius_m * (1 + field.height(q)) * q;
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
std::vector<RayPacket> view(Vec3 from, Vec3 boresight, double half_field) {
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
            }
        }
    return packets;
}

/// Million rays a second; `met`: share of the rays that meet the shape.
double primary_rate(const Shape& shape, const std::vector<RayPacket>& packets, double& met) {
    std::size_t hit = 0;
    const double begin = cpu_seconds();
    for (const RayPacket& rays : packets) {
        HitPacket hits;
        hits.clear();
        shape.intersect(rays, 0, hits);
        for (const std::int32_t body : hits.body)
            hit += body == 0 ? 1 : 0;
    }
    const double seconds = cpu_seconds() - begin;
    met = static_cast<double>(hit) / (frame * frame);
    return frame * frame / seconds / 1e6;
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
        for (int i = 0; i < packet_size; ++i) {
            shadow.direction.set(i, sun);
            shadow.t_max[i] = no_hit;
            shadow.active.on[i] = hits.body[i] == 0 ? -1 : 0;
        }
    }
    int rays = 0, lit = 0;
    for (const RayPacket& shadow : shadows)
        rays += shadow.active.count();
    const double begin = cpu_seconds();
    for (RayPacket& shadow : shadows) {
        shape.occlude(shadow);
        lit += shadow.active.count();
    }
    const double seconds = cpu_seconds() - begin;
    met = 1 - static_cast<double>(lit) / rays;
    return rays / seconds / 1e6;
}

} // namespace

int main(int argc, char** argv) {
    std::uint32_t cells = 512;
    std::optional<HeightMap> map;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--cells") == 0) cells = static_cast<std::uint32_t>(std::atoi(argv[i + 1]));
        if (std::strcmp(argv[i], "--map") == 0) map = read_height_map(argv[i + 1], 1, 0);
    }
    const auto height = [&](Vec3 p) { return map ? map->at(p) / radius_m - 1 : waves(p); };
    const double begin = cpu_seconds();
    const Planet planet({radius_m, radius_m, radius_m}, HeightField(cells, height));
    const double build_s = cpu_seconds() - begin;
    const std::shared_ptr<const Shape> mesh = mesh_of(planet.field());

    fmt::print("{{\n  \"cells_per_face\": {}, \"bytes\": {}, \"build_cpu_s\": {:.2f},\n  \"views\": [", cells,
               HeightField::bytes(cells), build_s);
    const Vec3 up = normalized(Vec3{0.3, -0.8, 0.5});
    Vec3 east, north;
    orthonormal_basis(up, east, north);
    const char* separator = "\n";
    const auto print = [&](std::string_view name, double rate, double mesh_rate, double met,
                           double mesh_met) {
        fmt::print("{}    {{\"view\": \"{}\", \"Mrays_per_s\": {:.2f}, \"mesh_Mrays_per_s\": {:.2f}, "
                   "\"met\": {:.3f}, "
                   "\"mesh_met\": {:.3f}}}",
                   separator, name, rate, mesh_rate, met, mesh_met);
        separator = ",\n";
    };
    const auto show = [&](const char* name, double altitude_m, double off_nadir, double half_field) {
        const Vec3 from = (radius_m + altitude_m) * up;
        const auto packets =
            view(from, normalized(std::sin(off_nadir) * east - std::cos(off_nadir) * up), half_field);
        double met = 0, mesh_met = 0;
        const double rate = primary_rate(planet, packets, met),
                     mesh_rate = primary_rate(*mesh, packets, mesh_met);
        print(name, rate, mesh_rate, met, mesh_met);
        return packets;
    };
    show("disc, 6000 km", 6e6, 0, 0.24);
    show("limb, 100 km", 1e5, std::asin(radius_m / (radius_m + 1e5)), 0.1);
    const auto nadir = show("nadir, 100 km", 1e5, 0, 0.6);
    for (const double elevation : {60.0, 20.0, 5.0, 1.5}) {
        const Vec3 sun = std::sin(elevation * degree) * up + std::cos(elevation * degree) * north;
        double met = 0, mesh_met = 0;
        const double rate = shadow_rate(planet, nadir, sun, met),
                     mesh_rate = shadow_rate(*mesh, nadir, sun, mesh_met);
        print(fmt::format("shadow, Sun at {} deg", elevation), rate, mesh_rate, met, mesh_met);
    }
    fmt::print("\n  ]\n}}\n");
}
