// SPDX-License-Identifier: Apache-2.0
// The same bytes whatever the threads, bands or window; cancelling; counters; ground truth.
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <string>

namespace determinism_test {

using namespace obscura;
using namespace obscura::test;

namespace {

scene::Scene busy_scene() {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 40, 150);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 3, 4};
    s.bodies.push_back(
        {"moon", renderer::EllipsoidParameters{{40, 30, 50}}, renderer::LambertParameters{0.4}, {}});
    s.bodies[1].motion.samples[0].pose.position_m = {-700, 300, 200};
    s.bodies.push_back(
        {"speck", renderer::EllipsoidParameters{{4, 4, 4}}, renderer::LambertParameters{0.4}, {}});
    s.bodies[2].motion.samples[0].pose.position_m = {-300, 600, 500};
    s.bands.push_back({500e-9, 600e-9});
    for (int i = 0; i < 200; ++i)
        s.stars.push_back({i * 0.03, -0.1 + i * 0.001, 3.0 + i * 0.01, 0.5});
    return s;
}

std::vector<float> whole(const renderer::Renderer& r, std::int32_t band_rows) {
    return render_window(r, {0, 0, 150, 150}, band_rows);
}

} // namespace

TEST_CASE("Threads and bands change no byte") {
    const scene::Scene s = busy_scene();
    const std::vector<float> one = whole(renderer::Renderer(s, {3, 1, 11}), 150);
    CHECK(one == whole(renderer::Renderer(s, {3, 2, 11}), 64));
    CHECK(one == whole(renderer::Renderer(s, {3, 7, 11}), 7));
    CHECK(one != whole(renderer::Renderer(s, {3, 1, 12}), 150));
}

TEST_CASE("A window is the crop of the whole frame") {
    const renderer::Renderer r(busy_scene(), {3, 2, 11});
    const std::vector<float> full = whole(r, 64);
    for (const Region window : {Region{37, 41, 61, 55}, Region{1, 0, 15, 150}, Region{70, 70, 1, 1}}) {
        const std::vector<float> part = render_window(r, window, 13);
        std::size_t differing = 0;
        for (std::size_t b = 0; b < 2; ++b)
            for (int y = 0; y < window.height; ++y)
                for (int x = 0; x < window.width; ++x) {
                    const float whole_value =
                        full[b * 150 * 150 + static_cast<std::size_t>((window.y + y) * 150 + window.x + x)];
                    const float part_value = part[b * static_cast<std::size_t>(window.area()) +
                                                  static_cast<std::size_t>(y * window.width + x)];
                    differing += whole_value != part_value ? 1 : 0;
                }
        CHECK(differing == 0);
    }
}

TEST_CASE("Successive frames have their own noise, the same frame the same") {
    const renderer::Renderer r(busy_scene(), {2, 2, 11});
    const Region window{0, 0, 150, 150};
    CHECK(render_window(r, window, 64, 1) == render_window(r, window, 64, 1));
    CHECK(render_window(r, window, 64, 1) != render_window(r, window, 64, 2));
}

