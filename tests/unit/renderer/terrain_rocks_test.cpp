// SPDX-License-Identifier: Apache-2.0
// Boulders that stand on the ground: against all triangles, their shadows and limbs, and where domes become
// rocks.
#include "core/camera/scene_truth.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/planets/rock_forms.hpp"
#include "renderer/planets/terrain_shape.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "support.hpp"
#include "terrain_support.hpp"

#include <algorithm>
#include <set>
#include <string>

namespace terrain_rocks_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double half_edge_m = 64;

renderer::DetailParameters boulders(double per_m2) {
    renderer::DetailParameters detail;
    detail.boulders_per_m2 = per_m2;
    detail.boulder_least_m = 1.5;
    detail.boulder_largest_m = 4;
    return detail;
}

const std::vector<renderer::TriangleMesh>& forms() {
    static const std::vector<renderer::TriangleMesh> made = renderer::make_rock_forms();
    return made;
}

renderer::RockSettings rock_settings(const renderer::DetailParameters& detail, double cells) {
    static const auto device = std::make_shared<const renderer::EmbreeDevice>();
    renderer::RockSettings settings;
    for (const renderer::TriangleMesh& form : forms())
        settings.forms.push_back(std::make_shared<renderer::MeshShape>(device, form));
    settings.cells = cells;
    settings.min_m = detail.boulder_least_m;
    settings.largest_m = detail.boulder_largest_m;
    return settings;
}

/// Ground with boulders, which are rocks from so many cells on.
struct Ground {
    renderer::DetailLayers layers;
    std::unique_ptr<renderer::TerrainShape> shape;
    renderer::SurfaceTiles::Pin pin;

    Ground(const terrain::SurfaceDomain& domain, const renderer::DetailParameters& detail, double cells,
           int level, bool with_rocks = true) {
        layers = renderer::make_detail(detail, domain, false, cells);
        renderer::TerrainShape::Settings settings;
        settings.fixed_level = level;
        if (cells > 0 && with_rocks) settings.rocks = rock_settings(detail, cells);
        shape = std::make_unique<renderer::TerrainShape>(domain, layers.layers, settings);
        pin = shape->tiles()->pin();
    }
};

/// The rock of a boulder on level ground, as its layer has it.
struct Standing {
    terrain::StandingRock rock;
    Vec3 centre_m;
    [[nodiscard]] const renderer::TriangleMesh& form() const { return forms()[rock.form % forms().size()]; }
    [[nodiscard]] Vec3 vertex(std::size_t i) const {
        const auto& v = form().vertices[i];
        const Vec3 up = cross(rock.along, rock.across);
        return centre_m + static_cast<double>(v.x) * rock.semi_axes_m.x * rock.along +
               static_cast<double>(v.y) * rock.semi_axes_m.y * rock.across +
               static_cast<double>(v.z) * rock.semi_axes_m.z * up;
    }
};

/// Rocks of a tile that nothing else touches within some diameters.
std::vector<Standing> lonely(const Ground& ground, const terrain::SurfaceDomain& domain, int level,
                             double diameters) {
    std::vector<Standing> found;
    const auto count = std::uint32_t{1} << level;
    for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t j = 0; j < count; ++j) {
            std::vector<terrain::StandingRock> rocks;
            ground.layers.boulders->add_rocks({0, static_cast<std::uint8_t>(level), i, j}, rocks);
            for (const terrain::StandingRock& rock : rocks) {
                const double size = 2 * rock.semi_axes_m.x;
                if (ground.layers.boulders->near({rock.position_m, diameters * size}, 0).size() > 1) continue;
                if (std::max(std::abs(rock.position_m.x), std::abs(rock.position_m.y)) >
                    domain.half_edge_m() - diameters * size)
                    continue;
                found.push_back({rock, rock.position_m + Vec3{0, 0, rock.height_m - rock.semi_axes_m.z}});
            }
        }
    return found;
}

bool is_shaded(const Ground& ground, Vec3 point_m, Vec3 to_sun) {
    return distance_along(*ground.shape, point_m + Vec3{0, 0, 1e-5}, to_sun) != renderer::no_hit;
}

