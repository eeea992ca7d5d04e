// SPDX-License-Identifier: Apache-2.0
// Times of rows and pixels in SuMoL: a star crosses a sensor that scans, determinism, and mistakes.
#include "core/error.hpp"
#include "models/values/model_use.hpp"
#include "renderer/frame_times.hpp"
#include "renderer/materials/lambert.hpp"
#include "scene_texts.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace model_timing_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr int size = 64;
constexpr double pixels_a_radian = 1e4;

std::string scene_text(const std::string& shutter, const std::string& turn = "turn.mot") {
    return vibrating_camera_text("{ model = \"" + turn + "\" }", "shutter = " + shutter + "\n");
}

constexpr const char* turn = "parameter across 4e-3;\nparameter down 1.5e-3;\n"
                             "vec3 rotation(scalar t) { return vec3(down * t, across * t, 0); }\n";
constexpr const char* scan =
    "parameter pixel_us 100;\n"
    "scalar reset(scalar row, scalar column, scalar exposure) { return (row * columns + column) * pixel_us * 1e-6; }\n"
    "scalar read(scalar row, scalar column, scalar exposure) { return reset(row, column, exposure) + exposure; }\n";

/// Rows in blocks of `block`.
std::vector<float> rendered(const scene::Scene& scene, Region window, std::uint32_t threads,
                            std::int64_t exposure_ns, std::int32_t block = 64) {
    renderer::RenderSettings settings;
    settings.threads = threads;
    const renderer::Renderer renderer(scene, settings);
    const renderer::FrameTimes times =
        renderer::frame_times(scene.camera, window, {Time{}, Time{exposure_ns}});
    std::vector<float> image(renderer.band_count() * static_cast<std::size_t>(window.area()));
    for (std::int32_t first = 0; first < window.height; first += block) {
        renderer::RenderRequest request;
        request.window = window;
        request.first_row = first;
        request.rows = std::min(block, window.height - first);
        request.row_times =
            std::span(times.rows)
                .subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(request.rows));
        request.common_mid = times.common_mid;
        request.pixel_times = times.pixels;
        request.plane_rows = window.height;
        renderer.render(request, std::span(image).subspan(static_cast<std::size_t>(first) *
                                                          static_cast<std::size_t>(window.width)));
    }
    return image;
}

struct Centroid {
    double sum = 0, x = 0, y = 0;
    explicit Centroid(const std::vector<float>& image) {
        for (int row = 0; row < size; ++row)
            for (int column = 0; column < size; ++column) {
                const auto v = static_cast<double>(image[static_cast<std::size_t>(row * size + column)]);
                sum += v, x += v * column, y += v * row;
            }
        x /= sum, y /= sum;
    }
};

const Region whole{0, 0, size, size};

} // namespace

TEST_CASE("a star that crosses a scanning sensor is where its time says") {
    const SceneTexts folder;
    folder.write("turn.mot", turn);
    folder.write("scan.tim", scan);
    for (const double pixel_us : {5.0, 30.0, 100.0, 250.0}) {
        CAPTURE(pixel_us);
        scene::Scene scene =
            folder.scene(scene_text(fmt::format("{{ model = \"scan.tim\", pixel_us = {} }}", pixel_us)));
        scene.stars.push_back({0, 0, 2, 0.5});
        const Centroid seen(rendered(scene, whole, 2, 1000));
        // Turned about y the star goes left, about x down: x = c - v t, y = c + w t, t = (64 y + x) dt.
        const double c = (size - 1) / 2.0, dt = pixel_us * 1e-6;
        const double v = 4e-3 * pixels_a_radian, w = 1.5e-3 * pixels_a_radian;
        const double t = dt * (size * c + c) / (1 + dt * v - dt * size * w);
        REQUIRE(std::abs(c - v * t) < c);
        CHECK_THAT(seen.x, WithinAbs(c - v * (t + 0.5e-6), 0.005));
        CHECK_THAT(seen.y, WithinAbs(c + w * (t + 0.5e-6), 0.005));
    }
}

TEST_CASE("a scanned picture is the same on any number of threads, in any rows and with machine code") {
    const SceneTexts folder;
    folder.write("turn.mot", turn);
    folder.write("scan.tim", scan);
    const std::string text = scene_text("{ model = \"scan.tim\" }");
    const auto scene_of = [&](bool native) {
        models::ModelUse use;
        if (!native) use.execution.target = models::NativeTarget::none;
        const models::UseModels used(use);
        scene::Scene scene = folder.scene(text);
        scene.stars.push_back({0, 0, 2, 0.5});
        scene.bodies.push_back(
            {"ball", renderer::EllipsoidParameters{{500, 500, 500}}, renderer::LambertParameters{0.2}, {}});
        scene.bodies.back().motion.samples[0].pose.position_m = {4e5, 200, 100};
        return scene;
    };
    const scene::Scene scene = scene_of(true);
    const std::vector<float> image = rendered(scene, whole, 1, 20'000'000);
    CHECK(*std::max_element(image.begin(), image.end()) > 0);
    for (const std::uint32_t threads : {2U, 7U})
        CHECK(rendered(scene, whole, threads, 20'000'000, threads == 2 ? 5 : 64) == image);
    CHECK(rendered(scene_of(false), whole, 3, 20'000'000) == image);
    // A window is the crop of the whole.
    const Region part{11, 20, 30, 25};
    const std::vector<float> cut = rendered(scene, part, 2, 20'000'000);
    for (std::int32_t y = 0; y < part.height; ++y)
        for (std::int32_t x = 0; x < part.width; ++x)
            REQUIRE(cut[static_cast<std::size_t>(y * part.width + x)] ==
                    image[static_cast<std::size_t>((part.y + y) * size + part.x + x)]);
}

