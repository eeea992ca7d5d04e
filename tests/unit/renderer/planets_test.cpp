// SPDX-License-Identifier: Apache-2.0
// Planets with height maps: crossings against marching, ellipsoids, Embree and the Moon's own extremes.
#include "core/error.hpp"
#include "images/writers/fits.hpp"
#include "renderer/planets/planet.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

class Directions {
public:
    double number() { return uniform_(engine_); }
    /// Uniform over the sphere.
    Vec3 operator()() {
        const double z = 2 * number() - 1, turn = 2 * pi * number(), rho = std::sqrt(1 - z * z);
        return {rho * std::cos(turn), rho * std::sin(turn), z};
    }

private:
    std::mt19937_64 engine_{1};
    std::uniform_real_distribution<double> uniform_{0, 1};
};

/// Rough relief with waves of a few cells.
double waves(Vec3 p) {
    return 0.05 * std::sin(7 * p.x) * std::cos(5 * p.y + 2 * p.z) + 0.02 * std::sin(31 * p.z + 9 * p.x);
}

/// Distance to a shape along one ray; no_hit: none.
double distance_to(const Shape& shape, Vec3 origin, Vec3 direction) {
    RayPacket rays;
    HitPacket hits;
    hits.clear();
    for (int i = 0; i < packet_size; ++i) {
        rays.origin.set(i, origin);
        rays.direction.set(i, direction);
        rays.t_max[i] = no_hit;
        rays.active.on[i] = i == 5 ? -1 : 0;
    }
    shape.intersect(rays, 2, hits);
    shape.occlude(rays);
    CHECK((rays.active.on[5] == 0) == (hits.body[5] == 2));
    return hits.t[5];
}

Vec3 at_latitude(double latitude_rad, double longitude_rad) {
    return {std::cos(latitude_rad) * std::cos(longitude_rad),
            std::cos(latitude_rad) * std::sin(longitude_rad), std::sin(latitude_rad)};
}

/// A raster of a function of the direction.
template<typename F>
HeightMap map_of(std::int32_t height, double left_rad, F&& f) {
    std::vector<float> samples;
    for (std::int32_t j = 0; j < height; ++j)
        for (std::int32_t i = 0; i < 2 * height; ++i)
            samples.push_back(static_cast<float>(
                f(at_latitude((0.5 - (j + 0.5) / height) * pi, left_rad + (i + 0.5) / height * pi))));
    return {2 * height, height, std::move(samples), left_rad};
}

} // namespace

TEST_CASE("A height map is its function across its seam and its poles") {
    const auto f = [](Vec3 p) { return 1000 * (p.x * p.y + 0.7 * p.z * p.z * p.z - 0.4 * p.y); };
    const HeightMap map = map_of(180, 20 * degree, f);
    Directions any;
    for (int k = 0; k < 20000; ++k) {
        Vec3 p = any();
        if (k % 4 == 1)
            p = at_latitude(std::copysign(90 - 2 * any.number(), p.z) * degree, 360 * any.number());
        if (k % 4 == 2) p = at_latitude(pi * (any.number() - 0.5), (20 + 0.5 * any.number()) * degree);
        // Cubics leave a share of (step)^3 of third derivatives of some hundred metres.
        REQUIRE_THAT(map.at(2.5 * p), WithinAbs(f(p), 0.02));
    }
    // Samples are met at the middles of their pixels, of one degree.
    const Vec3 middle = at_latitude(0.5 * degree, 20.5 * degree);
    CHECK_THAT(map.at(middle), WithinAbs(static_cast<float>(f(middle)), 1e-9));
    CHECK_THAT(map.at({0, 0, 1}), WithinAbs(700, 0.02));
}

TEST_CASE("A planet without relief is its ellipsoid, from two metres to an astronomical unit") {
    const Vec3 radii{1829400, 1819300, 1815700};
    const Planet planet(radii, HeightField(64, [](Vec3) { return 0.0; }));
    const Ellipsoid ellipsoid(EllipsoidParameters{radii});
    Directions any;
    for (const double altitude_m : {2.0, 1e3, 1e6, 1e9, 1.5e11})
        for (int k = 0; k < 400; ++k) {
            const Vec3 up = any();
            const Vec3 origin = (length({up.x * radii.x, up.y * radii.y, up.z * radii.z}) + altitude_m) *
                                normalized(Vec3{up.x * radii.x, up.y * radii.y, up.z * radii.z});
            const Vec3 aim = any();
            const Vec3 target =
                0.999 * std::cbrt(any.number()) * Vec3{aim.x * radii.x, aim.y * radii.y, aim.z * radii.z};
            const Vec3 direction = normalized(target - origin);
            const double wanted = distance_to(ellipsoid, origin, direction);
            REQUIRE(wanted < no_hit);
            // At grazing incidence the rounding of the direction alone moves the crossing.
            REQUIRE_THAT(distance_to(planet, origin, direction),
                         WithinAbs(wanted, std::max(1e-3, 1e-13 * altitude_m)));
        }
}

