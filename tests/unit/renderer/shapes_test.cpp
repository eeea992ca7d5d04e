// SPDX-License-Identifier: Apache-2.0
// Boxes, discs, rings and cones against areas and formulas; the Sun's limb darkening.
#include "core/error.hpp"
#include "renderer/lights/sunlight.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/mesh_files/plate.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/cone.hpp"
#include "renderer/shapes/disc.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/shapes/polygons.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <vector>

namespace shapes_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;

/// The one ray of a packet.
struct Met {
    double t = no_hit;
    Vec3 point, normal, lifted;
    bool outside = false;
};
Met meet(const Shape& shape, Vec3 origin, Vec3 direction) {
    RayPacket rays;
    for (int i = 0; i < packet_size; ++i) {
        rays.origin.set(i, origin);
        rays.direction.set(i, normalized(direction));
        rays.t_max[i] = no_hit;
        rays.active.on[i] = i == 3 ? -1 : 0;
    }
    HitPacket hits;
    hits.clear();
    shape.intersect(rays, 4, hits);
    RayPacket shadow = rays;
    shape.occlude(shadow);
    CHECK((shadow.active.on[3] == 0) == (hits.body[3] == 4));
    CHECK(hits.body[2] == -1);
    if (hits.body[3] < 0) return {};
    SurfacePacket s;
    shape.surface(rays, hits, 4, s);
    return {hits.t[3], s.position.lane(3), s.normal.lane(3), s.shadow_origin.lane(3), s.outside.on[3] != 0};
}

/// Rays from outside at random points of a shape: each must meet it on a point where `on` is about 0, with a
/// normal that `on` grows along.
void check_surface(const Shape& shape, const std::function<double(Vec3)>& on) {
    std::uint32_t state = 11;
    const auto random = [&] {
        state = state * 1664525u + 1013904223u;
        return state / 4294967296.0;
    };
    const double r = shape.bounding_radius_m();
    int met = 0;
    for (int n = 0; n < 3000; ++n) {
        const double far = std::pow(10.0, 1 + 9 * random()) * r;
        const Vec3 origin = far * normalized(Vec3{random() - 0.5, random() - 0.5, random() - 0.5});
        const Vec3 aim = r * Vec3{2 * random() - 1, 2 * random() - 1, 2 * random() - 1};
        const Met m = meet(shape, origin, aim - origin);
        if (m.t == no_hit) continue;
        ++met;
        const double tolerance = 4e-15 * far + 1e-12 * r;
        CHECK(m.outside);
        CHECK_THAT(on(m.point), WithinAbs(0, tolerance));
        CHECK(on(m.point + 1e-3 * r * m.normal) > 0);
        CHECK(dot(m.normal, aim - origin) < 0);
        CHECK_THAT(length(m.normal), WithinAbs(1, 1e-12));
        // The lifted point is free: rays away from the shape meet nothing.
        CHECK(meet(shape, m.lifted, m.normal).t == no_hit);
    }
    CHECK(met > 500);
}

/// The box of `Box`, of twelve triangles.
TriangleMesh box_mesh(Vec3 size) {
    TriangleMesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.vertices.push_back({static_cast<float>((k & 1 ? 0.5 : -0.5) * size.x),
                                 static_cast<float>((k & 2 ? 0.5 : -0.5) * size.y),
                                 static_cast<float>((k & 4 ? 0.5 : -0.5) * size.z)});
    for (const auto& face : std::vector<std::array<std::uint32_t, 4>>{
             {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
        mesh.triangles.push_back({face[0], face[1], face[2]});
        mesh.triangles.push_back({face[0], face[2], face[3]});
    }
    return mesh;
}

} // namespace

TEST_CASE("A box of twelve triangles is met like the box, and no ray gets out of it") {
    const Vec3 size{2, 3, 5};
    const Box exact(renderer::BoxParameters{size});
    const MeshShape mesh(std::make_shared<const EmbreeDevice>(), box_mesh(size));
    std::uint32_t state = 5;
    const auto random = [&] {
        state = state * 1664525u + 1013904223u;
        return state / 4294967296.0 - 0.5;
    };
    int met = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 origin{20 * random(), 20 * random(), 20 * random()};
        const Vec3 direction = Vec3{4 * random(), 6 * random(), 10 * random()} - origin;
        const Met a = meet(exact, origin, direction);
        const Met b = meet(mesh, origin, direction);
        REQUIRE((a.t == no_hit) == (b.t == no_hit));
        if (a.t == no_hit) continue;
        ++met;
        CHECK_THAT(b.t, WithinAbs(a.t, 1e-12 * (1 + a.t)));
        CHECK(length(b.point - a.point) < 1e-6); // by barycentric coordinates, floats, where rays graze
        CHECK(length(b.normal - a.normal) < 1e-12);
        CHECK(a.outside == b.outside);
    }
    CHECK(met > 5000);
    // From inside, at the edges of the box and the diagonals of its faces, where two triangles meet.
    for (int i = 0; i < 20000; ++i) {
        const double along = 2 * random();
        const int axis = i % 3;
        Vec3 aim = i % 2 == 0 ? Vec3{1, 1, along} : Vec3{1, along, along};
        if (axis == 1) aim = {aim.y, aim.z, aim.x};
        if (axis == 2) aim = {aim.z, aim.x, aim.y};
        const Vec3 origin{0.9 * random(), 0.9 * random(), 0.9 * random()};
        const Vec3 edge{aim.x * size.x / 2, aim.y * size.y / 2, aim.z * size.z / 2};
        REQUIRE(meet(mesh, origin, edge - origin).t != no_hit);
    }
}

