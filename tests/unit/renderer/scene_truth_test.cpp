// SPDX-License-Identifier: Apache-2.0
// The truth table against rendered pixels.
#include "core/camera/scene_truth.hpp"
#include "psf_planes.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace scene_truth_test {

using namespace obscura;
using obscura::test::Image;

namespace {

constexpr std::int32_t size = 1024, spacing = 30;
constexpr double pixel_rad = 1e-4;
constexpr double degree = std::numbers::pi / 180;

/// About one star in each square of the field, none near its edge: more than 1,000 of them.
std::vector<scene::Star> grid_of_stars() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> jitter(-1, 1), magnitude(2, 6);
    std::vector<scene::Star> stars;
    for (int j = 1; j <= size / spacing; ++j)
        for (int i = 1; i <= size / spacing; ++i) {
            const double x = (i * spacing + jitter(random) - size / 2.0) * pixel_rad;
            const double y = (j * spacing + jitter(random) - size / 2.0) * pixel_rad;
            const Vec3 d = normalized(Vec3{1, -x, -y});
            scene::Star star;
            star.right_ascension_rad = std::atan2(d.y, d.x);
            star.declination_rad = std::asin(d.z);
            star.magnitude_v = magnitude(random);
            stars.push_back(star);
        }
    return stars;
}

/// A camera that looks along +x with +z up, and such stars.
scene::Scene star_scene() {
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.camera = test::camera_at({-1, 0, 0}, size, pixel_rad);
    s.camera.psf_sigma_px = 0.7;
    s.stars = grid_of_stars();
    return s;
}

/// Turns the camera about an axis of the inertial frame at 1 deg/s.
void slew(scene::Scene& s, Vec3 axis) {
    const Pose start = s.camera.motion.samples[0].pose;
    s.camera.motion.samples.clear();
    for (int i = -10; i <= 10; ++i) {
        const double t = i * 0.1, half = degree * t / 2;
        const Vec3 n = std::sin(half) * normalized(axis);
        s.camera.motion.samples.push_back(
            {t, {start.position_m, Quat{std::cos(half), n.x, n.y, n.z} * start.orientation}});
    }
}

std::vector<RowTime> global_rows(std::int64_t exposure_ns) {
    return std::vector<RowTime>(size, RowTime{Time{-exposure_ns / 2}, Time{exposure_ns / 2}});
}

std::vector<RowTime> rolling_rows(std::int64_t exposure_ns, std::int64_t row_ns) {
    std::vector<RowTime> rows;
    for (std::int32_t y = 0; y < size; ++y) {
        const std::int64_t reset = (y - size / 2) * row_ns - exposure_ns / 2;
        rows.push_back({Time{reset}, Time{reset + exposure_ns}});
    }
    return rows;
}

FrameWindow whole() {
    FrameWindow window;
    window.sensor = {0, 0, size, size};
    return window;
}

Image render_rows(const renderer::Renderer& r, const std::vector<RowTime>& rows) {
    Image image{size, size, std::vector<float>(static_cast<std::size_t>(size) * size)};
    renderer::RenderRequest request;
    request.window = {0, 0, size, size};
    request.rows = size;
    request.row_times = rows;
    r.render(request, image.values);
    return image;
}

SceneTruth truth_of(const renderer::Renderer& r, const std::vector<RowTime>& rows,
                    const renderer::TruthDetector& detector = {}) {
    const FrameWindow window = whole();
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    request.detector = detector;
    SceneTruth truth;
    r.list_truth(request, truth);
    return truth;
}

struct Blob {
    double x = 0, y = 0, sum = 0, peak = 0;
};

