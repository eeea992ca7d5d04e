// SPDX-License-Identifier: Apache-2.0
// The C++ client with a server of its own: light beside its formula, changes of the scene, mistakes,
// cancelling.
#include "obscura_calls.hpp"
#include "obscura_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <signal.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace obscura;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using client::Map;

namespace {

client::Client start() {
    client::StartOptions options;
    options.program = OBSCURA_PROGRAM;
    return client::start("", options);
}

/// A ball 10 m in front of a camera, and a lamp at the place of the camera.
Map lit_ball() {
    return {
        {"quantity", "radiance"},
        {"sun", Map{{"irradiance_scale", 0}}},
        {"camera", Map{{"width", 33},
                       {"height", 33},
                       {"focal_length_mm", 10},
                       {"pixel_pitch_um", 2},
                       {"psf_sigma_px", 0},
                       {"boresight", {0, 0, 1}},
                       {"up", {0, -1, 0}}}},
        {"lamp",
         {Map{{"name", "lamp"}, {"intensity_w_sr", {100}}, {"boresight", {0, 0, 1}}, {"up", {0, -1, 0}}}}},
        {"body",
         {Map{{"name", "ball"},
              {"shape", "ellipsoid"},
              {"radii_m", {1, 1, 1}},
              {"albedo", 0.8},
              {"position_m", {0, 0, 10}}}}}};
}

} // namespace

TEST_CASE("a picture has the light and depth of its scene", "[clients]") {
    auto camera = start();
    CHECK(camera.server()["server"].string() == "obscura");
    camera.load_scene(lit_ball());
    client::RenderOptions options;
    options.samples = 16;
    options.layers = {"depth_m", "normal.z"};
    options.truth = true;
    const auto picture = camera.render(options);
    // Lambert: radiance = albedo / pi * intensity / distance^2, at the point that is nearest.
    CHECK_THAT(picture["radiance"].at(0, 16, 16), WithinAbs(0.8 / std::numbers::pi * 100 / 81, 1e-3));
    CHECK_THAT(picture["depth_m"].at(16, 16), WithinAbs(9.0, 1e-5));
    CHECK_THAT(picture["normal.z"].at(16, 16), WithinAbs(-1.0, 1e-5));
    CHECK(picture["radiance"].shape() == std::vector<std::size_t>{1, 33, 33});
    CHECK(picture.arrays().size() == 3);
    CHECK_THROWS_AS(picture["range_m"], std::out_of_range);
    CHECK_THROWS_AS(picture["depth_m"].at(33, 0), std::out_of_range);
    CHECK_THROWS_AS(picture["depth_m"].at(0), std::out_of_range);
    const auto ball = picture.map()["truth"]["bodies"][std::size_t{0}];
    CHECK(ball["name"].string() == "ball");
    CHECK(ball["position_m"].numbers() == std::vector<double>{0, 0, 10});
    CHECK(ball["range_m"].as(0.0) == 10);
    CHECK(picture.map()["unit"].string() == "W m-2 sr-1");

    // A window has the pixels of the whole.
    options.window = {10, 12, 8, 6};
    const auto part = camera.render(options);
    CHECK(part["radiance"].shape() == std::vector<std::size_t>{1, 6, 8});
    CHECK(part["radiance"].at(0, 4, 6) == picture["radiance"].at(0, 16, 16));

    // Seed 0 can be said, too; noise of the lamp's shadowless light is none, so only that it is taken.
    options.seed = 0;
    CHECK_NOTHROW(camera.render(options));
}

TEST_CASE("a sensor gives digital numbers", "[clients]") {
    auto camera = start();
    camera.load("demo");
    client::RenderOptions options;
    options.sensor = "star250";
    options.exposure_s = 0.01;
    options.samples = 1;
    const auto picture = camera.render(options);
    const auto numbers = picture["dn"];
    CHECK(numbers.dtype() == "<u2");
    CHECK(numbers.begin() == nullptr);
    CHECK(numbers.bytes() == 2 * numbers.size());
    CHECK(picture.map()["unit"].string() == "DN");
}