TEST_CASE("Points drawn from a mesh lie on it, each part by its area") {
    // A square of 2 x 2 m and, beside it, a triangle of 1 m2: a parallelogram and a patch by itself.
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {4, 0, 0}, {5, 0, 0}, {4, 2, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
    const MeshShape shape(std::make_shared<const EmbreeDevice>(), mesh, true);
    CHECK_THAT(shape.sampled_area_m2(), WithinRel(5.0, 1e-12));
    constexpr int n = 200;
    int square = 0;
    Vec3 of_square;
    Vec3 of_triangle;
    for (int i = 0; i < n * n; ++i) {
        Vec3 p;
        Vec3 normal;
        shape.sample_area((i % n + 0.5) / n, (i / n + 0.5) / n, p, normal);
        CHECK(length(normal - Vec3{0, 0, 1}) < 1e-12);
        if (p.x <= 2) {
            ++square;
            of_square = of_square + p;
            REQUIRE((p.x >= 0 && p.y >= 0 && p.y <= 2));
        } else {
            of_triangle = of_triangle + p;
            REQUIRE((p.x >= 4 && p.y >= 0 && p.y <= 2 - 2 * (p.x - 4) + 1e-12));
        }
    }
    CHECK(square == n * n * 4 / 5);
    CHECK(length(of_square / square - Vec3{1, 1, 0}) < 1e-3);
    CHECK(length(of_triangle / (n * n - square) - Vec3{4 + 1.0 / 3, 2.0 / 3, 0}) < 2e-3);
}

TEST_CASE("Polygons are exact in double precision, far from their body's origin too") {
    // 25 square tiles of 1 m, each 1 cm above the one before.
    constexpr int side = 5;
    constexpr double step_m = 0.01;
    for (const Vec3 at : {Vec3{0, 0, 0}, Vec3{1e7, -3e6, 2e6}}) {
        INFO("at " << at.x);
        PolygonsParameters tiles;
        for (int k = 0; k < side * side; ++k) {
            const Vec3 c = at + Vec3{static_cast<double>(k % side), std::floor(k / side), k * step_m};
            tiles.faces_m.push_back({c, c + Vec3{1, 0, 0}, c + Vec3{1, 1, 0}, c + Vec3{0, 1, 0}});
        }
        ShapeContext context;
        const auto shape = make(tiles, context);
        std::uint32_t state = 9;
        const auto random = [&] {
            state = state * 1664525u + 1013904223u;
            return state / 4294967296.0;
        };
        for (int i = 0; i < 5000; ++i) {
            const Vec3 over{side * random(), side * random(), 0};
            const int tile = static_cast<int>(over.x) + side * static_cast<int>(over.y);
            const Vec3 aim = at + over + Vec3{0, 0, tile * step_m};
            // From above, and from below, at slopes that no neighbour's edge can hide.
            const double height = i % 2 == 0 ? 100.0 : -100.0;
            const Vec3 origin = aim + Vec3{height * 1e-5 * (random() - 0.5), 0, height};
            if (std::min({over.x - std::floor(over.x), std::ceil(over.x) - over.x}) < 1e-5) continue;
            const Met m = meet(*shape, origin, aim - origin);
            REQUIRE(m.t != no_hit);
            CHECK_THAT(m.t, WithinAbs(length(aim - origin), 1e-8));
            CHECK(length(m.point - aim) < 1e-8);
            CHECK(m.normal == Vec3{0, 0, height > 0 ? 1.0 : -1.0});
            CHECK(m.outside == (height > 0));
            // A shadow ray leaves the surface, and is stopped on its way to the other side.
            CHECK(meet(*shape, m.lifted, {0, 0, height}).t == no_hit);
            CHECK(meet(*shape, m.lifted, {0, 0, -height}).t < 1e-4);
        }
        // No ray slips between two tiles of the same height, or between the triangles of one.
        PolygonsParameters floor;
        for (int k = 0; k < 2; ++k) {
            const Vec3 c = at + Vec3{k - 1.0, -0.5, 0};
            floor.faces_m.push_back({c, c + Vec3{1, 0, 0}, c + Vec3{1, 1, 0}, c + Vec3{0, 1, 0}});
        }
        const auto flat = make(floor, context);
        for (int i = 0; i < 5000; ++i) {
            const Vec3 origin = at + Vec3{3 * random() - 1.5, random() - 0.5, 1 + random()};
            const double along = random() - 0.5;
            const Vec3 aim = at + (i % 2 == 0 ? Vec3{0, along, 0} : Vec3{0.5 + along, along, 0});
            REQUIRE(meet(*flat, origin, aim - origin).t != no_hit);
        }
    }
    ShapeContext context;
    context.place = "s.toml:2:1: body[0]";
    PolygonsParameters nothing;
    nothing.faces_m = {{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}};
    CHECK_THROWS_WITH((void)make(nothing, context), ContainsSubstring("no face has an area"));
}

TEST_CASE("Boxes, cylinders and cones are met on their surfaces, from near and far") {
    check_surface(Box(renderer::BoxParameters{{2, 3, 4}}), [](Vec3 p) {
        return std::max({std::abs(p.x) - 1, std::abs(p.y) - 1.5, std::abs(p.z) - 2});
    });
    check_surface(Cone({1.5, 1.5, 2}),
                  [](Vec3 p) { return std::max(std::hypot(p.x, p.y) - 1.5, std::abs(p.z) - 1); });
    const double c = std::cos(std::atan(0.5));
    check_surface(Cone({2, 1, 2}), [c](Vec3 p) {
        return std::max((std::hypot(p.x, p.y) - (1.5 - p.z / 2)) * c, std::abs(p.z) - 1);
    });
    // From inside: the far wall, and not outside.
    const Met wall = meet(Cone({1, 1, 10}), {0.2, 0, 0}, {1, 0, 0});
    CHECK_THAT(wall.t, WithinAbs(0.8, 1e-12));
    CHECK_FALSE(wall.outside);
    CHECK(wall.normal.x < 0);
    // Along the axis of a cone with a tip, and past it.
    CHECK_THAT(meet(Cone({1, 0, 2}), {0, 0, 5}, {0, 0, -1}).t, WithinAbs(4, 1e-6));
    CHECK(meet(Cone({1, 0, 2}), {0.6, 0, 5}, {1e-9, 1, 0}).t == no_hit);
    CHECK(meet(Cone({1, 0, 2}), {0, 3, 1.5}, {0, -1, 0}).t == no_hit); // above the tip: not the mirrored cone
}

TEST_CASE("A ring is met between its radii, from both sides") {
    const Disc ring({2, 1});
    for (const double side : {1.0, -1.0}) {
        const Met m = meet(ring, {1.5, 0, 3 * side}, {0, 0, -side});
        CHECK_THAT(m.t, WithinAbs(3, 1e-12));
        CHECK(m.outside);
        CHECK(m.normal.z == side);
        CHECK(meet(ring, {0.9, 0, 3 * side}, {0, 0, -side}).t == no_hit);
        CHECK(meet(ring, {0, 2.1, 3 * side}, {0, 0, -side}).t == no_hit);
    }
    CHECK(meet(ring, {-5, 0, 0}, {1, 0, 0}).t == no_hit); // edge on
}

TEST_CASE("Pictures of the shapes hold their areas and their cosines") {
    // Straight from the Sun's side: radiance albedo E / pi for what faces it.
    const auto flux = [](scene::Shape shape, Quat turn) {
        scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0, 20, 128);
        s.bodies[0].shape = std::move(shape);
        s.bodies[0].motion.samples[0].pose.orientation = turn;
        s.camera.motion.samples[0].pose.position_m = s.camera.motion.samples[0].pose.position_m * 1e3;
        s.camera.focal_length_m *= 1e3;
        return render(Renderer(s, {64, 2, 3})).sum() / sun(s) * 1e16 * pi / 0.5;
    };
    const Quat towards = axis_angle({0, 1, 0}, -pi / 2); // z to the Sun, which is at -x
    const double tilt = pi / 5;
    const Quat tilted = axis_angle({0, 0, 1}, tilt) * towards;
    CHECK_THAT(flux(renderer::DiscParameters{500, 300}, towards), WithinRel(pi * (25e4 - 9e4), 2e-3));
    CHECK_THAT(flux(renderer::DiscParameters{500, 0}, axis_angle({0, 1, 0}, pi / 2)),
               WithinRel(pi * 25e4, 2e-3)); // its back
    CHECK_THAT(flux(renderer::DiscParameters{500, 0}, tilted),
               WithinRel(pi * 25e4 * std::cos(tilt) * std::cos(tilt), 2e-3));
    CHECK_THAT(flux(renderer::ConeParameters{400, 400, 100}, towards), WithinRel(pi * 16e4, 2e-3));
    // A cylinder from the side: integral of cos^2 over the width, pi/2 R per length. A cone from above:
    // everything at the cosine of its slope.
    CHECK_THAT(flux(renderer::ConeParameters{200, 200, 800}, {1, 0, 0, 0}),
               WithinRel(pi / 2 * 200 * 800, 2e-3));
    CHECK_THAT(flux(renderer::ConeParameters{400, 0, 400}, towards),
               WithinRel(pi * 16e4 * std::sqrt(0.5), 2e-3));
    // A cube turned by 36 degrees shows two faces: cos^2 and sin^2 of their area.
    CHECK_THAT(flux(renderer::BoxParameters{{600, 600, 500}}, axis_angle({0, 0, 1}, tilt)),
               WithinRel(600.0 * 500, 2e-3));
}

