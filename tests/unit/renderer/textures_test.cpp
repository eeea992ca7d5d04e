// SPDX-License-Identifier: Apache-2.0
// Textures against plain averages, maps against longitude and latitude, normal maps against cosines.
#include "core/error.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/png.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/textures/texture.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <random>

namespace textures_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::vector<float> noise(std::int32_t width, std::int32_t height, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<float> values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (float& v : values)
        v = static_cast<float>(random() % 1000) / 1000;
    return values;
}

double box_mean(const std::vector<float>& values, int width, int x0, int y0, int nx, int ny) {
    double sum = 0;
    for (int y = y0; y < y0 + ny; ++y)
        for (int x = x0; x < x0 + nx; ++x)
            sum += static_cast<double>(values[static_cast<std::size_t>(y * width + x)]);
    return sum / nx / ny;
}

double sample(const Texture& t, double u, double v, TextureAxis a, TextureAxis b) {
    double out[Texture::max_planes];
    t.sample(u, v, a, b, out);
    return out[0];
}

/// A square of 2 m in the x-y plane that faces +z, with the whole texture on it.
std::string quad() {
    return "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1/1 2/2 3/3 4/4\n";
}

/// That square from above under the Sun at `sun_m`; rendered in radiance.
scene::Scene quad_scene(const TempFolder& folder, const std::string& texture, double pixels_across, int size,
                        Vec3 sun_direction = {0, 0, 1}) {
    scene::Scene s;
    s.bodies.push_back({"plate",
                        renderer::MeshFileParameters{folder.write("quad.obj", quad()).string(), 1, false},
                        renderer::LambertParameters{1},
                        {}});
    s.bodies[0].textures.albedo = texture;
    s.sun.position_m = astronomical_unit_m * normalized(sun_direction);
    s.quantity = scene::Quantity::radiance;
    s.camera = camera_at({0, 0, 1000}, size, 2.0 / 1000 / pixels_across);
    s.camera.motion.samples[0].pose.orientation = look_along({0, 0, -1}, {0, 1, 0});
    s.camera.psf_sigma_px = 0;
    return s;
}

} // namespace

TEST_CASE("A footprint on a block of texels gives the block's mean") {
    const std::vector<float> values = noise(64, 32, 1);
    const Texture t(64, 32, {values}, Texture::Edge::repeat);
    for (const int size : {1, 2, 4, 8, 16, 32})
        for (int y = 0; y < 32; y += size)
            for (int x = 0; x < 64; x += size) {
                const double u = (x + size / 2.0) / 64;
                const double v = (y + size / 2.0) / 32;
                const double got = sample(t, u, v, {size / 64.0, 0}, {0, size / 32.0});
                REQUIRE_THAT(got, WithinAbs(box_mean(values, 64, x, y, size, size), 3e-5));
            }
    // Long ones too, whichever side is the longer, and however they are turned about.
    for (int y = 0; y < 32; y += 4) {
        const double wanted = box_mean(values, 64, 16, y, 32, 4);
        CHECK_THAT(sample(t, 0.5, (y + 2.0) / 32, {0.5, 0}, {0, 4 / 32.0}), WithinAbs(wanted, 3e-5));
        CHECK_THAT(sample(t, 0.5, (y + 2.0) / 32, {0, -4 / 32.0}, {-0.5, 0}), WithinAbs(wanted, 3e-5));
        CHECK_THAT(sample(t, 3.5, (y + 2.0) / 32 - 2, {0.5, 0}, {0, 4 / 32.0}), WithinAbs(wanted, 3e-5));
    }
}

TEST_CASE("Odd sizes keep their mean down to one texel") {
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 1}, {1, 9}, {13, 7}, {100, 3}, {31, 33}}) {
        INFO(width << " x " << height);
        const std::vector<float> values = noise(width, height, 3);
        const Texture t(width, height, {values, values}, Texture::Edge::clamp);
        const double wanted = box_mean(values, width, 0, 0, width, height);
        CHECK_THAT(t.mean(0), WithinAbs(wanted, 2e-5));
        CHECK_THAT(t.mean(1), WithinAbs(wanted, 2e-5));
        CHECK_THAT(sample(t, 0.3, 0.4, {1, 0}, {0, 1}), WithinAbs(wanted, 0.25));
        CHECK_THAT(sample(t, 0.3, 0.4, {1e9, 0}, {0, 1e9}), WithinAbs(wanted, 3e-5));
        CHECK(t.bytes() < 2 * 2 * 2 * static_cast<std::size_t>(width * height) + 64);
    }
    // A constant is exact however it is looked at.
    const Texture flat(5, 3, {std::vector<float>(15, 0.25F)}, Texture::Edge::repeat);
    CHECK(sample(flat, 0.77, -3.1, {0.2, 0.1}, {0, 0.01}) == 0.25);
}