TEST_CASE("A ray meets a height field where marching along it does") {
    const HeightField field(32, waves);
    Directions any;
    int met = 0;
    for (int k = 0; k < 1500; ++k) {
        const Vec3 origin = any() * (1.08 + 3 * any.number());
        const Vec3 direction = normalized(any() * (1.06 * any.number()) - origin);
        const auto above = [&](double t) {
            const Vec3 p = origin + t * direction;
            return length(p) - 1 - field.height(p);
        };
        // The part of the ray that the relief reaches, in short steps.
        constexpr double reach = 1.08;
        constexpr int steps = 8000;
        const double along = -dot(origin, direction);
        const double half2 = reach * reach - length_squared(origin + along * direction);
        double wanted = no_hit;
        if (half2 > 0) {
            const double from = std::max(0.0, along - std::sqrt(half2)), to = along + std::sqrt(half2);
            for (int i = 1; i <= steps && wanted == no_hit; ++i) {
                double low = from + (to - from) * (i - 1) / steps, high = from + (to - from) * i / steps;
                if (above(high) > 0) continue;
                for (int bisection = 0; bisection < 60; ++bisection)
                    (above((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
                wanted = high;
            }
        }
        const HeightField::Crossing found = field.first_crossing(origin, direction, no_hit);
        INFO("ray " << k);
        if (wanted == no_hit) {
            // A touch shorter than a step is one all the same.
            if (found.t != no_hit) REQUIRE_THAT(above(found.t), WithinAbs(0, 1e-9));
            continue;
        }
        ++met;
        if (found.t < wanted - 1e-9)
            REQUIRE_THAT(above(found.t), WithinAbs(0, 1e-9));
        else
            REQUIRE_THAT(found.t, WithinAbs(wanted, 1e-11));
        // Limits are kept.
        CHECK(field.first_crossing(origin, direction, found.t * (1 - 1e-9)).t == no_hit);
        CHECK_THAT(field.first_crossing(origin, direction, found.t * (1 + 1e-9)).t,
                   WithinAbs(found.t, 1e-12));
    }
    CHECK(met > 1000);
}

TEST_CASE("Nothing slips through the borders of cells, levels and faces") {
    const HeightField field(32, waves);
    Directions any;
    const auto on_lattice = [&] { return std::round(32 * any.number()) / 16 - 1; };
    int escaped = 0;
    for (int k = 0; k < 200000; ++k) {
        // Towards vertices and along border planes, from outside, from the centre and from beside it.
        const terrain::CubeFace& face =
            terrain::cube_faces[static_cast<std::size_t>(k) % terrain::cube_face_count];
        const Vec3 aim = normalized(
            terrain::cube_point(face, on_lattice(), k % 8 < 4 ? on_lattice() : 2 * any.number() - 1));
        const Vec3 outside = 3 * any();
        escaped += field.first_crossing(outside, 0.9 * aim - outside, no_hit).t == no_hit ? 1 : 0;
        escaped += field.first_crossing(2 * aim, -aim, no_hit).t == no_hit ? 1 : 0;
        escaped += field.first_crossing({0, 0, 0}, aim, no_hit).t == no_hit ? 1 : 0;
        const Vec3 within = 0.9 * any.number() * any();
        escaped += field.first_crossing(within, aim - within, no_hit).t == no_hit ? 1 : 0;
    }
    CHECK(escaped == 0);
    // From below the ground the way out is met, and it is the way in of the ray back.
    for (int k = 0; k < 2000; ++k) {
        const Vec3 within = 0.92 * any(), direction = any();
        const double out = field.first_crossing(within, direction, no_hit).t;
        const Vec3 point = within + out * direction;
        REQUIRE_THAT(length(point) - 1, WithinAbs(field.height(point), 1e-12));
    }
}

TEST_CASE("A height field is the mesh of its points as Embree meets it") {
    constexpr std::uint32_t cells = 16, pieces = 12, edge = cells * pieces;
    const HeightField field(cells, waves);
    TriangleMesh mesh;
    for (const terrain::CubeFace& face : terrain::cube_faces) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        const bool turned = dot(cross(terrain::cube_point(face, 1, 0) - terrain::cube_point(face, 0, 0),
                                      terrain::cube_point(face, 0, 1) - terrain::cube_point(face, 0, 0)),
                                terrain::cube_point(face, 0, 0)) < 0;
        for (std::uint32_t j = 0; j <= edge; ++j)
            for (std::uint32_t i = 0; i <= edge; ++i) {
                const Vec3 q = normalized(terrain::cube_point(face, 2.0 * i / edge - 1, 2.0 * j / edge - 1));
                const Vec3 p = 1000 * (1 + field.height(q)) * q;
                mesh.vertices.push_back(
                    {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
            }
        for (std::uint32_t j = 0; j < edge; ++j)
            for (std::uint32_t i = 0; i < edge; ++i) {
                const std::uint32_t a = first + j * (edge + 1) + i, b = a + 1, c = a + edge + 1, d = c + 1;
                mesh.triangles.push_back(turned ? std::array{a, c, b} : std::array{a, b, c});
                mesh.triangles.push_back(turned ? std::array{b, c, d} : std::array{b, d, c});
            }
    }
    const MeshShape facets(std::make_shared<const EmbreeDevice>(), mesh);
    const Planet planet({1000, 1000, 1000}, HeightField(cells, waves));
    Directions any;
    int differ = 0, met = 0;
    for (int k = 0; k < 20000; ++k) {
        const Vec3 origin = any() * 3000;
        const Vec3 direction = normalized(any() * (1080 * any.number()) - origin);
        const double wanted = distance_to(facets, origin, direction);
        const double got = distance_to(planet, origin, direction);
        met += wanted < no_hit ? 1 : 0;
        // Facets of 8 m on slopes of up to 40 degrees stay within some centimetres of the bilinear patches.
        const bool same =
            (wanted == no_hit) == (got == no_hit) && (wanted == no_hit || std::abs(wanted - got) < 0.5);
        differ += same ? 0 : 1;
    }
    CHECK(met > 15000);
    CHECK(differ < 30); // at the limb
}

TEST_CASE("Normals are gradients of the patches, and continuous when smooth") {
    const HeightField field(32, waves);
    Directions any;
    double worst = 0;
    for (int k = 0; k < 3000; ++k) {
        const Vec3 p0 = any();
        const HeightField::Crossing c = field.first_crossing(2 * p0, -p0, no_hit);
        const Vec3 p = (2 - c.t) * p0;
        if (std::min({c.s, c.r, 1 - c.s, 1 - c.r}) < 1e-3) continue;
        const auto above = [&](Vec3 q) { return length(q) - 1 - field.height(q); };
        constexpr double e = 1e-7;
        const Vec3 wanted{(above(p + Vec3{e, 0, 0}) - above(p - Vec3{e, 0, 0})) / (2 * e),
                          (above(p + Vec3{0, e, 0}) - above(p - Vec3{0, e, 0})) / (2 * e),
                          (above(p + Vec3{0, 0, e}) - above(p - Vec3{0, 0, e})) / (2 * e)};
        REQUIRE(length(field.gradients(c.cell, c.s, c.r).facet - wanted) < 1e-7);
        // The smooth normal just over the cell's border, and over a face's.
        const terrain::CubeFace& face = terrain::cube_faces[terrain::cube_face_of(p)];
        const Vec3 border =
            terrain::cube_point(face, std::round(16 * terrain::component(p, face.u_axis)) / 16,
                                terrain::component(p, face.v_axis));
        const auto smooth = [&](Vec3 q) {
            const HeightField::Crossing at = field.first_crossing(2 * normalized(q), -normalized(q), no_hit);
            return normalized(field.gradients(at.cell, at.s, at.r).smooth);
        };
        const Vec3 aside = terrain::cube_point(face, 1, 0) - terrain::cube_point(face, 0, 0);
        worst = std::max(worst, length(smooth(border + 1e-9 * aside) - smooth(border - 1e-9 * aside)));
    }
    CHECK(worst < 1e-2); // at edges of faces; 1e-8 elsewhere
    CHECK(worst > 0);
}

TEST_CASE("The shadow of a mountain ends where the Sun's ray over its top meets the sphere") {
    // One vertex of 2 km on the Moon's equator at longitude 0, all others 0.
    constexpr double radius_m = 1737400, top_m = 2000;
    const Planet moon({radius_m, radius_m, radius_m},
                      HeightField(512, [](Vec3 p) { return p.x > 1 - 1e-9 ? top_m / radius_m : 0.0; }));
    for (const double elevation_deg : {2.0, 5.0, 15.0}) {
        // From the top along the meridian plane of the Sun: the angle at the centre at which the Sun's ray
        // that grazes the top reaches the sphere at that elevation.
        const double elevation = elevation_deg * degree;
        const double reach = std::acos(std::cos(elevation) * radius_m / (radius_m + top_m)) - elevation;
        for (const double share : {0.9, 0.99, 1.01, 1.1}) {
            const double angle = -share * reach;
            const Vec3 ground = radius_m * (1 + 1e-10) * Vec3{std::cos(angle), std::sin(angle), 0};
            // The Sun at that elevation at the end of the shadow, not at `ground`.
            const double at_end = -reach;
            const Vec3 up{std::cos(at_end), std::sin(at_end), 0},
                east{-std::sin(at_end), std::cos(at_end), 0};
            const Vec3 sun = std::sin(elevation) * up + std::cos(elevation) * east;
            INFO(elevation_deg << " deg, at " << share << " of the shadow");
            CHECK((distance_to(moon, ground, sun) < no_hit) == (share < 1));
        }
    }
}

TEST_CASE("A scene's planet takes heights or radii, and says what is wrong with a file") {
    const TempFolder folder;
    const auto write = [&](const char* name, std::int32_t width, std::int32_t height, float value) {
        const std::vector<float> samples(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                                         value);
        images::write_fits_float(folder.path() / name, width, height, 1, samples, "", {});
        return (folder.path() / name).string();
    };
    const auto shape_of = [](PlanetParameters p) {
        ShapeContext context;
        context.place = "body 'moon'";
        return make(p, context);
    };
    PlanetParameters p;
    p.radii_m = {1000, 900, 800};
    p.height_file = write("heights.fits", 16, 8, 50);
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1150, 1e-3));
    CHECK_THAT(distance_to(*shape_of(p), {0, -2000, 0}, {0, 1, 0}), WithinAbs(1050, 1e-3));
    p.height_scale_m = 2;
    CHECK_THAT(distance_to(*shape_of(p), {2000, 0, 0}, {-1, 0, 0}), WithinAbs(900, 1e-3));
    p.height_scale_m = 1;
    p.height_file = write("radii.fits", 16, 8, 950);
    CHECK_THROWS_WITH(shape_of(p),
                      ContainsSubstring("radii.fits: heights up to 950 m on a body of radius 800 m; if "
                                        "they are distances from the centre, set height_values"));
    p.values = HeightMap::Values::radius;
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1050, 1e-3));
    p.height_file = write("square.fits", 8, 8, 950);
    CHECK_THROWS_WITH(shape_of(p), ContainsSubstring("square.fits: 8 x 8 pixels; a height map covers"));
    p.height_file = write("hole.fits", 16, 8, std::numeric_limits<float>::quiet_NaN());
    CHECK_THROWS_WITH(shape_of(p), ContainsSubstring("hole.fits: pixel 0, 0 has no height"));
    p.height_file = (folder.path() / "absent.fits").string();
    CHECK_THROWS_AS(shape_of(p), InputError);
}