TEST_CASE("Lines of one row at many times have the same bytes in any parts") {
    constexpr std::int32_t width = 150, lines = 40;
    for (const bool wings : {false, true}) {
        scene::Scene s = busy_scene();
        s.camera.motion.spin_axis = {1, 0.1, 0};
        s.camera.motion.spin_rate_rad_s =
            2 * s.camera.pixel_pitch_m / s.camera.focal_length_m; // 2 px a second
        if (wings) {
            s.camera.psf.model = scene::PointSpread::Model::airy;
            s.camera.psf.wings_px = 40;
            s.camera.aperture_m = s.camera.focal_length_m / 20;
        }
        const renderer::Renderer r(s, {2, 2, 11});
        std::vector<RowTime> times;
        for (std::int32_t l = 0; l < lines; ++l)
            times.push_back({Time{l * 100 * ns_per_ms}, Time{(l * 100 + 50) * ns_per_ms}});
        const auto in_parts = [&](std::int32_t part) {
            std::vector<float> image(static_cast<std::size_t>(width * lines) * r.band_count());
            for (std::int32_t first = 0; first < lines; first += part) {
                renderer::RenderRequest request;
                request.window = {0, 75, width, 1};
                request.rows = std::min(part, lines - first);
                request.line = first;
                request.frame_times = times;
                request.row_times = std::span(times).subspan(static_cast<std::size_t>(first),
                                                             static_cast<std::size_t>(request.rows));
                request.plane_rows = lines;
                REQUIRE(r.render(request, std::span(image).subspan(static_cast<std::size_t>(first * width))));
            }
            return image;
        };
        const std::vector<float> one_by_one = in_parts(1);
        CHECK(one_by_one[static_cast<std::size_t>(20 * width + 75)] > 0);
        CHECK(in_parts(lines) == one_by_one);
        CHECK(in_parts(7) == one_by_one);
    }
}

TEST_CASE("Rendering stops when it is cancelled") {
    const renderer::Renderer r(busy_scene(), {1, 2, 1});
    const std::atomic<bool> cancel{true};
    std::vector<float> image(2 * 150 * 10);
    const std::vector<RowTime> times(10);
    renderer::RenderRequest request;
    request.window = {0, 0, 150, 150};
    request.rows = 10;
    request.row_times = times;
    CHECK_FALSE(r.render(request, image, &cancel));
    CHECK(r.render(request, image));
}

TEST_CASE("A row that is being rendered when it is cancelled ends soon, also the last one") {
    std::atomic<bool> cancel{false};
    renderer::RenderSettings settings{65536, 1, 1};
    settings.before_row = [&cancel](bool /*first*/) { cancel = true; };
    const renderer::Renderer r(sphere_scene(renderer::LambertParameters{0.5}, 0, 40, 150), settings);
    std::vector<float> image(150);
    const std::vector<RowTime> times(1);
    renderer::RenderRequest request;
    request.window = {0, 75, 150, 1};
    request.rows = 1;
    request.row_times = times;
    CHECK_FALSE(r.render(request, image, &cancel));
    CHECK(r.samples_taken() < 65536);
}

TEST_CASE("Nothing is traced where nothing is") {
    scene::Scene s = busy_scene();
    s.bodies.clear();
    const renderer::Renderer empty(s, {4, 1, 1});
    whole(empty, 64);
    CHECK(empty.samples_taken() == 0);

    const renderer::Renderer ball(sphere_scene(renderer::LambertParameters{0.5}, 0, 40, 150), {4, 1, 1});
    whole(ball, 64);
    // The disc and its margin, not the frame.
    CHECK(ball.samples_taken() > 4 * 5000);
    CHECK(ball.samples_taken() < 4 * 6500);
    CHECK(ball.rays_traced() >= ball.samples_taken());
}

TEST_CASE("The ground truth holds every pose at its instant") {
    scene::Scene s = busy_scene();
    s.bodies[0].motion.spin_axis = {0, 0, 1};
    s.bodies[0].motion.spin_rate_rad_s = 0.5;
    s.camera.motion.samples = {{0, {{0, 0, 0}, {}}}, {10, {{100, 0, 0}, {}}}};
    const renderer::Renderer r(s, {1, 1, 9});
    GroundTruth truth;
    r.fill_truth({2 * ns_per_s}, truth);
    CHECK(truth.body_count == 3);
    CHECK(std::string(truth.bodies[1].name.data()) == "moon");
    CHECK(length(truth.camera.position_m - Vec3{20, 0, 0}) < 1e-9);
    CHECK(std::abs(dot(truth.bodies[0].pose.orientation, axis_angle({0, 0, 1}, 1.0))) > 1 - 1e-12);
    CHECK(truth.seed == 9);
    CHECK(truth.sun_position_m == s.sun.position_m);
}

} // namespace determinism_test