TEST_CASE("Minified textures show their mean in every pixel, from one sample each") {
    const TempFolder folder;
    std::vector<std::uint16_t> checks(256 * 256);
    for (std::size_t i = 0; i < checks.size(); ++i)
        checks[i] = (i % 256 + i / 256) % 2 == 0 ? 60000 : 10000;
    images::write_png16(folder.path() / "checks.png", 256, 256, 16, checks, {});
    scene::Scene s = quad_scene(folder, (folder.path() / "checks.png").string(), 60, 40);
    const renderer::Renderer r(s, {1, 2, 1});
    const double light = renderer::sun_irradiance_w_m2(s.bands[0]) / std::numbers::pi;
    const std::vector<float> image = render_window(r, {0, 0, 40, 40});
    for (const float v : image)
        REQUIRE_THAT(v / light, WithinRel(35000.0 / 65535, 2e-3));
    // From the side the footprint is 20 times as long as wide: it must not blur the other way. Stripes along
    // x stay apart when looked at along x.
    std::vector<std::uint16_t> stripes(256 * 256);
    for (std::size_t i = 0; i < stripes.size(); ++i)
        stripes[i] = i / 256 / 32 % 2 == 0 ? 60000 : 0;
    images::write_png16(folder.path() / "stripes.png", 256, 256, 16, stripes, {});
    s.bodies[0].textures.albedo = (folder.path() / "stripes.png").string();
    const Vec3 from = 1000 * normalized(Vec3{-1, 0, 0.05});
    s.camera = camera_at(from, 40, 2.0 / 1000 / 60);
    s.camera.motion.samples[0].pose.orientation = look_along(-from, {0, 0, 1});
    s.camera.psf_sigma_px = 0;
    const renderer::Renderer side(s, {1, 2, 1});
    const std::vector<float> view = render_window(side, {0, 20, 40, 1});
    const auto [least, most] = std::minmax_element(view.begin(), view.end());
    CHECK(*most / light > 0.85);
    CHECK(*least / light < 0.05);
}

TEST_CASE("Maps lie by longitude and latitude: north up, east to the right, from the left edge on") {
    const TempFolder folder;
    constexpr int width = 360;
    constexpr int height = 180;
    for (const double left_deg : {-180.0, 0.0}) {
        // Linear in latitude and smooth in longitude, so that filtering leaves it alone.
        const auto wanted = [](double lon_deg, double lat_deg) {
            return 0.5 + lat_deg / 360 +
                   0.2 * std::sin(lon_deg * std::numbers::pi / 180) *
                       std::cos(lat_deg * std::numbers::pi / 180);
        };
        std::vector<float> map;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                map.push_back(static_cast<float>(wanted(left_deg + x + 0.5, 89.5 - y)));
        images::write_fits_float(folder.path() / "map.fits", width, height, 1, map, "", {});
        scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.4, 40, 90);
        s.bodies[0].motion.samples[0].pose.orientation = axis_angle({1, 2, 3}, 0.9);
        s.camera.psf_sigma_px = 0;
        const renderer::Renderer white(s, {16, 2, 1});
        s.bodies[0].textures.albedo = (folder.path() / "map.fits").string();
        s.bodies[0].textures.left_longitude_rad = left_deg * std::numbers::pi / 180;
        const renderer::Renderer mapped(s, {16, 2, 1});
        const std::vector<float> a = render_window(white, {0, 0, 90, 90});
        const std::vector<float> b = render_window(mapped, {0, 0, 90, 90});
        const std::vector<RowTime> times(90);
        renderer::RenderRequest request;
        request.window = {0, 0, 90, 90};
        request.rows = 90;
        request.row_times = times;
        std::vector<float> aovs(renderer::aov_count * 90 * 90);
        CHECK(mapped.render_aovs(request, aovs));
        const auto value = [&](Aov id, std::size_t i) {
            return static_cast<double>(aovs[static_cast<std::size_t>(id) * 90 * 90 + i]);
        };
        int compared = 0;
        double worst = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
            if (!(value(Aov::emission_deg, i) < 60 && value(Aov::incidence_deg, i) < 70)) continue;
            const double ratio = static_cast<double>(b[i]) / static_cast<double>(a[i]);
            worst = std::max(
                worst, std::abs(ratio - wanted(value(Aov::longitude_deg, i), value(Aov::latitude_deg, i))));
            ++compared;
        }
        CHECK(compared > 2000);
        CHECK(worst < 0.006);
    }
}