/// Light within half a square of the grid around a point.
Blob blob_at(const Image& image, double x, double y) {
    Blob blob;
    for (std::int32_t j = -14; j <= 14; ++j)
        for (std::int32_t i = -14; i <= 14; ++i) {
            const auto column = static_cast<std::int32_t>(std::lround(x)) + i;
            const auto row = static_cast<std::int32_t>(std::lround(y)) + j;
            if (column < 0 || row < 0 || column >= image.width || row >= image.height) continue;
            const auto value = static_cast<double>(image.at(column, row));
            blob.sum += value, blob.x += value * column, blob.y += value * row;
            blob.peak = std::max(blob.peak, value);
        }
    blob.x /= blob.sum, blob.y /= blob.sum;
    return blob;
}

struct Worst {
    double px = 0, share = 0, peak = 0;
    int stars = 0;
};

/// Compares centroids, light and brightest pixels of rendered stars with the table.
void compare(const scene::Scene& scene, const std::vector<RowTime>& rows) {
    const renderer::Renderer r(scene, {});
    const Image image = render_rows(r, rows);
    Worst worst;
    // A detector that counts the light in the pixels.
    renderer::TruthDetector detector;
    const std::vector<double> response{1 / std::max(1e-9, to_seconds(rows[0].exposure_ns()))};
    detector.electrons_per_s_per_w_m2 = response;
    detector.saturation_e = 1;
    for (const TruthEntry& e : truth_of(r, rows, detector).entries) {
        if (e.kind != TruthKind::star) continue;
        constexpr double margin = 15;
        if (e.x_px < margin || e.y_px < margin || e.x_px > size - margin || e.y_px > size - margin) continue;
        const Blob blob = blob_at(image, e.x_px, e.y_px);
        worst.px = std::max({worst.px, std::abs(blob.x - e.x_px), std::abs(blob.y - e.y_px)});
        worst.share = std::max(worst.share, std::abs(blob.sum / e.signal_e - 1));
        worst.peak = std::max(worst.peak, std::abs(blob.peak / e.peak_e - 1));
        ++worst.stars;
    }
    INFO("worst: " << worst.px << " px, light " << worst.share << ", peak " << worst.peak);
    CHECK(worst.stars > 1000);
    CHECK(worst.px < 2e-4);
    CHECK(worst.share < 1e-4);
    CHECK(worst.peak < 0.05);
}

} // namespace

TEST_CASE("stars of a camera at rest are where the truth table says", "[renderer][truth]") {
    compare(star_scene(), global_rows(50'000'000));
}

TEST_CASE("stars of a slewing camera are where the truth table says", "[renderer][truth]") {
    scene::Scene s = star_scene();
    slew(s, {0.3, 1, 0.5});
    compare(s, global_rows(50'000'000));
    compare(s, global_rows(2'000'000));
}

