// SPDX-License-Identifier: Apache-2.0
// Rays that start on a surface: outwards they meet nothing, on every shape and scale; a camera on the ground
// sees the sky.
#include "images/writers/fits.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/cone.hpp"
#include "renderer/shapes/disc.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "support.hpp"
#include "terrain_support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace own_surface_test {

using namespace obscura;
using namespace obscura::renderer;

namespace {

/// A convex body, or level ground.
struct Case {
    std::string name;
    std::shared_ptr<const Shape> shape;
    bool ground = false; ///< z = 0
    bool flat = false;   ///< without an inside
};

/// Octahedron of 8^n faces on a sphere.
TriangleMesh ball(double radius_m, int divisions) {
    std::vector<std::array<Vec3, 3>> faces;
    for (const double x : {-1.0, 1.0})
        for (const double y : {-1.0, 1.0})
            for (const double z : {-1.0, 1.0}) {
                const Vec3 a{x, 0, 0}, b{0, y, 0}, c{0, 0, z};
                if (x * y * z > 0)
                    faces.push_back({a, b, c});
                else
                    faces.push_back({a, c, b});
            }
    for (int k = 0; k < divisions; ++k) {
        std::vector<std::array<Vec3, 3>> finer;
        for (const auto& [a, b, c] : faces) {
            const Vec3 ab = normalized(a + b), bc = normalized(b + c), ca = normalized(c + a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        faces = finer;
    }
    TriangleMesh mesh;
    for (const auto& face : faces) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3 p : face)
            mesh.vertices.push_back({static_cast<float>(p.x * radius_m), static_cast<float>(p.y * radius_m),
                                     static_cast<float>(p.z * radius_m)});
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

PolygonsParameters cube(double half_m) {
    PolygonsParameters p;
    for (const double s : {-half_m, half_m}) {
        const double h = half_m;
        p.faces_m.push_back({{s, -h, -h}, {s, h, -h}, {s, h, h}, {s, -h, h}});
        p.faces_m.push_back({{-h, s, -h}, {-h, s, h}, {h, s, h}, {h, s, -h}});
        p.faces_m.push_back({{-h, -h, s}, {h, -h, s}, {h, h, s}, {-h, h, s}});
        if (s < 0)
            for (std::size_t f = p.faces_m.size() - 3; f < p.faces_m.size(); ++f)
                std::reverse(p.faces_m[f].begin(), p.faces_m[f].end());
    }
    return p;
}

std::vector<Case> cases(double r, const test::TempFolder& folder) {
    std::vector<Case> all;
    ShapeContext context;
    context.place = "body 'ground'";
    const auto add = [&](const std::string& name, const auto& parameters, bool flat = false) {
        all.push_back({name, make(parameters, context), false, flat});
    };
    add("sphere", EllipsoidParameters{{r, r, r}});
    add("ellipsoid", EllipsoidParameters{{r, 0.7 * r, 0.4 * r}});
    add("box", BoxParameters{{r, 1.3 * r, 0.8 * r}});
    add("cone", ConeParameters{r, 0.3 * r, r});
    add("disc", DiscParameters{r, 0}, true);
    add("polygons", cube(r));
    const auto device = std::make_shared<const EmbreeDevice>();
    all.push_back({"mesh", std::make_shared<const MeshShape>(device, ball(r, 3))});
    all.push_back({"small mesh", std::make_shared<const MeshShape>(device, ball(r, 0))});
    PlanetParameters planet;
    planet.radii_m = {r, r, r};
    const std::vector<float> heights(16 * 8, static_cast<float>(1e-3 * r));
    const auto file = folder.path() / ("h" + std::to_string(r) + ".fits");
    images::write_fits_float(file, 16, 8, 1, heights, "", {});
    planet.relief.heights = {test::whole_body_map(file.string())};
    all.push_back({"planet", make(planet, context)});
    TerrainParameters terrain;
    terrain.half_edge_m = r;
    all.push_back({"terrain", make(terrain, context), true});
    return all;
}

} // namespace

TEST_CASE("A ray that starts on a surface and points outwards leaves it, on all shapes and scales") {
    const test::TempFolder folder;
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    const auto direction = [&] { return normalized(Vec3{normal(random), normal(random), normal(random)}); };
    for (const double r : {1.0, 0.1234567, 500.0, 1.7374e6, 7.1492e7})
        for (const Case& c : cases(r, folder)) {
            INFO(c.name << ' ' << r);
            int wrong = 0, traced = 0, missed = 0, inside = 0;
            for (int k = 0; k < 400; ++k) {
                // A point of the surface and the normal there.
                Vec3 from = 3 * c.shape->bounding_radius_m() * direction();
                if (c.ground) from.z = r;
                test::OneRay view(from, normalized(0.2 * r * direction() - from));
                view.meet(*c.shape);
                if (view.hits.body[test::OneRay::lane] < 0) continue;
                const SurfacePacket s = view.surface(*c.shape);
                const Vec3 at = s.position.lane(test::OneRay::lane),
                           n = s.facet_normal.lane(test::OneRay::lane);
                // With turns about the body's axes, as cameras have them, it is off by rounding.
                const Quat turn = axis_angle(direction(), 1 + normal(random));
                const Vec3 turned = rotate(conjugate(turn), rotate(turn, at));
                for (const double height_m : {0.0, 1e-6, 1e-3}) {
                    for (const double grazing : {1.0, 0.3, 1e-2, 1e-4}) {
                        // Embree's floats may take such a ray below a facet beyond the next edge.
                        if (c.name == "mesh" && grazing < 1e-3) continue;
                        Vec3 along = direction();
                        along = normalized(along - dot(along, n) * n);
                        const Vec3 out = normalized(grazing * n + along * (1 - grazing));
                        for (const Vec3 start : {at + height_m * n, turned + height_m * n}) {
                            ++traced;
                            if (distance_along(*c.shape, start, out) != no_hit) ++wrong;
                        }
                    }
                }
                if (c.flat || c.ground) continue;
                // What is truly inside sees the inside.
                ++inside;
                if (distance_along(*c.shape, at - 1e-3 * r * n, n) == no_hit) ++missed;
                if (distance_along(*c.shape, at - 1e-10 * r * n, n) == no_hit && c.name != "mesh") ++missed;
            }
            CHECK(traced > 1000);
            CHECK(wrong == 0);
            CHECK(missed == 0);
        }
}

TEST_CASE(
    "Whether a start is on an ellipsoid is what exact arithmetic says, but for some units in the last place") {
    // Heights in units of the last place of the radius, by quadruple precision.
    using Exact = __float128;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    for (const double r : {1.0, 1.7374e6, 7.1492e7}) {
        ShapeContext context;
        const auto shape = make(EllipsoidParameters{{r, 0.9 * r, 0.8 * r}}, context);
        for (int k = 0; k < 4000; ++k) {
            const Vec3 u = normalized(Vec3{normal(random), normal(random), normal(random)});
            const double depth = std::ldexp(1.0, -60 + k % 30) * (k % 2 == 0 ? 1 : -1);
            const Vec3 p = Vec3{r * u.x, 0.9 * r * u.y, 0.8 * r * u.z} * (1 - depth);
            const Exact x = Exact(p.x) / Exact(r), y = Exact(p.y) / Exact(0.9 * r),
                        z = Exact(p.z) / Exact(0.8 * r);
            const double below = static_cast<double>(1 - (x * x + y * y + z * z)) / 2;
            const Vec3 out = normalized(Vec3{u.x / r, u.y / (0.9 * r), u.z / (0.8 * r)});
            const double t = distance_along(*shape, p, out);
            INFO(r << ' ' << below);
            if (below <= 0x1p-50) CHECK(t == no_hit);
            if (below >= 0x1p-46) CHECK(t != no_hit);
        }
    }
}

TEST_CASE("A camera on the ground sees the sky above it, from 0 m as from 1 mm") {
    for (const double r : {1.7374e6, 7.1492e7})
        for (const bool turned : {false, true}) {
            INFO(r << ' ' << turned);
            const auto picture = [&](double height_m) {
                scene::Scene s;
                s.bodies.push_back({"ground", EllipsoidParameters{{r, r, r}}, LambertParameters{0.3}, {}});
                s.bodies.push_back(
                    {"moon", EllipsoidParameters{{1e6, 1e6, 1e6}}, LambertParameters{0.3}, {}});
                const Vec3 up = normalized(Vec3{0.3, -0.5, 0.7});
                if (turned) s.bodies[0].motion.samples[0].pose.orientation = axis_angle({1, 2, 3}, 0.7);
                s.bodies[1].motion.samples[0].pose.position_m = (r + 3e8) * up + Vec3{4e6, 0, 0};
                s.sun.position_m = 1.5e11 * up;
                s.sun.position_m = s.sun.position_m + Vec3{0, 0, 2e10};
                s.camera = test::camera_at(up, 48, 1e-3);
                s.camera.motion.samples[0].pose = {(r + height_m) * up, look_along(up, {0, 0, 1})};
                return test::render(Renderer(s, {4, 2, 1}));
            };
            const test::Image wanted = picture(1e-3);
            CHECK(wanted.sum() > 0);
            for (const double height_m : {0.0, 1e-6}) {
                const test::Image image = picture(height_m);
                CHECK(std::abs(image.sum() / wanted.sum() - 1) < 1e-6);
                float largest = 0;
                for (std::size_t i = 0; i < image.values.size(); ++i)
                    largest = std::max(largest, std::abs(image.values[i] - wanted.values[i]));
                CHECK(static_cast<double>(largest) < 1e-5 * wanted.sum());
            }
        }
}

} // namespace own_surface_test
