// SPDX-License-Identifier: Apache-2.0
// Small motions of a camera in SuMoL: poses, blur of a star, and mistakes.
#include "core/error.hpp"
#include "core/units.hpp"
#include "renderer/world/scene_poses.hpp"
#include "scene_texts.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

namespace model_motion_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr std::string_view swing =
    "parameter a_urad 300;\nparameter rate_hz 40;\n"
    "vec3 rotation(scalar t) { return vec3(0, sin(2 * M_PI * rate_hz * t), 0) * (a_urad * 1e-6); }\n"
    "vec3 offset(scalar t) { return vec3(1e-3 * t, 0, 0); }\n";

std::vector<float> exposed(const scene::Scene& scene, std::uint32_t threads) {
    renderer::RenderSettings options;
    options.threads = threads;
    options.samples_per_pixel = 64;
    // Ten whole cycles.
    return render_window(renderer::Renderer(scene, options), {0, 0, 64, 64}, 64, 1, Time{125'000'000},
                         250'000'000);
}

} // namespace

TEST_CASE("a vibration turns and moves the camera in its own frame") {
    const SceneTexts folder;
    folder.write("swing.mot", std::string(swing));
    const renderer::ScenePoses poses(
        folder.scene(vibrating_camera_text("{ model = \"swing.mot\", a_urad = 500 }")));
    const renderer::ScenePoses still(
        folder.scene(vibrating_camera_text("{ model = \"swing.mot\", a_urad = 0 }")));
    for (const double t : {0.0, 0.00625, 0.01, 1.237}) {
        const Pose camera = poses.camera(t), rest = still.camera(t);
        const double angle = 500e-6 * std::sin(2 * std::numbers::pi * 40 * t);
        // About y, which points down: the boresight moves to the right, which is x.
        const Vec3 seen = rotate(conjugate(rest.orientation), rotate(camera.orientation, {0, 0, 1}));
        CHECK_THAT(seen.x, WithinAbs(std::sin(angle), 1e-12));
        CHECK_THAT(seen.y, WithinAbs(0, 1e-12));
        const Vec3 moved = rotate(conjugate(rest.orientation), camera.position_m);
        CHECK_THAT(moved.x, WithinAbs(1e-3 * t, 1e-12));
    }
}

TEST_CASE("jitter spreads a star by the variance of a sine, on any number of threads") {
    const SceneTexts folder;
    folder.write("swing.mot", std::string(swing));
    scene::Scene scene = folder.scene(vibrating_camera_text("{ model = \"swing.mot\" }"));
    scene.stars.push_back({0, 0, 2, 0.5});
    const std::vector<float> image = exposed(scene, 1);
    double sum = 0, x1 = 0, x2 = 0, y1 = 0, y2 = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const auto v = static_cast<double>(image[static_cast<std::size_t>(y * 64 + x)]);
            sum += v;
            x1 += v * x, x2 += v * x * x;
            y1 += v * y, y2 += v * y * y;
        }
    REQUIRE(sum > 0);
    const double across = x2 / sum - x1 / sum * (x1 / sum), down = y2 / sum - y1 / sum * (y1 / sum);
    // 300 urad are 3 px: a sine has half the square of its amplitude.
    CHECK_THAT(across - down, WithinAbs(4.5, 0.15));
    CHECK(exposed(scene, 3) == image);
}

TEST_CASE("mistakes in a vibration are told with their places") {
    const SceneTexts folder;
    folder.write("nan.mot", "vec3 rotation(scalar t) { return vec3(sqrt(t - 500), 0, 0); }");
    folder.write("none.mot", "vec3 offset(scalar t) { return vec3(0, 0, 0); }");
    CHECK_THAT(folder.refusal(vibrating_camera_text("{ model = \"nan.mot\" }")),
               ContainsSubstring("camera.vibration: ") &&
                   ContainsSubstring("nan.mot:1:6: rotation() is not finite at t = "));
    CHECK_THAT(folder.refusal(vibrating_camera_text("{ model = \"none.mot\" }")),
               ContainsSubstring("the function vec3 rotation(scalar t) is missing"));
    CHECK_THAT(folder.refusal(vibrating_camera_text("\"reaction-wheel\"")),
               ContainsSubstring("write vibration = { model = \"FILE.mot\" }"));
    CHECK_THAT(folder.refusal(vibrating_camera_text("{ model = \"reaction-wheel\", rate_hz = 1000 }")),
               ContainsSubstring("camera.vibration.rate_hz: 1000"));
    CHECK(folder.refusal(vibrating_camera_text("{ model = \"reaction-wheel\", rate_hz = 60 }")) ==
          "accepted");
}

} // namespace model_motion_test