TEST_CASE("times of pixels that are those of their rows give the picture of rows") {
    const SceneTexts folder;
    folder.write("turn.mot", turn);
    folder.write("rows.tim",
                 "scalar reset(scalar row, scalar exposure) { return row * 2e-3; }\n"
                 "scalar read(scalar row, scalar exposure) { return reset(row, exposure) + exposure; }\n");
    folder.write("pixels.tim",
                 "scalar reset(scalar row, scalar column, scalar exposure) { return row * 2e-3; }\n"
                 "scalar read(scalar row, scalar column, scalar exposure)"
                 " { return reset(row, column, exposure) + exposure; }\n");
    std::vector<std::vector<float>> images;
    for (const char* name : {"rows", "pixels"}) {
        scene::Scene scene = folder.scene(scene_text(fmt::format("{{ model = \"{}.tim\" }}", name)));
        scene.stars.push_back({0, 0, 2, 0.5});
        scene.bodies.push_back(
            {"ball", renderer::EllipsoidParameters{{500, 500, 500}}, renderer::LambertParameters{0.2}, {}});
        scene.bodies.back().motion.samples[0].pose.position_m = {4e5, 200, 100};
        images.push_back(rendered(scene, whole, 2, 50'000'000));
    }
    CHECK(images[0] == images[1]);
}

TEST_CASE("layers and times of a scanned picture are those of its pixels") {
    const SceneTexts folder;
    folder.write("turn.mot", turn);
    folder.write("scan.tim", scan);
    scene::Scene scene = folder.scene(scene_text("{ model = \"scan.tim\" }"));
    scene.bodies.push_back(
        {"ball", renderer::EllipsoidParameters{{500, 500, 500}}, renderer::LambertParameters{0.2}, {}});
    scene.bodies.back().motion.samples[0].pose.position_m = {4e5, 0, 0};
    const renderer::Renderer renderer(scene, {});
    const Region part{16, 20, 30, 20};
    const renderer::FrameTimes times = renderer::frame_times(scene.camera, part, {Time{}, Time{1000}});
    renderer::RenderRequest request;
    request.window = part;
    request.rows = part.height;
    request.row_times = times.rows;
    request.pixel_times = times.pixels;
    std::vector<float> aovs(renderer::aov_count * static_cast<std::size_t>(part.area()));
    renderer.render_aovs(request, aovs);
    std::vector<float> middles(30);
    int differing = 0;
    for (std::int32_t y = 0; y < part.height; ++y) {
        renderer::fill_middles(times, part, y, middles);
        for (std::int32_t x = 0; x < part.width; ++x) {
            const double t = ((part.y + y) * size + part.x + x) * 1e-4 + 0.5e-6;
            REQUIRE_THAT(static_cast<double>(middles[static_cast<std::size_t>(x)]), WithinAbs(t, 1e-7));
            // The disc, 12.5 px in radius, at that time.
            const double dx = part.x + x - 31.5 + 40 * t, dy = part.y + y - 31.5 - 15 * t;
            const double r = std::hypot(dx, dy);
            const bool seen = aovs[static_cast<std::size_t>(y * part.width + x)] > 0;
            if (std::abs(r - 12.5) > 0.01 && seen != (r < 12.5)) ++differing;
        }
    }
    CHECK(differing == 0);
}

TEST_CASE("mistakes in a shutter of a scene are told with their places") {
    const SceneTexts folder;
    folder.write("turn.mot", turn);
    folder.write("bad.tim", "scalar reset(scalar row, scalar exposure) { return 0.5; }\n"
                            "scalar read(scalar row, scalar exposure) { return 0.1; }\n");
    CHECK_THAT(folder.refusal(scene_text("\"rolling\"")),
               ContainsSubstring("write shutter = { model = \"FILE.tim\" }"));
    CHECK_THAT(folder.refusal(scene_text("{ model = \"line-interleaved\", lines_us = 1 }")),
               ContainsSubstring("did you mean \"line_us\""));
    CHECK_THAT(folder.refusal(scene_text("{ model = \"line-interleaved\", line_us = 0 }")),
               ContainsSubstring("camera.shutter.line_us: 0"));
    CHECK_THAT(folder.refusal(scene_text("{ model = \"turn.mot\" }")), ContainsSubstring("ends in .tim"));
    CHECK(folder.refusal(scene_text("{ model = \"line-interleaved\", line_us = 20 }")) == "accepted");
    const scene::Scene scene = folder.scene(scene_text("{ model = \"bad.tim\" }"));
    CHECK_THROWS_WITH(renderer::frame_times(scene.camera, whole, {Time{}, Time{1000}}),
                      ContainsSubstring("camera: shutter: ") &&
                          ContainsSubstring("bad.tim:2:8: read() is 0.1 s"));
}

} // namespace model_timing_test
