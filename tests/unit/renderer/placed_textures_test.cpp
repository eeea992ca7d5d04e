// SPDX-License-Identifier: Apache-2.0
// Textures whose files state their place, against the longitudes and latitudes of pixels.
#include "core/error.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/textures/texture_place.hpp"
#include "renderer/world/view.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/terrain/obt_support.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

namespace placed_textures_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr double rad = std::numbers::pi / 180;
constexpr int size = 90;

/// Smooth, so that filtering leaves it alone; no symmetry in longitude or latitude.
double factor_at(double lon_deg, double lat_deg) {
    return 0.5 + lat_deg / 450 +
           0.25 * std::sin(lon_deg * rad) * std::cos(lat_deg * rad) * std::cos(lat_deg * rad);
}

/// Edges of a map, degrees.
struct Edges {
    double left, right, top, bottom;
    [[nodiscard]] bool contains(double lon, double lat) const {
        const double from_left = std::fmod(std::fmod(lon - left, 360) + 360, 360);
        return from_left < right - left && lat < top && lat > bottom;
    }
    /// Whether a place is that near to an edge inside the body.
    [[nodiscard]] bool near_edge(double lon, double lat, double by) const {
        bool any = false;
        for (const double x : {-by, 0.0, by})
            for (const double y : {-by, 0.0, by})
                any = any || contains(lon + x, lat + y) != contains(lon, lat);
        return any;
    }
};

float texel(const Edges& e, std::int64_t x, std::int64_t y) {
    return static_cast<float>(
        factor_at(e.left + static_cast<double>(x) + 0.5, e.top - static_cast<double>(y) - 0.5));
}

/// A map with one texel a degree as a giant texture or as an image with a PDS3 label.
std::string written(const TempFolder& folder, const Edges& e, bool obt) {
    const auto width = static_cast<std::int64_t>(e.right - e.left),
               height = static_cast<std::int64_t>(e.top - e.bottom);
    if (obt) {
        terrain::ObtMetadata m = planar_metadata(terrain::SampleType::f32, width, height);
        m.kind = terrain::ObtKind::albedo;
        m.unit.clear();
        terrain::Projection moon;
        moon.equatorial_radius_m = moon.polar_radius_m = 1737400;
        const auto frame =
            terrain::MapFrame::by_edges(moon, terrain::Registration::pixel, width, height, e.left * rad,
                                        e.right * rad, e.top * rad, e.bottom * rad);
        m.projection = frame.projection();
        m.transform = frame.transform();
        FunctionSource source([&](std::uint32_t, std::int64_t x, std::int64_t y) { return texel(e, x, y); });
        const auto file = folder.path() / "map.obt";
        (void)write_obt(file, m, source);
        return file.string();
    }
    std::string data;
    for (std::int64_t y = 0; y < height; ++y)
        for (std::int64_t x = 0; x < width; ++x) {
            const float v = texel(e, x, y);
            data.append(reinterpret_cast<const char*>(&v), sizeof v);
        }
    (void)folder.write("map.img", data);
    return folder
        .write(
            "map.lbl",
            fmt::format(
                "PDS_VERSION_ID = PDS3\n^IMAGE = \"map.img\"\nOBJECT = IMAGE\nLINES = {}\nLINE_SAMPLES = {}\n"
                "SAMPLE_TYPE = PC_REAL\nSAMPLE_BITS = 32\nEND_OBJECT = IMAGE\nOBJECT = IMAGE_MAP_PROJECTION\n"
                "MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\nA_AXIS_RADIUS = 1737.4 <KM>\n"
                "MAP_RESOLUTION = 1 <PIX/DEG>\nPOSITIVE_LONGITUDE_DIRECTION = EAST\n"
                "WESTERNMOST_LONGITUDE = {}\nEASTERNMOST_LONGITUDE = {}\nMAXIMUM_LATITUDE = {}\n"
                "MINIMUM_LATITUDE = {}\nEND_OBJECT = IMAGE_MAP_PROJECTION\nEND\n",
                height, width, e.left, e.right, e.top, e.bottom))
        .string();
}

/// Ratio of the images of two scenes, against `wanted` at the longitude and latitude of each pixel.
template<typename Wanted>
void compare(const scene::Scene& plain, const scene::Scene& mapped, const Edges& e, const Wanted& wanted) {
    const renderer::Renderer white(plain, {16, 2, 1}), r(mapped, {16, 2, 1});
    const std::vector<float> a = render_window(white, {0, 0, size, size}),
                             b = render_window(r, {0, 0, size, size});
    const std::vector<RowTime> times(size);
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.rows = size;
    request.row_times = times;
    std::vector<float> aovs(renderer::aov_count * size * size);
    REQUIRE(r.render_aovs(request, aovs));
    const auto value = [&](renderer::Aov id, std::size_t i) {
        return static_cast<double>(aovs[static_cast<std::size_t>(id) * size * size + i]);
    };
    int compared = 0;
    double worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (!(value(renderer::Aov::emission_deg, i) < 60 && value(renderer::Aov::incidence_deg, i) < 70))
            continue;
        const double lon = value(renderer::Aov::longitude_deg, i),
                     lat = value(renderer::Aov::latitude_deg, i);
        if (e.near_edge(lon, lat, 4)) continue;
        worst = std::max(worst,
                         std::abs(static_cast<double>(b[i]) / static_cast<double>(a[i]) - wanted(lon, lat)));
        ++compared;
    }
    CHECK(compared > 1000);
    CHECK(worst < 0.01);
}

} // namespace