TEST_CASE("Limb darkening moves light from the rim of the Sun to its middle, and keeps its sum") {
    scene::Sun sun;
    sun.limb_darkening = 0.6;
    Vec3s position;
    double mean = 0;
    double middle = 0;
    double rim = 0;
    int middle_count = 0;
    int rim_count = 0;
    constexpr int rounds = 4000;
    for (int n = 0; n < rounds; ++n) {
        Doubles u;
        Doubles v;
        for (int i = 0; i < packet_size; ++i) {
            u[i] = (n + (i + 0.5) / packet_size) / rounds;
            v[i] = std::fmod(0.618034 * (n * packet_size + i), 1.0);
            position.set(i, {0, 0, 0});
        }
        Vec3s direction;
        Doubles weight;
        sample_sun(position, {0, 0, astronomical_unit_m}, sun, u, v, direction, weight);
        const double sine = sun.radius_m / astronomical_unit_m;
        for (int i = 0; i < packet_size; ++i) {
            mean += weight[i] / (rounds * packet_size);
            const double off = std::hypot(direction.x[i], direction.y[i]) / sine;
            const double expected = 1 - 0.6 * (1 - std::sqrt(std::max(0.0, 1 - off * off)));
            CHECK_THAT(weight[i] / (pi * sine * sine), WithinRel(expected / 0.8, 1e-4));
            if (off < 0.1) middle += weight[i], ++middle_count;
            if (off > 0.99) rim += weight[i], ++rim_count;
        }
    }
    const double cap = pi * std::pow(sun.radius_m / astronomical_unit_m, 2);
    CHECK_THAT(mean, WithinRel(cap, 1e-4));
    CHECK(middle / middle_count > 2 * rim / rim_count);

    // The same in a picture of the Sun itself: a profile, and the irradiance of the whole.
    scene::Scene s;
    s.sun.limb_darkening = 0.6;
    s.sun.position_m = {0, 0, astronomical_unit_m};
    s.camera.width = s.camera.height = 64;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = 20 * 10e-6 / (s.sun.radius_m / astronomical_unit_m); // 20 px in radius
    s.camera.psf_sigma_px = 0;
    const Image image = render(Renderer(s, {64, 1, 2}));
    CHECK_THAT(image.sum(), WithinRel(test::sun(s), 1e-3));
    const double centre = image.at(31, 31);
    const double off = std::hypot(0.5, 15.5) / 20;
    CHECK_THAT(image.at(31, 47) / centre, WithinRel(1 - 0.6 * (1 - std::sqrt(1 - off * off)), 5e-3));
    // Paths see the same Sun.
    RenderSettings bouncing{64, 1, 2};
    bouncing.max_bounces = 1;
    CHECK_THAT(render(Renderer(s, bouncing)).at(31, 47), WithinRel(image.at(31, 47), 1e-5F));
}