TEST_CASE("The Moon of LOLA has its extremes where they are") {
    const auto file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    if (!file) return;
    ShapeContext context;
    PlanetParameters p;
    p.radii_m = {1737400, 1737400, 1737400};
    p.height_file = file->string();
    p.values = HeightMap::Values::radius;
    p.left_longitude_rad = 0;
    const std::shared_ptr<const Shape> moon = make(p, context);
    const auto altitude = [&](double latitude_deg, double longitude_deg) {
        const Vec3 up = at_latitude(latitude_deg * degree, longitude_deg * degree);
        return 2e6 - distance_to(*moon, 2e6 * up, -up) - 1737400;
    };
    // The highest point, 10.8 km, and the floor of Antoniadi, -9.2 km (Smith et al., Geophysical Research
    // Letters 37, L18204, 2010); a grid of 7.6 km shows less of either. Mare Orientale, Tycho's peak.
    CHECK_THAT(altitude(5.44, 201.37), WithinAbs(10500, 400));
    CHECK_THAT(altitude(-70.38, 187.5), WithinAbs(-8800, 400));
    CHECK(altitude(-19.4, 267.2) < -2000);
    CHECK(altitude(-19.4, 267.2) < altitude(-19.4, 255) - 3000);
    CHECK(moon->bounding_radius_m() > 1747500);
    CHECK(moon->bounding_radius_m() < 1748500);
}