/// Moeller and Trumbore, Fast, minimum storage ray-triangle intersection, JGT 2(1), 1997.
double distance_to_triangles(const Standing& rock, Vec3 origin, Vec3 direction) {
    double nearest = renderer::no_hit;
    for (const auto& triangle : rock.form().triangles) {
        const Vec3 a = rock.vertex(triangle[0]), ab = rock.vertex(triangle[1]) - a,
                   ac = rock.vertex(triangle[2]) - a;
        const Vec3 p = cross(direction, ac);
        const double determinant = dot(ab, p);
        if (determinant == 0) continue;
        const Vec3 s = origin - a, q = cross(s, ab);
        const double u = dot(s, p) / determinant, v = dot(direction, q) / determinant;
        const double t = dot(ac, q) / determinant;
        if (u >= 0 && v >= 0 && u + v <= 1 && t > 0) nearest = std::min(nearest, t);
    }
    return nearest;
}

constexpr int fixed_level = 3; // 6 cm
constexpr double fixed_cells = 16;

} // namespace

TEST_CASE("Forms of rocks fill their box around its middle") {
    for (const renderer::TriangleMesh& form : forms()) {
        Vec3 least{9, 9, 9}, largest{-9, -9, -9};
        const auto at = [&](std::uint32_t n) {
            const auto& v = form.vertices[n];
            return Vec3{v.x, v.y, v.z};
        };
        for (std::uint32_t n = 0; n < form.vertices.size(); ++n) {
            const Vec3 v = at(n);
            least = {std::min(least.x, v.x), std::min(least.y, v.y), std::min(least.z, v.z)};
            largest = {std::max(largest.x, v.x), std::max(largest.y, v.y), std::max(largest.z, v.z)};
        }
        CHECK(length(least - Vec3{-1, -1, -1}) < 1e-6);
        CHECK(length(largest - Vec3{1, 1, 1}) < 1e-6);
        for (const auto& [a, b, c] : form.triangles)
            CHECK(dot(cross(at(b) - at(a), at(c) - at(a)), at(a)) > 0);
    }
}

TEST_CASE("Rays meet rocks where their triangles are") {
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const renderer::DetailParameters detail = boulders(0.02);
    const Ground ground(domain, detail, fixed_cells, fixed_level),
        bare(domain, detail, fixed_cells, fixed_level, false);
    std::vector<Standing> rocks;
    for (std::uint32_t i = 0; i < 8; ++i)
        for (std::uint32_t j = 0; j < 8; ++j)
            for (std::uint8_t level = 0; level <= fixed_level; ++level) {
                if (i >> level != 0 || j >> level != 0) continue;
                std::vector<terrain::StandingRock> standing;
                ground.layers.boulders->add_rocks({0, level, i, j}, standing);
                for (const auto& rock : standing) {
                    // One may stand on the dome of a boulder that does not overhang.
                    const Vec3 above = rock.position_m + Vec3{0, 0, 10};
                    const double ground_m = 10 - distance_along(*bare.shape, above, {0, 0, -1});
                    rocks.push_back(
                        {rock, rock.position_m + Vec3{0, 0, ground_m + rock.height_m - rock.semi_axes_m.z}});
                }
            }
    REQUIRE(rocks.size() > 40);
    Directions random(3);
    int met = 0, differ = 0, shaded = 0;
    for (int n = 0; n < 1500; ++n) {
        const Vec3 origin{half_edge_m * (2 * random.number() - 1), half_edge_m * (2 * random.number() - 1),
                          0.5 + 4 * random.number()};
        const Standing& aim = rocks[static_cast<std::size_t>(n) % rocks.size()];
        const Vec3 direction = normalized(aim.centre_m + aim.rock.semi_axes_m.x * random() - origin);
        double nearest = renderer::no_hit;
        bool inside = false;
        for (const Standing& rock : rocks) {
            const double radius = 2 * rock.rock.semi_axes_m.x;
            const Vec3 way = rock.centre_m - origin;
            if (length(way - dot(way, direction) * direction) > radius) continue;
            inside = inside || length(way) < radius;
            nearest = std::min(nearest, distance_to_triangles(rock, origin, direction));
        }
        if (inside) continue;
        const double below = distance_along(*bare.shape, origin, direction);
        OneRay ray(origin, direction);
        const double found = ray.meet(*ground.shape);
        const double wanted = std::min(nearest, below);
        if (std::abs(found - wanted) > 1e-5 && found != wanted) {
            ++differ;
            continue;
        }
        if (!(nearest < below)) continue;
        ++met;
        const SurfacePacket surface = ray.surface(*ground.shape);
        const Vec3 at = surface.position.lane(OneRay::lane), normal = surface.normal.lane(OneRay::lane);
        CHECK(length(at - (origin + found * direction)) < 1e-4);
        CHECK_THAT(length(normal), WithinAbs(1, 1e-9));
        CHECK(dot(surface.facet_normal.lane(OneRay::lane), direction) < 0);
        CHECK(dot(surface.facet_normal.lane(OneRay::lane), normal) > 0.7);
        shaded += surface.outside.on[OneRay::lane] != 0 ? 1 : 0;
    }
    CHECK(differ == 0);
    CHECK(met > 150);
    CHECK(shaded == met);
}