TEST_CASE("textures are where their files say, and change nothing outside them") {
    const TempFolder folder;
    // All longitudes from 0; all from -180; a patch across the meridian of 180 degrees; one over a pole.
    for (const Edges e : {Edges{0, 360, 90, -90}, Edges{-180, 180, 90, -90}, Edges{150, 250, 50, -40},
                          Edges{-60, 70, 30, -80}, Edges{-180, 180, 90, 10}})
        for (const bool obt : {true, false}) {
            INFO(e.left << ".." << e.right << ' ' << e.top << ".." << e.bottom << (obt ? " obt" : " PDS3"));
            const std::string file = written(folder, e, obt);
            for (const double turn : {0.9, 2.7}) {
                scene::Scene plain = sphere_scene(renderer::LambertParameters{0.5}, 0.4, 40, size);
                plain.bodies[0].motion.samples[0].pose.orientation = axis_angle({1, 2, 3}, turn);
                plain.camera.psf_sigma_px = 0;
                scene::Scene mapped = plain;
                mapped.bodies[0].textures.albedo = file;
                // The key is for images that do not say their place.
                mapped.bodies[0].textures.left_longitude_rad = 1;
                compare(plain, mapped, e, [&](double lon, double lat) {
                    return e.contains(lon, lat) ? factor_at(lon, lat) : 1;
                });
            }
        }
}

TEST_CASE("emission textures are where their files say") {
    const TempFolder folder;
    const Edges e{20, 200, 60, -70};
    scene::Scene plain = sphere_scene(renderer::LambertParameters{0}, 0.4, 40, size);
    plain.camera.psf_sigma_px = 0;
    plain.bodies[0].emission_w_m2_sr = {5};
    scene::Scene mapped = plain;
    mapped.bodies[0].textures.emission = written(folder, e, true);
    compare(plain, mapped, e,
            [&](double lon, double lat) { return e.contains(lon, lat) ? factor_at(lon, lat) : 1; });
}

TEST_CASE("a partial map and a key without effect are said, a map in another projection is refused") {
    const TempFolder folder;
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.4, 40, size);
    s.bodies[0].textures.albedo = written(folder, {0, 180, 90, -90}, false);
    s.bodies[0].textures.left_longitude_rad = 1;
    const auto notes = [&] {
        const renderer::Renderer r(s, {1, 1, 1});
        std::string all;
        const renderer::View view = r.view(Time{});
        for (const std::string& line : view.bodies.at(0).notes)
            all += line + "\n";
        return all;
    };
    CHECK_THAT(notes(), ContainsSubstring("a map of 50 % of the body"));
    CHECK_THAT(notes(), ContainsSubstring("placed by its own georeference, not by texture_left_deg"));
    std::string label = [&] {
        std::ifstream in(folder.path() / "map.lbl");
        return std::string(std::istreambuf_iterator<char>(in), {});
    }();
    label.replace(label.find("SIMPLE CYLINDRICAL"), 18, "SINUSOIDAL");
    s.bodies[0].textures.albedo = folder.write("other.lbl", label).string();
    CHECK_THROWS_WITH(renderer::Renderer(s, {1, 1, 1}), ContainsSubstring("SINUSOIDAL"));
}

TEST_CASE("gradients of a placed texture are those of its coordinates") {
    const auto frame =
        terrain::MapFrame::by_edges({}, terrain::Registration::pixel, 100, 80, 0.2, 1.4, 0.9, -0.6);
    const renderer::TexturePlace place(frame);
    for (const Vec3 p : {Vec3{0.7, 0.6, 0.2}, Vec3{0.9, 0.4, -0.3}, Vec3{0.5, 1.2, 0.8}}) {
        Vec3 grad_u, grad_v;
        place.gradients(p, grad_u, grad_v);
        for (const Vec3 d : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
            double u0 = 0, v0 = 0, u1 = 0, v1 = 0;
            REQUIRE(place.coordinates(p - d * 1e-5, u0, v0));
            REQUIRE(place.coordinates(p + d * 1e-5, u1, v1));
            CHECK(std::abs(dot(grad_u, d) - (u1 - u0) / 2e-5) < 1e-6);
            CHECK(std::abs(dot(grad_v, d) - (v1 - v0) / 2e-5) < 1e-6);
        }
    }
    // By areas: 1.2 of 2 pi in longitude, from the sine of -0.6 to that of 0.9.
    CHECK(std::abs(place.share() - 1.2 / (2 * std::numbers::pi) * (std::sin(0.9) + std::sin(0.6)) / 2) <
          0.005);
}

} // namespace placed_textures_test