TEST_CASE("Plate models are read in both layouts, and bad ones are refused by line") {
    const auto message = [](std::string_view text) -> std::string {
        try {
            (void)parse_plates(text, "eros.tab", 1000);
        } catch (const InputError& e) {
            return e.what();
        }
        return "accepted";
    };
    const TriangleMesh near = parse_plates("v 0 0 1.5\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "a.tab", 1000);
    CHECK(near.vertices.at(0).z == 1500);
    CHECK(near.triangles.at(0) == std::array<std::uint32_t, 3>{0, 1, 2});
    const TriangleMesh table =
        parse_plates(" 4\r\n1 0 0 1.5\n2 1 0 0\n3 0,1 0\n4 1 1 1\n 1\n1 2 3 4\n", "b.tab", 1000);
    CHECK(table.vertices.size() == 4);
    CHECK(table.triangles.at(0) == std::array<std::uint32_t, 3>{1, 2, 3});
    CHECK(parse_plates("3 1\n1 0 0 1\n2 1 0 0\n3 0 1 0\n1 1 2 3\n", "c.tab", 1).triangles.size() == 1);
    CHECK(message("") == "eros.tab: no triangles: a mesh needs at least one face");
    CHECK(message("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n") ==
          "eros.tab:4: vertex 4 out of range: allowed 1 to 3");
    CHECK(message("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 3\n") ==
          "eros.tab:4: vertex 3 out of range: allowed 0 to 2");
    CHECK(message("v 0 0\n") == "eros.tab:1: neither a vertex 'v x y z' nor a plate 'f a b c'");
    CHECK_THAT(message("v 0 0 x\n"), ContainsSubstring("eros.tab:1: 'x' is not a coordinate"));
    CHECK_THAT(message("v 0 0 1e40\n"), ContainsSubstring("is not finite"));
    CHECK(message("2\n1 0 0 0\n") == "eros.tab: ends with 1 vertices and 0 plates missing");
    CHECK_THAT(message("-7\n"), ContainsSubstring("eros.tab:1: '-7' vertices: allowed 1 to 200000000"));
    CHECK_THAT(message("PDS_VERSION_ID = PDS3\n"), ContainsSubstring("the number of vertices is wanted"));
    CHECK_THAT(message("1\n1 0 0 0\n1\n1 1 1 1\n1 1 1 1\n"),
               ContainsSubstring("eros.tab:5: text after the last plate"));

    const auto file = test::data_file("shapes_misc/eros007790.tab");
    if (!file) return;
    renderer::MeshFileParameters description;
    description.path = *file;
    description.metres_per_unit = 1000;
    const TriangleMesh eros = read_mesh_file(description);
    CHECK(eros.vertices.size() == 3897);
    CHECK(eros.triangles.size() == 7790);
    // Closed: every edge is shared by two plates, in opposite senses.
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double volume = 0;
    for (const auto& t : eros.triangles) {
        for (std::size_t k = 0; k < 3; ++k)
            ++edges[{t[k], t[(k + 1) % 3]}];
        const auto at = [&](std::size_t k) {
            const Vec3f p = eros.vertices[t[k]];
            return Vec3{p.x, p.y, p.z};
        };
        volume += dot(at(0), cross(at(1), at(2))) / 6;
    }
    int open = 0;
    for (const auto& [edge, n] : edges)
        open += n != 1 || edges.count({edge.second, edge.first}) == 0 ? 1 : 0;
    CHECK(open == 0);
    CHECK_THAT(volume, WithinRel(2503e9, 0.02)); // Zuber et al. 2000: 2503 +- 25 km^3
}

} // namespace shapes_test