TEST_CASE("Colours of a picture go to the bands by wavelength, planes of a cube one to each") {
    const TempFolder folder;
    std::vector<float> planes(3 * 4, 0.25F);
    std::fill_n(planes.begin() + 4, 4, 0.5F);
    std::fill_n(planes.begin() + 8, 4, 0.75F);
    images::write_fits_float(folder.path() / "cube.fits", 2, 2, 3, planes, "", {});
    scene::Scene s = quad_scene(folder, (folder.path() / "cube.fits").string(), 64, 16);
    s.bands = {{400e-9, 500e-9}, {500e-9, 600e-9}, {600e-9, 700e-9}};
    s.bodies[0].colour = {1, 0.5, 1};
    const renderer::Renderer r(s, {2, 1, 1});
    const std::vector<float> image = render_window(r, {0, 0, 16, 16});
    const std::array<double, 3> wanted{0.25, 0.25, 0.75};
    for (std::size_t b = 0; b < 3; ++b)
        CHECK_THAT(image[(b * 16 + 8) * 16 + 8] * std::numbers::pi /
                       renderer::sun_irradiance_w_m2(s.bands[b]),
                   WithinRel(wanted[b], 1e-4));
    s.bands.pop_back();
    s.bodies[0].colour = {};
    try {
        const renderer::Renderer refused(s, {1, 1, 1});
        FAIL("accepted");
    } catch (const InputError& e) {
        CHECK_THAT(std::string(e.what()),
                   ContainsSubstring(
                       "cube.fits: 3 planes: allowed for body 'plate' are 1, red, green and blue, or one "
                       "for each of the 2 bands"));
    }
}

TEST_CASE("A normal map turns the shading: x along u, y towards the first row, z out") {
    const TempFolder folder;
    // A picture of one colour: x = 0.6, y = 0, z = 0.8, then y.
    for (const bool along_u : {true, false}) {
        std::vector<float> planes(3 * 4);
        std::fill_n(planes.begin(), 4, along_u ? 0.8F : 0.5F);
        std::fill_n(planes.begin() + 4, 4, along_u ? 0.5F : 0.8F);
        std::fill_n(planes.begin() + 8, 4, 0.9F);
        images::write_fits_float(folder.path() / "normal.fits", 2, 2, 3, planes, "", {});
        for (const double slope : {-0.5, 0.0, 0.5}) {
            const Vec3 sun = normalized(along_u ? Vec3{slope, 0, 1} : Vec3{0, slope, 1});
            scene::Scene s = quad_scene(folder, "", 64, 16, sun);
            s.bodies[0].textures.normal = (folder.path() / "normal.fits").string();
            const renderer::Renderer r(s, {64, 1, 1});
            const std::vector<float> image = render_window(r, {0, 0, 16, 16});
            const double cosine = along_u ? 0.6 * sun.x + 0.8 * sun.z : 0.6 * sun.y + 0.8 * sun.z;
            CHECK_THAT(image[8 * 16 + 8] * std::numbers::pi / renderer::sun_irradiance_w_m2(s.bands[0]),
                       WithinRel(cosine, 1e-3));
        }
    }
}

TEST_CASE("Display pictures are decoded; what is no texture is refused with one line") {
    const TempFolder folder;
    const std::vector<std::uint16_t> half(9, 32768);
    images::write_png16(folder.path() / "half.png", 3, 3, 16, half, {});
    CHECK_THAT(read_texture(folder.path() / "half.png", TextureCoding::linear, Texture::Edge::clamp).mean(0),
               WithinRel(0.5, 1e-4));
    CHECK_THAT(read_texture(folder.path() / "half.png", TextureCoding::srgb, Texture::Edge::clamp).mean(0),
               WithinRel(0.21405, 1e-3));
    const auto refusal = [&](const std::filesystem::path& file) {
        try {
            (void)read_texture(file, TextureCoding::linear, Texture::Edge::clamp);
        } catch (const InputError& e) {
            std::string line = e.what();
            CHECK(line.find('\n') == std::string::npos);
            return line.substr(line.find_last_of('/', line.find(':')) + 1);
        }
        return std::string("accepted");
    };
    CHECK(refusal(folder.path() / "gone.png") == "gone.png: cannot be opened: No such file or directory");
    CHECK_THAT(refusal(folder.write("text.png", "hello")),
               ContainsSubstring("text.png: not an image of a supported format"));
    CHECK_THAT(refusal(folder.write("cut.png", "\x89PNG\r\n\x1a\n")),
               ContainsSubstring("cut.png: not readable as PNG"));
    CHECK_THAT(refusal(folder.write("cut.tif", std::string("II*\0\x08\0\0\0", 8))),
               ContainsSubstring("cut.tif: not readable as TIFF"));
    CHECK_THAT(refusal(folder.write("cut.jpg", "\xff\xd8\xff\xe0")),
               ContainsSubstring("cut.jpg: not readable as JPEG"));
    std::vector<float> bad(4, 0.5F);
    bad[2] = std::numeric_limits<float>::quiet_NaN();
    images::write_fits_float(folder.path() / "nan.fits", 2, 2, 1, bad, "", {});
    CHECK(refusal(folder.path() / "nan.fits") ==
          "nan.fits: a value is not a finite number: textures need all");
    images::write_fits_float(folder.path() / "many.fits", 1, 1, 17, std::vector<float>(17, 1), "", {});
    CHECK(refusal(folder.path() / "many.fits") == "many.fits: 17 planes: a texture has at most 16");
}

} // namespace textures_test