TEST_CASE("stars under a rolling shutter are where the truth table says", "[renderer][truth]") {
    for (const Vec3 axis : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{1, 0, 1}}) {
        scene::Scene s = star_scene();
        slew(s, axis);
        compare(s, rolling_rows(10'000'000, 20'000));
        compare(s, rolling_rows(2, 100'000));
    }
}

TEST_CASE("stars behind a distorted, turned and moving lens are where the truth table says",
          "[renderer][truth]") {
    scene::Scene s = star_scene();
    s.camera.distortion.model = scene::Distortion::Model::brown_conrady;
    s.camera.distortion.coefficients = {-0.5, 2, 0, 0.01, -0.02};
    s.camera.principal_offset_px = {3.3, -2.2};
    s.camera.sensor_rotation_rad = 0.01;
    s.camera.pupil_cosine = true;
    s.aberration = true;
    s.camera.velocity_m_s = {0, 30e3, 20e3};
    slew(s, {0.2, 1, -0.4});
    compare(s, rolling_rows(10'000'000, 20'000));
}

TEST_CASE("stars of an asymmetric point spread function are where the truth table says",
          "[renderer][truth]") {
    scene::Scene s = star_scene();
    // A Gaussian with a fainter one beside it, farther out towards the right edge of the field.
    const test::TempFolder folder;
    std::vector<test::Plane> planes;
    for (const double x : {0.0, size - 1.0}) {
        test::Plane plane;
        plane.side = 65, plane.oversampling = 4, plane.x = x, plane.y = size / 2.0;
        const double away = x > 0 ? 2.5 : 1.0;
        for (int j = 0; j < plane.side; ++j)
            for (int i = 0; i < plane.side; ++i) {
                const double u = (i - 32) / 4.0, v = (j - 32) / 4.0;
                const auto gauss = [&](double du, double dv, double sigma) {
                    return std::exp(-((u - du) * (u - du) + (v - dv) * (v - dv)) / (2 * sigma * sigma)) /
                           (sigma * sigma);
                };
                plane.values.push_back(gauss(0, 0, 0.7) + 0.3 * gauss(away, 0.5, 0.9));
            }
        planes.push_back(plane);
    }
    s.camera.psf.model = scene::PointSpread::Model::table;
    s.camera.psf.file = test::write_fits(folder, "coma.fits", planes);
    s.camera.psf.core_px = 9;
    compare(s, global_rows(50'000'000));
    slew(s, {0.3, 1, 0.5});
    compare(s, global_rows(30'000'000));
    // The shift itself is in the table.
    const renderer::Renderer r(s, {});
    for (const TruthEntry& e : truth_of(r, global_rows(0)).entries)
        if (e.x_px > size - 100) {
            CHECK(e.psf_x_px > 0.4);
            CHECK(e.psf_y_px > 0.08);
        }
}

TEST_CASE("a streak has the light of a star at rest at any rate", "[renderer][truth]") {
    scene::Scene s = star_scene();
    s.camera.psf_sigma_px = 0.5;
    // One star in the middle: it stays in the field.
    s.stars = {scene::Star{0, 0, 2}};
    const renderer::Renderer still(s, {});
    const double light = render_rows(still, global_rows(0)).sum();
    for (const double pixels : {0.3, 3.0, 40.0, 140.0, 700.0, 900.0}) {
        scene::Scene moving = s;
        slew(moving, {0, 0.7, 0.7});
        const auto exposure_ns = std::llround(pixels * pixel_rad / degree * 1e9);
        const renderer::Renderer r(moving, {});
        CHECK_THAT(render_rows(r, global_rows(exposure_ns)).sum() / light,
                   Catch::Matchers::WithinAbs(1, 1e-3));
        // Rolling, across the rows: each row sees the whole passage of the star.
        if (pixels > 40) continue;
        const double rolled = render_rows(r, rolling_rows(exposure_ns, 20'000)).sum() / light;
        renderer::TruthDetector detector;
        const std::vector<double> response{1};
        detector.electrons_per_s_per_w_m2 = response;
        const SceneTruth truth = truth_of(r, rolling_rows(exposure_ns, 20'000), detector);
        REQUIRE(truth.entries.size() == 1);
        CHECK_THAT(rolled,
                   Catch::Matchers::WithinAbs(truth.entries[0].signal_e / truth.entries[0].irradiance_w_m2 /
                                                  to_seconds(exposure_ns),
                                              1e-3));
    }
}

TEST_CASE("a limb fitted to a rendered sphere is where the truth table says", "[renderer][truth]") {
    for (const bool moves : {false, true}) {
        scene::Scene s = star_scene();
        s.stars.clear();
        // A disc of uniform radiance, so that its outline follows from its light.
        scene::Body ball;
        ball.name = "ball";
        ball.shape = renderer::EllipsoidParameters{{500, 500, 400}};
        ball.material = renderer::LambertParameters{0.1};
        ball.emission_w_m2_sr = {1};
        ball.motion.samples[0].pose.position_m = {1e5, 300, -200};
        s.bodies.push_back(ball);
        if (moves) slew(s, {0, 1, 0.3});
        renderer::RenderSettings settings;
        settings.samples_per_pixel = 256;
        const renderer::Renderer r(s, settings);
        const std::vector<RowTime> rows = moves ? rolling_rows(0, 40'000) : global_rows(0);
        const Image image = render_rows(r, rows);
        double sum = 0, x = 0, y = 0, xx = 0, yy = 0;
        for (std::int32_t j = 0; j < size; ++j)
            for (std::int32_t i = 0; i < size; ++i) {
                const auto v = static_cast<double>(image.at(i, j));
                sum += v, x += v * i, y += v * j;
            }
        x /= sum, y /= sum;
        for (std::int32_t j = 0; j < size; ++j)
            for (std::int32_t i = 0; i < size; ++i) {
                const auto v = static_cast<double>(image.at(i, j));
                xx += v * (i - x) * (i - x), yy += v * (j - y) * (j - y);
            }
        // Pixels and PSF widen the disc.
        const double wide = 1.0 / 12 + 0.7 * 0.7;
        const double half_x = 2 * std::sqrt(xx / sum - wide), half_y = 2 * std::sqrt(yy / sum - wide);

        // The polygon of the truth, moments by Green's theorem.
        const SceneTruth truth = truth_of(r, rows);
        std::vector<TruthEntry> limb;
        for (const TruthEntry& e : truth.entries)
            if (e.kind == TruthKind::limb) limb.push_back(e);
        REQUIRE(limb.size() == 72);
        double tx = 0, ty = 0, txx = 0, tyy = 0;
        for (const TruthEntry& e : limb)
            tx += e.x_px / 72, ty += e.y_px / 72;
        for (const TruthEntry& e : limb)
            txx += (e.x_px - tx) * (e.x_px - tx) / 72, tyy += (e.y_px - ty) * (e.y_px - ty) / 72;
        INFO("moves " << moves << ": half axes " << half_x << " " << half_y);
        CHECK_THAT(tx, Catch::Matchers::WithinAbs(x, 0.01));
        CHECK_THAT(ty, Catch::Matchers::WithinAbs(y, 0.01));
        CHECK_THAT(std::sqrt(2 * txx), Catch::Matchers::WithinAbs(half_x, 0.01));
        CHECK_THAT(std::sqrt(2 * tyy), Catch::Matchers::WithinAbs(half_y, 0.01));
    }
}

namespace {

/// A scene of one body of `shape` ten kilometres in front of the camera, sunlit from the left, and landmarks.
std::string landmark_scene(const std::string& shape, const std::string& landmarks) {
    return "[sun]\ndirection = [0, 1, 0]\n"
           "[camera]\nwidth = 200\nheight = 200\nfocal_length_mm = 100\npixel_pitch_um = 10\n"
           "boresight = [1, 0, 0]\nup = [0, 0, 1]\n"
           "[[body]]\nname = \"moon\"\n" +
           shape + "albedo = 0.1\nposition_m = [10000, 0, 0]\n" + landmarks;
}

std::vector<TruthEntry> landmarks_of(const std::string& text) {
    const scene::Scene s = scene::parse_scene(text, "scene.toml");
    return test::truth_entries(renderer::Renderer(s, {}), TruthKind::landmark, 200);
}

std::string landmark(const std::string& name, const std::string& place) {
    return "[[landmark]]\nname = \"" + name + "\"\nbody = \"moon\"\n" + place + "\n";
}

} // namespace

TEST_CASE("light of bodies and landmarks in the truth table is that of the pixels", "[renderer][truth]") {
    // A resolved ball with a map, one below a pixel, one half outside of the picture and one half hidden.
    const test::TempFolder folder;
    for (const std::uint32_t bounces : {0u, 1u}) {
        scene::Scene s = test::sphere_scene(renderer::LommelSeeligerParameters{0.4}, 0.7, 30, 256);
        s.max_bounces = bounces;
        s.camera.psf_sigma_px = 0.5;
        if (bounces > 0) s.bands = {{400e-9, 550e-9}, {550e-9, 800e-9}};
        const Pose camera = s.camera.motion.samples[0].pose;
        const double px_m = 500.0 / 30; // at the distance of the ball
        const auto add = [&](const std::string& name, double radius_m, Vec3 place_px, double before_m) {
            scene::Body body{name,
                             renderer::EllipsoidParameters{{radius_m, radius_m, 0.8 * radius_m}},
                             renderer::LambertParameters{0.3},
                             {}};
            body.motion.samples[0].pose.position_m =
                rotate(camera.orientation, place_px * px_m - Vec3{0, 0, before_m});
            s.bodies.push_back(body);
        };
        add("dot", 8, {70, 40, 0}, 0);
        add("edge", 300, {128, -70, 0}, 0);
        add("behind", 250, {-35, 0, 0}, -3000);
        s.landmarks.resize(1);
        s.landmarks[0].name = "spot";
        s.landmarks[0].body = "ball";
        s.landmarks[0].position_m = rotate(conjugate(Quat{}), normalized(Vec3{-0.9, 0.3, 0.2})) * 500.0;
        renderer::RenderSettings settings;
        settings.samples_per_pixel = 64;
        const renderer::Renderer r(s, settings);
        const std::vector<RowTime> rows(256, RowTime{Time{-5'000'000}, Time{5'000'000}});
        FrameWindow window;
        window.sensor = {0, 0, 256, 256};
        renderer::TruthRequest request;
        request.windows = {&window, 1};
        request.rows = rows;
        const std::vector<double> response(s.bands.size(), 1e18);
        request.detector.electrons_per_s_per_w_m2 = response;
        request.detector.saturation_e = 1e9;
        SceneTruth truth;
        r.list_truth(request, truth);
        const std::vector<float> planes = test::render_window(r, {0, 0, 256, 256}, 256);
        const auto pixel = [&](int x, int y) {
            double sum = 0;
            for (std::size_t b = 0; b < s.bands.size(); ++b)
                sum += static_cast<double>(
                    planes[(b * 256 + static_cast<std::size_t>(y)) * 256 + static_cast<std::size_t>(x)]);
            return sum;
        };
        const auto light_about = [&](double x, double y, int half) {
            double sum = 0;
            for (int j = std::max(0, int(y) - half); j <= std::min(255, int(y) + half); ++j)
                for (int i = std::max(0, int(x) - half); i <= std::min(255, int(x) + half); ++i)
                    sum += pixel(i, j);
            return sum;
        };
        int checked = 0;
        double others = 0;
        for (const TruthEntry& e : truth.entries) {
            if (e.kind == TruthKind::body && e.object < 4) {
                CAPTURE(std::string(e.name.view()), bounces, e.irradiance_w_m2);
                CHECK(std::abs(e.signal_e / (e.irradiance_w_m2 * 1e18 * 0.01) - 1) < 1e-9);
                ++checked;
                if (e.name.view() == "dot")
                    CHECK(std::abs(e.irradiance_w_m2 / light_about(e.x_px, e.y_px, 12) - 1) < 0.01);
                else if (e.name.view() == "edge")
                    CHECK(std::abs(e.irradiance_w_m2 / light_about(e.x_px, e.y_px, 24) - 1) < 0.01);
                else
                    others += e.irradiance_w_m2;
            }
            if (e.kind == TruthKind::landmark) {
                ++checked;
                const int x = static_cast<int>(std::lround(e.x_px)),
                          y = static_cast<int>(std::lround(e.y_px));
                CHECK(std::abs(e.irradiance_w_m2 / (light_about(x, y, 1) / 9) - 1) < 0.02);
                CHECK(std::abs(e.peak_e / (e.irradiance_w_m2 * 1e18 * 0.01) - 1) < 1e-9);
            }
        }
        CHECK(checked == 5);
        // The ball and what it hides in part.
        CHECK(std::abs(others / light_about(115, 127, 48) - 1) < 0.01);
    }
}

TEST_CASE("the terminator of a mesh is that of the ellipsoid which it follows", "[renderer][truth]") {
    scene::Scene s = test::sphere_scene(renderer::LambertParameters{0.3}, 1.2, 100, 512);
    const std::vector<RowTime> rows(512, RowTime{Time{-5}, Time{5}});
    FrameWindow window;
    window.sensor = {0, 0, 512, 512};
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    const auto curve = [&](const scene::Scene& scene) {
        SceneTruth truth;
        renderer::Renderer(scene, {}).list_truth(request, truth);
        std::vector<std::array<double, 2>> points;
        for (const TruthEntry& e : truth.entries)
            if (e.kind == TruthKind::terminator) points.push_back({e.x_px, e.y_px});
        return points;
    };
    const auto exact = curve(s);
    CHECK(exact.size() > 30);
    const renderer::TriangleMesh sphere = renderer::make_icosphere(6);
    std::string obj;
    for (const auto& v : sphere.vertices)
        obj += fmt::format("v {:.9g} {:.9g} {:.9g}\n", 500 * v.x, 500 * v.y, 500 * v.z);
    for (const auto& t : sphere.triangles)
        obj += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    const test::TempFolder folder;
    s.bodies[0].shape = renderer::MeshFileParameters{.path = folder.write("sphere.obj", obj).string()};
    const auto found = curve(s);
    CHECK(found.size() > 30);
    // The outline that the Sun sees of flat facets is up to a facet, 1 degree, away from that of the sphere.
    double worst = 0;
    for (const auto& p : found) {
        if (std::hypot(p[0] - 255.5, p[1] - 255.5) > 97) continue; // past the last exact point, at the limb
        double nearest = 1e9;
        for (std::size_t i = 0; i + 1 < exact.size(); ++i)
            for (double part = 0; part <= 1; part += 0.05)
                nearest = std::min(nearest,
                                   std::hypot(p[0] - exact[i][0] - part * (exact[i + 1][0] - exact[i][0]),
                                              p[1] - exact[i][1] - part * (exact[i + 1][1] - exact[i][1])));
        worst = std::max(worst, nearest);
    }
    CAPTURE(worst);
    CHECK(worst < 2);
}

TEST_CASE("landmarks are points of the surface, hidden on the far side and dark on the night side",
          "[renderer][truth]") {
    const std::string shape = GENERATE(std::string("shape = \"ellipsoid\"\nradii_m = [50, 40, 30]\n"),
                                       std::string("shape = \"box\"\nsize_m = [100, 80, 60]\n"));
    const std::vector<TruthEntry> found =
        landmarks_of(landmark_scene(shape, landmark("near", "longitude_deg = 180\nlatitude_deg = 0") +
                                               landmark("east", "longitude_deg = 135\nlatitude_deg = 0") +
                                               landmark("night", "longitude_deg = -135\nlatitude_deg = 0") +
                                               landmark("far", "longitude_deg = 0\nlatitude_deg = 0") +
                                               landmark("point", "position_m = [-50, 0, 0]")));
    REQUIRE(found.size() == 5);
    CHECK(found[1].name.view() == "east");
    CHECK(found[1].item == 1);
    // The camera looks along +x: its x axis is -y of the scene, y is -z; focal length 10,000 px.
    CHECK_THAT(found[0].x_px, Catch::Matchers::WithinAbs(99.5, 1e-9));
    CHECK_THAT(found[0].range_m, Catch::Matchers::WithinAbs(9950, 1e-6));
    const bool box = shape.find("box") != std::string::npos;
    // Where the line at 45 degrees leaves the ellipsoid, or the side of the box.
    const double r = box ? 40 : 1 / std::sqrt(1 / 2500.0 + 1 / 1600.0);
    CHECK_THAT(found[1].x_px, Catch::Matchers::WithinAbs(99.5 - 1e4 * r / (1e4 - r), 1e-6));
    CHECK_THAT(found[2].x_px, Catch::Matchers::WithinAbs(99.5 + 1e4 * r / (1e4 - r), 1e-6));
    CHECK_THAT(found[1].y_px, Catch::Matchers::WithinAbs(99.5, 1e-9));
    // The side of the box at 45 degrees faces away from the camera by perspective.
    const TruthVisibility side = box ? TruthVisibility::hidden : TruthVisibility::visible;
    CHECK(found[0].visibility == TruthVisibility::visible);
    CHECK(found[1].visibility == side);
    CHECK(found[2].visibility == side);
    CHECK(found[3].visibility == TruthVisibility::hidden);
    CHECK(found[1].lit);
    CHECK_FALSE(found[2].lit);
    CHECK_THAT(found[4].x_px, Catch::Matchers::WithinAbs(found[0].x_px, 1e-9));
    CHECK(found[4].visibility == TruthVisibility::visible);
}

TEST_CASE("landmarks outside the frame are listed as such", "[renderer][truth]") {
    const std::vector<TruthEntry> found = landmarks_of(landmark_scene(
        "shape = \"ellipsoid\"\nradii_m = [50, 400, 30]\n", landmark("out", "position_m = [0, 399.999, 0]")));
    REQUIRE(found.size() == 1);
    CHECK(found[0].visibility == TruthVisibility::outside);
    CHECK_THAT(found[0].range_m, Catch::Matchers::WithinAbs(std::hypot(1e4, 399.999), 1e-6));
}

TEST_CASE("mistakes of landmarks are reported at their place", "[renderer][truth]") {
    const std::string ball = "shape = \"ellipsoid\"\nradii_m = [50, 50, 50]\n";
    const auto refused = [&](const std::string& shape, const std::string& text, const std::string& message) {
        CHECK_THROWS_WITH(landmarks_of(landmark_scene(shape, text)),
                          Catch::Matchers::ContainsSubstring(message));
    };
    refused(ball, landmark("a", "longitude_deg = 1"),
            "scene.toml:16:1: landmark[0]: longitude_deg and latitude_deg are wanted, or position_m");
    refused(ball, landmark("a", "position_m = [0, 0, 1]\nlatitude_deg = 1"), "position_m");
    refused(ball, "[[landmark]]\nname = \"a\"\nbody = \"mon\"\nposition_m = [0, 0, 1]\n",
            "landmark[0].body: \"mon\" is not the name of a body");
    // A disc has no surface beside its plane.
    refused("shape = \"disc\"\nradius_m = 50\n", landmark("a", "longitude_deg = 0\nlatitude_deg = 0"),
            "scene.toml:16:1: landmark 'a': body 'moon' has no surface at that longitude and latitude");
}

TEST_CASE("a truth table with room for few entries keeps bodies and counts the rest", "[renderer][truth]") {
    scene::Scene s = star_scene();
    scene::Body ball;
    ball.name = "ball";
    ball.shape = renderer::EllipsoidParameters{{500, 500, 400}};
    ball.material = renderer::LambertParameters{0.1};
    ball.motion.samples[0].pose.position_m = {1e5, 300, -200};
    s.bodies.push_back(ball);
    const renderer::Renderer r(s, {});
    const FrameWindow window = whole();
    const std::vector<RowTime> rows = global_rows(1'000'000);
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    SceneTruth all, few;
    r.list_truth(request, all);
    request.max_entries = 10;
    std::vector<std::byte> workspace(100'000);
    request.workspace = workspace;
    r.list_truth(request, few);
    REQUIRE(few.entries.size() == 10);
    CHECK(few.entries.size() + few.entries_left_out == all.entries.size());
    CHECK(few.entries[0].name.view() == "ball");
    for (std::size_t i = 0; i < few.entries.size(); ++i)
        CHECK((few.entries[i].kind == all.entries[i].kind && few.entries[i].object == all.entries[i].object));
    // Another list in the same memory starts anew.
    request.max_entries = 0;
    r.list_truth(request, few);
    CHECK(few.entries.size() == all.entries.size());
    CHECK(few.entries_left_out == 0);
}

} // namespace scene_truth_test