TEST_CASE("A boulder's shadow has the length of its height over the tangent of the Sun's elevation") {
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const renderer::DetailParameters detail = boulders(0.004);
    const Ground ground(domain, detail, fixed_cells, fixed_level);
    const std::vector<Standing> rocks = lonely(ground, domain, fixed_level, 4);
    REQUIRE(rocks.size() > 3);
    for (const Standing& rock : rocks) {
        const double size = 2 * rock.rock.semi_axes_m.x;
        // The top of the rock is that of the dome.
        double top = 0;
        for (std::size_t i = 0; i < rock.form().vertices.size(); ++i) {
            const Vec3 v = rock.vertex(i);
            if (v.z < rock.rock.height_m - 1e-6 * size) continue;
            top = 10 - distance_along(*ground.shape, {v.x, v.y, 10}, {0, 0, -1});
        }
        CHECK_THAT(top, WithinAbs(rock.rock.height_m, 2e-3 * size));
        for (const double elevation : {3 * degree, 8 * degree})
            for (const double azimuth : {0.3, 1.9, 4.4}) {
                const Vec3 away{-std::cos(azimuth), -std::sin(azimuth), 0};
                const Vec3 to_sun = normalized(Vec3{0, 0, std::tan(elevation)} - away);
                // The farthest shadow of a vertex.
                double tip = 0;
                Vec3 at;
                for (std::size_t i = 0; i < rock.form().vertices.size(); ++i) {
                    const Vec3 v = rock.vertex(i);
                    if (v.z <= 0) continue;
                    const Vec3 shadow = v + v.z / std::tan(elevation) * away;
                    if (const double x = dot(shadow - rock.rock.position_m, away); x > tip)
                        tip = x, at = shadow;
                }
                at.z = 0;
                INFO("boulder of " << size << " m, Sun at " << elevation / degree << " deg");
                CHECK(is_shaded(ground, at - 0.02 * size * away, to_sun));
                CHECK(!is_shaded(ground, at + 0.002 * size * away, to_sun));
                const double length = rock.rock.height_m / std::tan(elevation);
                CHECK(tip > length - size / 2);
                CHECK(tip < length + size / 2);
                if (elevation < 4 * degree) CHECK_THAT(tip, WithinRel(length, 0.05));
            }
    }
}

TEST_CASE("The limb of a boulder overhangs") {
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const renderer::DetailParameters detail = boulders(0.004);
    const Ground ground(domain, detail, fixed_cells, fixed_level), domes(domain, detail, 0, fixed_level);
    const std::vector<Standing> rocks = lonely(ground, domain, fixed_level, 2);
    REQUIRE(rocks.size() > 5);
    int overhanging = 0;
    for (const Standing& rock : rocks) {
        // Width at a height, as horizontal rays along the rock's middle axis see it.
        const double size = 2 * rock.rock.semi_axes_m.x;
        const auto width = [&](const Ground& of, double z) {
            constexpr int steps = 400;
            int hits = 0;
            for (int i = 0; i < steps; ++i) {
                const Vec3 beside =
                    rock.rock.position_m + ((i + 0.5) / steps - 0.5) * 1.2 * size * rock.rock.along;
                const Vec3 origin = beside - 2 * size * rock.rock.across + Vec3{0, 0, z};
                hits += distance_along(*of.shape, origin, rock.rock.across) < 4 * size ? 1 : 0;
            }
            return hits * 1.2 / steps; // of the diameter
        };
        const double middle = rock.rock.height_m - rock.rock.semi_axes_m.z;
        const double at_ground = width(ground, 0.01 * size), at_middle = width(ground, middle);
        CHECK_THAT(at_middle, WithinAbs(0.93, 0.08)); // of the whole length, which may lie off that height
        if (middle > 0.12 * size) {
            ++overhanging;
            CHECK(at_ground < 0.95 * at_middle);
        }
        CHECK(width(domes, 0.01 * size) >= width(domes, middle));
    }
    CHECK(overhanging > 2);
}