TEST_CASE("a scene is changed, read and written out", "[clients]") {
    auto camera = start();
    camera.load("demo");
    camera.load_scene(lit_ball());
    camera.set("camera", {{"focal_length_mm", 31.25}});
    camera.set("body", "ball", {{"position_m", {1.5, -2.25, 1e-3}}, {"albedo", 0.2}});
    camera.add(
        "body",
        {{"name", "box"}, {"shape", "box"}, {"albedo", 0.1}, {"size_m", std::vector<double>{1, 2, 3}}});
    CHECK(camera.get("camera").view()["focal_length_mm"].as(0.0) == 31.25);
    CHECK(camera.get("body", "ball").view()["position_m"].numbers() == std::vector<double>{1.5, -2.25, 1e-3});
    CHECK(camera.get("body").view().size() == 2);
    camera.set("camera", {{"focal_length_mm", nullptr}});
    CHECK(camera.get("camera").view()["focal_length_mm"].is_nil());
    const std::string toml = camera.export_toml();
    CHECK_THAT(toml, ContainsSubstring("name = \"box\""));
    camera.remove("body", "box");
    CHECK(camera.get("body").view().size() == 1);
    camera.load_toml(toml);
    CHECK(camera.export_toml() == toml);
    const auto moved = std::move(camera);
    CHECK(moved.get() != nullptr);
}

TEST_CASE("a mistake is refused in the server's words and changes nothing", "[clients]") {
    auto camera = start();
    camera.load_scene(lit_ball());
    const std::string before = camera.export_toml();
    try {
        camera.set("body", "ball", {{"albedo", 2.5}});
        FAIL("it was not refused");
    } catch (const client::RequestError& error) {
        CHECK(error.code == "bad-scene");
        CHECK(error.field == "body[0].albedo");
        CHECK(error.allowed == "0 to 1");
        CHECK_THAT(error.what(), ContainsSubstring("2.5 is out of range"));
    }
    CHECK_THROWS_AS(camera.call("rendr"), client::RequestError);
    CHECK_THROWS_AS(camera.load_toml("name = 'x'\nwidth = = 3\n"), client::RequestError);
    CHECK_THROWS_AS(camera.load_toml(std::string(1 << 21, ' ')), client::BadUse);
    CHECK(camera.export_toml() == before);
}

TEST_CASE("typed calls have the fields and answers of the server's table", "[clients]") {
    namespace calls = client::calls;
    auto camera = start();
    calls::SceneLoad load;
    load.scene = lit_ball();
    CHECK(calls::ask(camera, load).bodies == std::vector<std::string>{"ball"});
    CHECK(calls::ask(camera, load).width == 33);
    calls::SceneSet set{"body", client::Value("ball"), Map{{"albedo", 0.4}}};
    calls::ask(camera, set);
    CHECK(calls::ask(camera, calls::SceneGet{"body", "ball"}).keys.view()["albedo"].as(0.0) == 0.4);
    calls::Render render;
    render.samples = 1;
    render.layers = {"depth_m"};
    const auto picture = camera.call(calls::Render::name, render.fields());
    CHECK_THAT(picture["depth_m"].at(16, 16), WithinAbs(9, 1e-4));
    const auto told = calls::Render::read(picture.map());
    CHECK(told.unit == "W m-2 sr-1");
    CHECK(told.time_s == 0.0);
    CHECK(told.truth.view().is_nil());
    CHECK_FALSE(calls::ask(camera, calls::Status()).request);
}

TEST_CASE("a render is cancelled by progress, by its exception, and by another thread", "[clients]") {
    auto camera = start();
    camera.load_scene(lit_ball());
    camera.set("camera", {{"pixel_pitch_um", 20}});
    client::RenderOptions endless;
    endless.width = endless.height = 1024;
    endless.samples = 256;
    std::int64_t rows = 0;
    camera.on_progress([&](std::int64_t /*done*/, std::int64_t total, double /*left_s*/) {
        rows = total;
        return false;
    });
    CHECK_THROWS_AS(camera.render(endless), client::Cancelled);
    CHECK(rows == 1024);
    camera.on_progress(
        [](std::int64_t, std::int64_t, double) -> bool { throw std::logic_error("of the function"); });
    CHECK_THROWS_AS(camera.render(endless), std::logic_error);
    camera.on_progress({});

    camera.begin("render", endless.fields());
    CHECK_FALSE(camera.wait(0));
    std::thread other([&] { camera.cancel(); });
    CHECK_THROWS_AS(camera.wait(), client::Cancelled);
    other.join();
    CHECK(camera.call("status").map()["waiting"].as(std::int64_t{-1}) == 0);
}

TEST_CASE("the server ends with its client and leaves nothing behind", "[clients]") {
    const test::TempFolder folder;
    ::setenv("TMPDIR", folder.path().c_str(), 1);
    {
        auto camera = start();
        CHECK_FALSE(std::filesystem::is_empty(folder.path()));
        CHECK_THROWS_AS(client::connect("127.0.0.1:1"), client::ConnectionLost);
    }
    ::unsetenv("TMPDIR");
    CHECK(std::filesystem::is_empty(folder.path()));
}
