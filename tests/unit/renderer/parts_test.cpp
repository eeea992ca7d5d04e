// SPDX-License-Identifier: Apache-2.0
// The renderer's parts: mesh reading, samples, psf, ellipsoid, spectra, refusal of bad scenes.
#include "core/error.hpp"
#include "renderer/camera/gaussian_psf.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/mesh_files/obj.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/packets/vector_math.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/hull.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <set>

namespace parts_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::string message_of(std::string_view obj) {
    try {
        (void)parse_obj(obj, "rock.obj", 1);
    } catch (const InputError& e) {
        return e.what();
    }
    return "accepted";
}

std::string refusal(const scene::Scene& s) {
    try {
        const Renderer r(s, {1, 1, 1});
    } catch (const Error& e) {
        CHECK(std::string(e.what()).find('\n') == std::string::npos);
        return e.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("OBJ files are read") {
    const TriangleMesh mesh =
        parse_obj("# a roof\no roof\nv 0 0 0\nv 1 0 0 1.0\r\nv 1e0 1 0\nv 0 1 .5\nvn 0 0 1\n"
                  "f 1/1/1 2//1 3\ng x\nf -4 -2 -1\n\nf 1 2 3 4",
                  "roof.obj", 1000);
    CHECK(mesh.vertices.size() == 4);
    CHECK(mesh.triangles.size() == 4);
    CHECK(mesh.vertices[3].z == 500);
    CHECK(mesh.triangles[1] == std::array<std::uint32_t, 3>{0, 2, 3});
}

TEST_CASE("Bad OBJ files are refused with file and line") {
    CHECK(message_of("") == "rock.obj: no triangles: a mesh needs at least one face");
    CHECK(message_of("v 0 0 0\nv 1 0\n") == "rock.obj:2: vertex with fewer than three coordinates");
    CHECK_THAT(message_of("v 0 0 x1\n"), ContainsSubstring("rock.obj:1: 'x1' is not a coordinate"));
    CHECK_THAT(message_of("v 0 nan 0\n"), ContainsSubstring("rock.obj:1: coordinate 'nan' is not finite"));
    CHECK_THAT(message_of("v 0 1e300 0\n"),
               ContainsSubstring("rock.obj:1: coordinate '1e300' is not finite"));
    CHECK_THAT(message_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
               ContainsSubstring("rock.obj:4: vertex index 4 out of range: allowed 1 to 3"));
    CHECK_THAT(message_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"),
               ContainsSubstring("rock.obj:4: vertex index 0"));
    CHECK_THAT(message_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n"),
               ContainsSubstring("rock.obj:4: vertex index -4"));
    CHECK_THAT(message_of("v 0 0 0\nf 1 1\n"), ContainsSubstring("rock.obj:2: face with 2 vertices"));
    CHECK_THAT(message_of("v 0 0 0\nv 1 0 0\nf 1 2 2\n"), ContainsSubstring("every triangle has zero area"));
    CHECK_THAT(message_of("v 0 0 0\nf 1 a 1\n"), ContainsSubstring("rock.obj:2: 'a' is not a vertex index"));
}

TEST_CASE("Scenes that cannot be are refused in one line that says where") {
    const scene::Scene good = test::sphere_scene(renderer::LambertParameters{0.3}, 1, 10, 32);
    CHECK(refusal(good) == "accepted");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    scene::Scene s = good;
    s.bodies[0].shape = renderer::MeshFileParameters{"/nowhere/rock.obj", 1, true};
    CHECK_THAT(refusal(s), ContainsSubstring("/nowhere/rock.obj: cannot open"));
    s = good;
    s.bodies[0].shape = renderer::EllipsoidParameters{{1, 0, 1}};
    CHECK_THAT(refusal(s), ContainsSubstring("body 'ball': radii 1 0 1 m"));
    s = good;
    s.bodies[0].shape = renderer::ProceduralBodyParameters{nan, {1, 1, 1}, 1, 3};
    CHECK_THAT(refusal(s), ContainsSubstring("body 'ball': mean radius nan m: allowed"));
    s = good;
    s.bodies[0].shape = renderer::ProceduralBodyParameters{1, {1, 1, 1}, 1, 10};
    CHECK_THAT(refusal(s), ContainsSubstring("subdivisions 10: allowed 0 to 9"));
    s = good;
    s.bodies[0].material = renderer::LambertParameters{1.5};
    CHECK_THAT(refusal(s), ContainsSubstring("body 'ball': albedo 1.5: allowed 0 to 1"));
    s = good;
    s.bodies[0].motion.samples[0].pose.position_m.y = nan;
    CHECK_THAT(refusal(s), ContainsSubstring("body 'ball': pose 1: position: allowed are -1e+15 to 1e+15 m"));
    s = good;
    s.camera.motion.samples[0].pose.orientation = {0, 0, 0, 0};
    CHECK_THAT(refusal(s), ContainsSubstring("camera: orientation of pose 1 is zero"));
    s = good;
    s.camera.motion.samples.push_back(s.camera.motion.samples[0]);
    CHECK_THAT(refusal(s), ContainsSubstring("camera: time of pose 2 is not later"));
    s = good;
    s.camera.width = 0;
    CHECK_THAT(refusal(s), ContainsSubstring("camera: width 0 px: allowed 1 to 65536"));
    s = good;
    s.camera.focal_length_m = 0;
    CHECK_THAT(refusal(s), ContainsSubstring("focal length 0"));
    s = good;
    s.sun.radius_m = -1;
    CHECK_THAT(refusal(s), ContainsSubstring("sun:"));
    s = good;
    s.bands.clear();
    CHECK_THAT(refusal(s), ContainsSubstring("bands: none"));
    s = good;
    s.stars.push_back({0, nan, 0, 0});
    CHECK_THAT(refusal(s), ContainsSubstring("star 1"));
}

TEST_CASE("The samples are Sobol points: every elementary interval is hit once") {
    // 2^10 points: each of the 11 shapes of boxes of area 2^-10 holds exactly one, for any seed.
    for (const std::uint32_t seed : {1u, 77u, 0xdeadbeefu}) {
        std::vector<std::pair<double, double>> points;
        for (std::uint32_t first = 0; first < 1024; first += packet_size) {
            Words index;
            Words seeds;
            for (std::uint32_t i = 0; i < packet_size; ++i) {
                index[static_cast<int>(i)] = first + i;
                seeds[static_cast<int>(i)] = seed;
            }
            Doubles u;
            Doubles v;
            sobol_pair(index, seeds, u, v);
            for (int i = 0; i < packet_size; ++i)
                points.emplace_back(u[i], v[i]);
        }
        for (int k = 0; k <= 10; ++k) {
            std::set<std::pair<int, int>> boxes;
            for (const auto& [u, v] : points)
                boxes.emplace(static_cast<int>(u * (1 << k)), static_cast<int>(v * (1 << (10 - k))));
            CHECK(boxes.size() == 1024);
        }
    }
}

TEST_CASE("Both pairs of a sample are stratified together") {
    // 2^12 points in four dimensions: 4^4 boxes get 16 points each, whichever two bits of each are taken
    // first.
    for (const std::uint32_t seed : {1u, 77u, 0xdeadbeefu}) {
        std::map<std::array<int, 4>, int> quarters;
        std::set<std::pair<int, int>> boxes;
        for (std::uint32_t first = 0; first < 4096; first += packet_size) {
            Words index;
            Words seeds;
            for (std::uint32_t i = 0; i < packet_size; ++i) {
                index[static_cast<int>(i)] = first + i;
                seeds[static_cast<int>(i)] = seed;
            }
            Doubles p[4];
            sobol_pair(index, seeds, p[0], p[1]);
            sobol_second_pair(index, seeds, p[2], p[3]);
            for (int i = 0; i < packet_size; ++i) {
                std::array<int, 4> box{};
                for (std::size_t d = 0; d < 4; ++d)
                    box[d] = static_cast<int>(p[d][i] * 4);
                ++quarters[box];
                boxes.emplace(static_cast<int>(p[2][i] * 4096), 0);
                boxes.emplace(static_cast<int>(p[3][i] * 4096), 1);
            }
        }
        CHECK(boxes.size() == 2 * 4096);
        CHECK(quarters.size() == 256);
        for (const auto& [box, count] : quarters)
            CHECK(count == 16);
    }
}

TEST_CASE("Different pixels, frames, seeds and purposes get different samples") {
    std::set<std::uint32_t> first_words;
    for (std::uint64_t seed : {1u, 2u})
        for (std::uint64_t frame : {1u, 2u})
            for (const auto purpose : {SamplePurpose::pixel, SamplePurpose::body})
                for (int x = 0; x < 8; ++x)
                    for (int y = 0; y < 8; ++y)
                        first_words.insert(seed_words(seed, frame, purpose, x, y)[0]);
    CHECK(first_words.size() == 2 * 2 * 2 * 64);
}

TEST_CASE("Displaced samples and splatted points see the same Gaussian PSF") {
    for (const double sigma : {0.0, 0.3, 0.5, 1.2}) {
        const GaussianAxis psf(sigma);
        // Share of a pixel's samples that land within [a, a + 1/4): by counting, and by integrating the
        // splatted weight of points there.
        constexpr int n = 1 << 16;
        std::vector<double> counted(64);
        for (int first = 0; first < n; first += packet_size) {
            Doubles u;
            for (int i = 0; i < packet_size; ++i)
                u[i] = (first + i + 0.5) / n;
            Doubles offset;
            psf.offsets(u, offset);
            for (int i = 0; i < packet_size; ++i) {
                CHECK(std::abs(offset[i]) <= psf.reach_px());
                const int bin = static_cast<int>(std::floor((offset[i] + 8) * 4));
                if (bin >= 0 && bin < 64) counted[static_cast<std::size_t>(bin)] += 1.0 / n;
            }
        }
        for (int bin = 0; bin < 64; ++bin) {
            double expected = 0;
            for (int k = 0; k < 32; ++k)
                expected += psf.weight(bin / 4.0 - 8 + (k + 0.5) / 128, 0) / 128;
            CHECK_THAT(counted[static_cast<std::size_t>(bin)], WithinAbs(expected, 3e-4));
        }
        double sum = 0;
        for (int i = -20; i <= 20; ++i)
            sum += psf.weight(0.37, i);
        CHECK_THAT(sum, WithinAbs(1, 1e-9));
    }
}

TEST_CASE("Weights of pixels from the table are those of the Gaussian") {
    // Down to widths that have no table.
    for (const double sigma : {0.0, 1e-9, 0.019, 0.02, 0.1, 0.3, 0.76, 3.0, 20.0}) {
        const GaussianAxis psf(sigma);
        double worst = 0;
        for (const double x : {-7.3, 0.0, 0.25, 0.5, 0.7654321, 1.0, 2.4999999, 1e4 + 0.1}) {
            CAPTURE(sigma, x);
            const auto reach = static_cast<std::int32_t>(std::ceil(psf.splat_reach_px())) + 3;
            const auto first = static_cast<std::int32_t>(std::floor(x)) - reach;
            std::vector<double> weights(static_cast<std::size_t>(2 * reach + 2));
            psf.weights(x, first, weights);
            double sum = 0;
            for (std::size_t i = 0; i < weights.size(); ++i) {
                worst = std::max(worst,
                                 std::abs(weights[i] - psf.weight(x, first + static_cast<std::int32_t>(i))));
                sum += weights[i];
            }
            CHECK_THAT(sum, WithinAbs(1, 1e-9));
            // The same of any part of the pixels, one for instance, or none that get light.
            for (const std::int32_t pixel : {first, first + reach, first + reach + 1, first + 1000}) {
                double one = -1;
                psf.weights(x, pixel, {&one, 1});
                CHECK_THAT(one, WithinAbs(psf.weight(x, pixel), 1e-10));
            }
        }
        CHECK(worst < 1e-10);
    }
}

TEST_CASE("The hull of a mesh keeps every ray that may meet it, and drops most that cannot") {
    const TriangleMesh mesh = make_procedural_body({500, {1, 0.8, 0.6}, 3, 4});
    Hull hull;
    for (const Vec3f& v : mesh.vertices)
        hull.include({v.x, v.y, v.z});
    std::uint32_t state = 7;
    const auto random = [&] {
        state = state * 1664525u + 1013904223u;
        return state / 4294967296.0;
    };
    const auto direction = [&] {
        return normalized(Vec3{random() - 0.5, random() - 0.5, random() - 0.5 + 1e-9});
    };
    std::size_t lost = 0;
    std::size_t kept_outside = 0;
    std::size_t outside = 0;
    for (int n = 0; n < 2000; ++n) {
        const Vec3 camera = std::pow(10, 3 + 8 * random()) * direction();
        const double slack = 1e-3 * random();
        RayPacket rays;
        Lanes near;
        Lanes empty;
        RayPacket beside;
        for (int i = 0; i < packet_size; ++i) {
            const Vec3f v = mesh.vertices[static_cast<std::size_t>(random() * mesh.vertices.size())];
            const Vec3 d = normalized(Vec3{v.x, v.y, v.z} - camera);
            rays.origin.set(i, camera);
            beside.origin.set(i, camera);
            rays.direction.set(i, normalized(d + 0.999 * slack * normalized(cross(d, direction()))));
            // Past the body, by 1.3 to 2 times its largest radius.
            const Vec3 side = normalized(cross(camera, direction()));
            beside.direction.set(i, normalized((1.3 + 0.7 * random()) * 700 * side - camera));
            near.on[i] = empty.on[i] = -1;
        }
        hull.cull(rays, slack, near);
        lost += static_cast<std::size_t>(packet_size - near.count());
        hull.cull(beside, 0, empty);
        kept_outside += static_cast<std::size_t>(empty.count());
        outside += packet_size;
    }
    CHECK(lost == 0);
    CHECK(kept_outside * 10 < outside);
}

TEST_CASE("Sine and cosine of turns") {
    for (int i = 0; i < 1000; ++i) {
        double s = 0;
        double c = 0;
        const double x = i / 1000.0;
        sincos_turn(x, s, c);
        CHECK_THAT(s, WithinAbs(std::sin(2 * std::numbers::pi * x), 1e-11));
        CHECK_THAT(c, WithinAbs(std::cos(2 * std::numbers::pi * x), 1e-11));
    }
}

TEST_CASE("An ellipsoid is hit on its surface, from near and from 1 au") {
    const Vec3 radii{500, 300, 200};
    const Ellipsoid ellipsoid(renderer::EllipsoidParameters{radii});
    for (const double distance : {201.0, 1e4, 1.5e11}) {
        RayPacket rays{};
        for (int i = 0; i < packet_size; ++i) {
            // At points across the body and beyond it, from +z.
            const Vec3 target{-560.0 + 70 * i, 40, 0};
            const Vec3 origin = Vec3{0, 0, distance} + target;
            rays.origin.set(i, origin);
            rays.direction.set(i, {0, 0, -1});
            rays.t_max[i] = no_hit;
            rays.active.on[i] = -1;
        }
        HitPacket hits;
        hits.clear();
        ellipsoid.intersect(rays, 5, hits);
        SurfacePacket surface;
        ellipsoid.surface(rays, hits, 5, surface);
        for (int i = 0; i < packet_size; ++i) {
            const double x = -560.0 + 70 * i;
            const double inside = 1 - x * x / (500.0 * 500) - 40.0 * 40 / (300.0 * 300);
            CHECK((hits.body[i] == 5) == (inside > 0));
            if (inside <= 0) continue;
            const double z = 200 * std::sqrt(inside);
            CHECK_THAT(hits.t[i], WithinAbs(distance - z, 1e-4 + 1e-15 * distance));
            const Vec3 normal = normalized(Vec3{x / (500.0 * 500), 40 / (300.0 * 300), z / (200.0 * 200)});
            CHECK(dot(surface.normal.lane(i), normal) > 1 - 1e-8);
        }
    }
}

TEST_CASE("The solar table agrees with the published spectrum") {
    // Published totals: 1366.1 W/m2, 98.7 % of it below 4 um and above 0.2 um.
    CHECK_THAT(solar_band_irradiance_w_m2(200e-9, 4000e-9), WithinAbs(1354.2, 0.1));
    CHECK(solar_band_irradiance_w_m2(900e-9, 400e-9) == 0);
    const auto file = test::data_file("spectra/E490_00a_AM0.csv");
    if (!file) return;
    std::ifstream in(*file);
    std::string line;
    std::vector<std::pair<double, double>> points;
    while (std::getline(in, line))
        if (!line.empty() && std::isdigit(static_cast<unsigned char>(line[0])) != 0) {
            const auto comma = line.find(',');
            points.emplace_back(std::stod(line) * 1e-6, std::stod(line.substr(comma + 1)) * 1e6);
        }
    for (const auto& [from, to] : {std::pair{400e-9, 900e-9}, {505e-9, 615e-9}, {350e-9, 1100e-9}}) {
        double sum = 0;
        for (std::size_t i = 1; i < points.size(); ++i) {
            const double a = std::max(from, points[i - 1].first);
            const double b = std::min(to, points[i].first);
            if (b > a) sum += (b - a) * (points[i - 1].second + points[i].second) / 2;
        }
        CHECK_THAT(solar_band_irradiance_w_m2(from, to), WithinRel(sum, 2e-3));
    }
}

TEST_CASE("The procedural body is closed, rough, cratered and the same every time") {
    const renderer::ProceduralBodyParameters d{500, {1, 0.8, 0.7}, 42, 5};
    const TriangleMesh a = make_procedural_body(d);
    const TriangleMesh b = make_procedural_body(d);
    CHECK(a.triangles.size() == 20480);
    CHECK(std::memcmp(a.vertices.data(), b.vertices.data(), a.vertices.size() * sizeof(Vec3f)) == 0);
    // Closed: every edge is used once in each direction.
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : a.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            CHECK(edges.emplace(t[k], t[(k + 1) % 3]).second);
    for (const auto& [from, to] : edges)
        if (!edges.contains({to, from})) FAIL("an edge has one face only");
    // The volume is that of a body of the mean radius, within the relief.
    double volume = 0;
    for (const auto& t : a.triangles) {
        const auto p = [&](std::size_t k) {
            return Vec3{a.vertices[t[k]].x, a.vertices[t[k]].y, a.vertices[t[k]].z};
        };
        volume += dot(p(0), cross(p(1), p(2))) / 6;
    }
    CHECK_THAT(volume, WithinRel(4.0 / 3 * std::numbers::pi * 500 * 500 * 500, 0.35));
    renderer::ProceduralBodyParameters other = d;
    other.seed = 43;
    CHECK(std::memcmp(a.vertices.data(), make_procedural_body(other).vertices.data(),
                      a.vertices.size() * sizeof(Vec3f)) != 0);
}

} // namespace parts_test