namespace {

/// Level samples that are 6.4 m apart at -x and closer and closer towards x, as at the edge of a finer map.
class FinerAndFiner final : public terrain::HeightLayer {
public:
    static double spacing_m(Vec3 p) { return 0.8 * std::exp2(-3 * p.x / half_edge_m); }
    void apply(const terrain::VertexGrid& grid, std::span<double> /*heights_m*/,
               std::span<double> sample_spacings_m) const override {
        for (std::size_t n = 0; n < sample_spacings_m.size(); ++n)
            sample_spacings_m[n] = spacing_m(grid.positions_m[n]);
    }
    [[nodiscard]] terrain::HeightRange range(const terrain::Cap& /*cap*/, double /*spacing_m*/,
                                             terrain::HeightRange below) const override {
        return {below.least, below.largest, 6.4};
    }
    [[nodiscard]] double sample_spacing_m(Vec3 position_m) const override { return spacing_m(position_m); }
};

} // namespace

TEST_CASE("Domes and rocks fade alike where samples become fine enough for boulders") {
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const renderer::DetailParameters detail = boulders(0.03);
    const Ground bare(domain, detail, fixed_cells, fixed_level);
    const auto over_samples = [&](double cells) {
        renderer::TerrainShape::Settings settings;
        settings.fixed_level = fixed_level;
        if (cells > 0) settings.rocks = rock_settings(detail, cells);
        return std::make_unique<renderer::TerrainShape>(
            domain,
            std::vector<std::shared_ptr<const terrain::HeightLayer>>{
                std::make_shared<FinerAndFiner>(),
                renderer::make_detail(detail, domain, true, cells).boulders},
            settings);
    };
    const auto domes = over_samples(0), rocks = over_samples(fixed_cells);
    const auto pins = std::pair(domes->tiles()->pin(), rocks->tiles()->pin());
    int whole = 0, partial = 0, none = 0;
    for (const Standing& rock : lonely(bare, domain, fixed_level, 1.5)) {
        const double size = 2 * rock.rock.semi_axes_m.x;
        const double share = terrain::Craters::share(size, FinerAndFiner::spacing_m(rock.rock.position_m));
        // Above the highest vertex of the form, and the middle of the dome.
        Vec3 summit;
        for (std::size_t i = 0; i < rock.form().vertices.size(); ++i)
            if (const Vec3 v = rock.vertex(i); i == 0 || v.z > summit.z) summit = v;
        const auto top = [](const renderer::TerrainShape& shape, Vec3 at) {
            return 10 - distance_along(shape, {at.x, at.y, 10}, {0, 0, -1});
        };
        INFO(size << " m, share " << share);
        CHECK_THAT(top(*rocks, summit), WithinAbs(share * rock.rock.height_m, 0.02 * size));
        CHECK_THAT(top(*domes, rock.rock.position_m), WithinAbs(share * rock.rock.height_m, 0.02 * size));
        ++(share > 0.99 ? whole : share < 0.01 ? none : partial);
    }
    CHECK(whole > 3);
    CHECK(partial > 5);
    CHECK(none > 3);
}

namespace {

/// A plain of boulders under a camera that looks straight down, the Sun 25 degrees above the horizon.
scene::Scene plain(const renderer::DetailParameters& detail, double altitude_m, Vec3 above_m,
                   std::int32_t edge, double pixel_rad,
                   renderer::SunVisibilityKind kind = renderer::SunVisibilityKind::traced) {
    scene::Scene s;
    renderer::TerrainParameters ground;
    ground.half_edge_m = half_edge_m;
    ground.relief.detail = detail;
    ground.relief.sun_visibility = kind;
    s.bodies.push_back({"plain", ground, renderer::LambertParameters{0.3}, {}});
    s.sun.position_m = astronomical_unit_m * normalized(Vec3{1, 0.3, 0.487});
    s.camera = camera_at({1, 1, 1}, edge, pixel_rad);
    s.camera.motion.samples[0].pose = {{above_m.x, above_m.y, altitude_m}, look_along({0, 0, -1}, {0, 1, 0})};
    return s;
}

} // namespace

