// SPDX-License-Identifier: Apache-2.0
// Emission maps: light of volcanoes and cities against sums over their texels, on the night side too.
#include "core/error.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace emission_textures_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double deg = pi / 180;

/// A map of the whole body in steps of 1 degree, left edge at -180 degrees, of `value` (0 to 1) at longitude
/// and latitude in degrees.
std::string map_of(const TempFolder& folder, const std::function<double(double, double)>& value) {
    std::vector<std::uint16_t> texels;
    for (int row = 0; row < 180; ++row)
        for (int column = 0; column < 360; ++column)
            texels.push_back(
                static_cast<std::uint16_t>(std::lround(65535 * value(column - 179.5, 89.5 - row))));
    images::write_png16(folder.path() / "map.png", 360, 180, 16, texels, {});
    return (folder.path() / "map.png").string();
}

/// A dark ball of radius 500 m, `radius_px` pixels in radius, that shines with 10 W m-2 sr-1 times the map;
/// seen from +x from far away, the Sun behind it.
scene::Scene glowing_ball(const std::string& map, double radius_px) {
    scene::Scene s;
    s.bodies.push_back(
        {"ball", renderer::EllipsoidParameters{{500, 500, 500}}, renderer::LambertParameters{0.1}, {}});
    s.bodies[0].emission_w_m2_sr = {10};
    s.bodies[0].textures.emission = map;
    s.sun.position_m = astronomical_unit_m * normalized(Vec3{-1, 0.3, 0});
    s.camera = camera_at({5e6, 0, 0}, 128, 1e-4 / radius_px);
    return s;
}

/// The sunlit crescent of the ball, without the emission.
double crescent(scene::Scene s) {
    s.bodies[0].emission_w_m2_sr.clear();
    s.bodies[0].textures.emission.clear();
    return render(renderer::Renderer(s, {64, 2, 7})).sum();
}

/// Irradiance from the ball's own light: sum over the texels of radiance, area and cosine, over the distance.
double wanted_w_m2(const std::function<double(double, double)>& value) {
    double sum = 0;
    for (double latitude = -89.5; latitude < 90; ++latitude)
        for (double longitude = -89.5; longitude < 90; ++longitude)
            sum += 10 * value(longitude, latitude) * deg * deg * std::pow(std::cos(latitude * deg), 2) *
                   std::cos(longitude * deg);
    return sum * 1e-8; // (500 m / 5000 km)^2
}

} // namespace

TEST_CASE("The light of an emission map is the sum over its texels, resolved or smaller than a pixel") {
    const TempFolder folder;
    // A lit half, a smooth map, one city of 6 by 4 degrees away from the middle.
    const std::vector<std::function<double(double, double)>> maps{
        [](double longitude, double) { return longitude > 0 ? 1.0 : 0.0; },
        [](double longitude, double latitude) {
            return 0.5 + 0.3 * std::cos(3 * longitude * deg) * std::sin(2 * latitude * deg) +
                   0.2 * std::sin(longitude * deg);
        },
        [](double longitude, double latitude) {
            return std::abs(longitude - 40) < 3 && std::abs(latitude - 30) < 2 ? 1.0 : 0.0;
        },
    };
    for (const auto& value : maps)
        for (const double radius_px : {0.2, 5.0, 50.0}) {
            INFO("map " << &value - maps.data() << ", radius " << radius_px << " px");
            const scene::Scene s = glowing_ball(map_of(folder, value), radius_px);
            const double light = 1e9 * render(renderer::Renderer(s, {64, 2, 7})).sum() - 1e9 * crescent(s);
            // What rays see of a city below a pixel is chance: a standard deviation of about 8 %.
            const double allowed = &value != &maps[2] ? 5e-3 : radius_px > 10 ? 0.03 : 0.25;
            CHECK_THAT(light, WithinRel(1e9 * wanted_w_m2(value), allowed));
        }
}

TEST_CASE("A city shines on the night side where it is, with its radiance, and its back does not") {
    const TempFolder folder;
    const auto city = [](double longitude, double latitude) {
        return std::abs(longitude - 30) < 6 && std::abs(latitude - 20) < 6 ? 0.5 : 0.0;
    };
    scene::Scene s = glowing_ball(map_of(folder, city), 50);
    s.quantity = scene::Quantity::radiance;
    s.camera.psf_sigma_px = 0;
    const Image image = render(renderer::Renderer(s, {16, 2, 7}));
    // x to the right is east, +y; the pixel of longitude and latitude.
    const auto at = [&](double longitude, double latitude) {
        const double right = 50 * std::cos(latitude * deg) * std::sin(longitude * deg);
        const double up = 50 * std::sin(latitude * deg);
        return image.at(static_cast<int>(std::lround(63.5 + right)),
                        static_cast<int>(std::lround(63.5 - up)));
    };
    CHECK_THAT(at(30, 20), WithinRel(5.0F, 1e-3F));
    CHECK_THAT(at(27, 17), WithinRel(5.0F, 1e-3F));
    CHECK(at(-30, 20) == 0);
    CHECK(at(30, -20) == 0);
    CHECK(at(10, 20) == 0);
    // From behind the city is not seen.
    s.camera.motion.samples[0].pose.position_m.x *= -1;
    s.camera.motion.samples[0].pose.orientation = look_along({1, 0, 0}, {0, 0, 1});
    s.sun.irradiance_scale = 0;
    CHECK(render(renderer::Renderer(s, {16, 2, 7})).sum() == 0);
}