TEST_CASE("The picture of a boulder changes continuously while its dome becomes a rock") {
    renderer::DetailParameters detail = boulders(0.004);
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const Ground ground(domain, detail, fixed_cells, fixed_level);
    const std::vector<Standing> rocks = lonely(ground, domain, fixed_level, 3);
    REQUIRE(rocks.size() > 1);
    constexpr double pixel_rad = 1e-3, rock_px = 24;
    for (std::size_t n = 0; n < 2; ++n) {
        const Standing& rock = rocks[n];
        const double size = 2 * rock.rock.semi_axes_m.x;
        // Pictures as wide as three diameters: with its shadow.
        const auto mean = [&](double size_px, double from_px) {
            detail.boulder_rock_px = from_px;
            const auto edge = static_cast<std::int32_t>(std::lround(3 * size_px));
            const scene::Scene s =
                plain(detail, size / size_px / pixel_rad, rock.rock.position_m, edge, pixel_rad);
            const Image image = render(renderer::Renderer(s, {64, 1, 1}));
            return image.sum() / (static_cast<double>(edge) * edge);
        };
        double before = 0;
        int between = 0;
        for (double size_px = 1.25 * rock_px; size_px > rock_px / 5; size_px /= 1.12) {
            const double domes = mean(size_px, 0), stones = mean(size_px, 1e-3),
                         chosen = mean(size_px, rock_px);
            INFO(size_px << " px: " << domes << " as a dome, " << stones << " as a rock, " << chosen);
            CHECK_THAT(stones, WithinRel(domes, 0.03));
            const double noise = 0.004 * domes;
            CHECK(chosen > std::min(domes, stones) - noise);
            CHECK(chosen < std::max(domes, stones) + noise);
            if (size_px > rock_px) CHECK_THAT(chosen, WithinRel(stones, 1e-6));
            if (size_px < rock_px / 4) CHECK_THAT(chosen, WithinRel(domes, 1e-6));
            between += chosen != stones && chosen != domes ? 1 : 0;
            if (before > 0) CHECK_THAT(chosen, WithinRel(before, 0.012));
            before = chosen;
        }
        CHECK(between > 3);
    }
}

TEST_CASE("Kept visibility of the Sun has the shadows of rocks") {
    renderer::DetailParameters detail = boulders(0.004);
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const Ground ground(domain, detail, fixed_cells, fixed_level);
    const std::vector<Standing> rocks = lonely(ground, domain, fixed_level, 3);
    REQUIRE(rocks.size() > 1);
    constexpr double pixel_rad = 1e-3, size_px = 40;
    for (std::size_t n = 0; n < 2; ++n) {
        const Standing& rock = rocks[n];
        const double size = 2 * rock.rock.semi_axes_m.x;
        const auto picture = [&](renderer::SunVisibilityKind kind, double from_px) {
            detail.boulder_rock_px = from_px;
            constexpr auto edge = static_cast<std::int32_t>(3 * size_px);
            return render(renderer::Renderer(
                plain(detail, size / size_px / pixel_rad, rock.rock.position_m, edge, pixel_rad, kind),
                {16, 2, 1}));
        };
        using renderer::SunVisibilityKind;
        const Image traced = picture(SunVisibilityKind::traced, 16),
                    kept = picture(SunVisibilityKind::tiles, 16),
                    domes = picture(SunVisibilityKind::tiles, 0);
        const double mean = traced.sum() / static_cast<double>(traced.values.size());
        const auto rms = [&](const Image& of) {
            double squares = 0;
            for (std::size_t k = 0; k < of.values.size(); ++k)
                squares +=
                    std::pow(static_cast<double>(of.values[k]) - static_cast<double>(traced.values[k]), 2);
            return std::sqrt(squares / static_cast<double>(of.values.size())) / mean;
        };
        INFO("rock of " << size << " m: rms " << rms(kept) << " kept, " << rms(domes) << " as a dome");
        CHECK_THAT(kept.sum(), WithinRel(traced.sum(), 0.01));
        CHECK(rms(kept) < 0.02);
        CHECK(rms(kept) < rms(domes) / 5);
    }
}

TEST_CASE("Pictures of rocks do not depend on threads or on the order of tiles") {
    renderer::DetailParameters detail = boulders(0.2);
    detail.boulder_rock_px = 12;
    constexpr std::int32_t edge = 96;
    const auto picture = [&](unsigned threads, bool last_first) {
        const renderer::Renderer r(plain(detail, 60, {3, 4, 0}, edge, 2e-3), {4, threads, 1});
        // Tiles are made in another order.
        if (last_first) (void)render_window(r, {0, edge / 2, edge, edge / 2});
        return render(r).values;
    };
    const std::vector<float> once = picture(1, false);
    CHECK((once == picture(3, false)));
    CHECK((once == picture(1, true)));
    detail.boulder_rock_px = 0;
    CHECK((once != picture(1, false)));
}

TEST_CASE("The truth table lists rocks as it lists domes") {
    renderer::DetailParameters detail = boulders(0.2);
    const auto listed = [&](double rock_px) {
        detail.boulder_rock_px = rock_px;
        const renderer::Renderer r(plain(detail, 40, {3, 4, 0}, 200, 2e-3), {1, 2, 1});
        return truth_entries(r, TruthKind::boulder, 200);
    };
    const std::vector<TruthEntry> domes = listed(0), rocks = listed(10);
    REQUIRE(domes.size() > 10);
    std::set<std::string> names;
    int higher = 0;
    for (const TruthEntry& e : domes)
        names.emplace(e.name.view());
    for (const TruthEntry& e : rocks) {
        CHECK(names.contains(std::string(e.name.view())));
        higher += e.point_m.z > 0.2 * e.diameter_m ? 1 : 0;
    }
    CHECK(rocks.size() >= domes.size() - 2); // those at the edge of the picture
    CHECK(higher > 0.7 * static_cast<double>(rocks.size()));
}

TEST_CASE("Without waiting, boulders are domes until their tiles are there") {
    const auto domain = terrain::SurfaceDomain::plane(half_edge_m);
    const renderer::DetailParameters detail = boulders(0.004);
    const Ground ground(domain, detail, fixed_cells, -1), waiting(domain, detail, fixed_cells, -1);
    const Ground all(domain, detail, fixed_cells, fixed_level);
    const std::vector<Standing> rocks = lonely(all, domain, fixed_level, 2);
    REQUIRE(rocks.size() > 3);
    const Standing& rock = rocks.front();
    const Vec3 eye = rock.rock.position_m + Vec3{0, 0, 20};
    renderer::DetailView view{.eye_m = eye, .cell_rad = 2e-3};
    const renderer::SurfaceTiles& tiles = *ground.shape->tiles();
    // Below the overhang, from the side.
    const Vec3 origin = rock.centre_m - 3 * rock.rock.across, direction = rock.rock.across;
    const double wanted = distance_along(*waiting.shape, origin, direction, &view);
    view.wait = false;
    const std::uint64_t made = tiles.usage().made;
    const double first = distance_along(*ground.shape, origin, direction, &view);
    CHECK(tiles.usage().made == made);
    CHECK(first != wanted);
    for (int round = 0; round < 12; ++round) {
        tiles.take_wanted([&](renderer::SurfaceNode& node, std::uint32_t bits) {
            for (unsigned quarter = 0; quarter < 4; ++quarter)
                if ((bits >> quarter & 1u) != 0) node.wanted.fetch_or(1u << quarter);
        });
        std::vector<std::pair<renderer::SurfaceNode*, unsigned>> missing;
        tiles.for_each([&](renderer::SurfaceNode& node) {
            for (unsigned quarter = 0; quarter < 4; ++quarter)
                if ((node.wanted.load() >> quarter & 1u) != 0) missing.emplace_back(&node, quarter);
        });
        for (const auto& [node, quarter] : missing)
            (void)tiles.make_child(*node, quarter);
        tiles.publish();
        (void)distance_along(*ground.shape, origin, direction, &view);
    }
    CHECK(distance_along(*ground.shape, origin, direction, &view) == wanted);
}

} // namespace terrain_rocks_test