TEST_CASE("An emission map gives each band its own light, and leaves the reflectance alone") {
    const TempFolder folder;
    std::vector<float> planes(2 * 8);
    for (std::size_t i = 0; i < 8; ++i) {
        planes[i] = 0.25F;
        planes[8 + i] = 3;
    }
    images::write_fits_float(folder.path() / "two.fits", 4, 2, 2, planes, "", {});
    scene::Scene s = glowing_ball((folder.path() / "two.fits").string(), 50);
    s.bands = {{400e-9, 500e-9}, {500e-9, 600e-9}};
    s.bodies[0].emission_w_m2_sr = {10, 20};
    s.quantity = scene::Quantity::radiance;
    s.sun.position_m = astronomical_unit_m * Vec3{1, 0, 0};
    const auto middle = [](const scene::Scene& scene) {
        const std::vector<float> all = render_window(renderer::Renderer(scene, {64, 2, 7}), {0, 0, 128, 128});
        return std::pair{all[64 * 128 + 64], all[128 * 128 + 64 * 128 + 64]};
    };
    const auto [blue, green] = middle(s);
    s.bodies[0].emission_w_m2_sr.clear();
    s.bodies[0].textures.emission.clear();
    const auto [sunlit_blue, sunlit_green] = middle(s);
    CHECK_THAT(blue - sunlit_blue, WithinRel(2.5F, 2e-3F));
    CHECK_THAT(green - sunlit_green, WithinRel(60.0F, 2e-3F));
}

TEST_CASE("An emission map lies on a mesh by its texture coordinates, and lights as much as it shines") {
    const TempFolder folder;
    const std::vector<std::uint16_t> halves{0, 0, 0, 0, 65535, 65535, 65535, 65535};
    images::write_png16(folder.path() / "halves.png", 8, 1, 16, halves, {});
    const std::string quad = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
                             "f 1/1 2/2 3/3 4/4\n";
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.quantity = scene::Quantity::radiance;
    s.bodies.push_back({"plate",
                        renderer::MeshFileParameters{folder.write("quad.obj", quad).string(), 1, false},
                        renderer::LambertParameters{0.5},
                        {}});
    s.bodies[0].emission_w_m2_sr = {4};
    s.bodies[0].textures.emission = (folder.path() / "halves.png").string();
    s.camera = camera_at({0, 0, 1000}, 16, 2.0 / 1000 / 16);
    s.camera.motion.samples[0].pose.orientation = look_along({0, 0, -1}, {0, 1, 0});
    s.camera.psf_sigma_px = 0;
    const Image image = render(renderer::Renderer(s, {4, 2, 7}));
    CHECK(image.at(3, 8) == 0);
    CHECK_THAT(image.at(12, 8), WithinRel(4.0F, 1e-3F));
    // A closed room: with the emission halved everywhere, half as bright after any number of bounces.
    s.bodies[0].shape = inward_cube();
    s.camera = camera_at({0.3, -0.2, 0.1}, 8, 0.02);
    s.camera.psf_sigma_px = 0;
    images::write_png16(folder.path() / "half.png", 1, 1, 16, std::vector<std::uint16_t>{32768}, {});
    s.bodies[0].textures.emission = (folder.path() / "half.png").string();
    renderer::RenderSettings settings;
    settings.samples_per_pixel = 256;
    settings.max_bounces = 30;
    CHECK_THAT(render(renderer::Renderer(s, settings)).sum() / 64, WithinRel(2.0 / (1 - 0.5), 5e-3));
}

TEST_CASE("An emission map without an emission is refused, and so is one of a wrong number of planes") {
    const TempFolder folder;
    const std::string map = map_of(folder, [](double, double) { return 1.0; });
    scene::Scene s = glowing_ball(map, 50);
    s.bodies[0].emission_w_m2_sr.clear();
    const auto refusal = [](const auto& make) -> std::string {
        try {
            make();
        } catch (const Error& e) {
            return e.what();
        }
        return "accepted";
    };
    const auto rendered = [&] { const renderer::Renderer r(s, {}); };
    CHECK_THAT(refusal(rendered), ContainsSubstring("body 'ball': an emission texture is a factor on the "
                                                    "emission, which is missing"));
    s.bodies[0].emission_w_m2_sr = {1};
    images::write_fits_float(folder.path() / "two.fits", 1, 1, 2, std::vector<float>{1, 1}, "", {});
    s.bodies[0].textures.emission = (folder.path() / "two.fits").string();
    CHECK_THAT(refusal(rendered), ContainsSubstring("two.fits: 2 planes: allowed for body 'ball' are 1"));
    const std::string ball = "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.1\n";
    CHECK_THAT(refusal([&] {
                   (void)scene::load_scene(folder.write("s.toml", ball + "emission_texture = \"map.png\"\n"));
               }),
               ContainsSubstring("s.toml:5:20: body[0].emission_texture: a factor on \"emission_w_m2_sr\""));
    const scene::Scene read = scene::load_scene(
        folder.write("s.toml", ball + "emission_w_m2_sr = [2]\nemission_texture = \"map.png\"\n"));
    CHECK(read.bodies[0].textures.emission == map);
}

} // namespace emission_textures_test
