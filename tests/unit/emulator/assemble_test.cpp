// SPDX-License-Identifier: Apache-2.0
// Frame pipelines made from configurations, and mistakes in scenes that are found when they are built.
#include "core/error.hpp"
#include "emulator/unit/assemble.hpp"
#include "emulator/unit/render_speed.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

namespace assemble_test {

using namespace obscura;
using Catch::Matchers::StartsWith;

TEST_CASE("the triggers of a camera begin with an edge that its line reports") {
    const test::TempFolder folder;
    folder.write("scene.toml", "[camera]\nfocal_length_mm = 50\naperture_mm = 25\n");
    for (const std::string edge : {"rising", "falling", "both"}) {
        CAPTURE(edge);
        const emulator::Imaging imaging(
            emulator::load_config(folder.write(
                "daemon.toml", "[scene]\nfile = \"scene.toml\"\n[trigger]\nsource = \"gpio\"\nline = "
                               "\"X\"\nedge = \"" +
                                   edge + "\"\n")),
            1);
        CHECK(explain_invalid(imaging.camera.initial, imaging.camera.limits) == "");
    }
}

TEST_CASE("mistakes found when a scene is built name their position in its file") {
    const test::TempFolder folder;
    folder.write("bad.obj", "v 0 0\n");
    const auto complaint = [&](const std::string& scene, const std::string& more = "") {
        folder.write("scene.toml", scene);
        const auto config =
            emulator::load_config(folder.write("c.toml", "[scene]\nfile = \"scene.toml\"\n" + more));
        try {
            const emulator::Imaging imaging(config, 1);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    };
    const std::string place = folder.path().string() + "/";
    CHECK_THAT(complaint("[camera]\ndistortion_ideal_mm = [0, 1]\n"),
               StartsWith(place + "scene.toml:1:2: camera: distortion: "));
    CHECK_THAT(complaint("[camera]\n", "[[camera]]\n[camera.view]\ndistortion_ideal_mm = [0, 1]\n"),
               StartsWith(place + "c.toml:4:1: camera: distortion: "));
    CHECK_THAT(complaint("[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.1\n"
                         "[[body]]\nshape = \"mesh\"\nfile = \"bad.obj\"\nalbedo = 0.1\n"),
               StartsWith(place + "scene.toml:5:1: " + place + "bad.obj:1: "));
}

TEST_CASE("the reserve is an eighth of a frame, within a tenth of the period and what is configured") {
    using emulator::reserve_for;
    CHECK(reserve_for(64'000'000, 100'000'000, 1'000'000) == 8'000'000);
    CHECK(reserve_for(124'000'000, 100'000'000, 1'000'000) == 10'000'000);
    CHECK(reserve_for(2'000'000, 100'000'000, 1'000'000) == 1'000'000);
    CHECK(reserve_for(64'000'000, 0, 0) == 8'000'000);
}

TEST_CASE("a camera that adapts measures how fast this machine renders before it starts") {
    const test::TempFolder folder;
    folder.write("scene.toml", "[camera]\nfocal_length_mm = 50\naperture_mm = 25\n"
                               "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.1\n"
                               "position_m = [0, 0, 20]\n");
    const auto reserve_ns = [&](const std::string& quality, bool go_on) {
        const auto file = folder.write("c.toml", "[scene]\nfile = \"scene.toml\"\n[trigger]\nrate_hz = 2\n"
                                                 "[deadline]\nreserve_us = 0\nquality = \"" +
                                                     quality + "\"\n");
        emulator::Imaging imaging(emulator::load_config(file), 2, {}, {}, emulator::RenderAhead::automatic,
                                  true);
        CHECK(imaging.measure_speed([&](double) { return go_on; }) == (go_on || quality == "hold"));
        return imaging.maker->reserve_ns();
    };
    CHECK(reserve_ns("hold", true) == 0);
    CHECK(reserve_ns("adapt", false) == 0);
    const std::int64_t measured_ns = reserve_ns("adapt", true);
    CHECK(measured_ns > 0);
    CHECK(measured_ns <= 50'000'000); // a tenth of half a second
}

TEST_CASE("the run word is the configured one or a new one each time") {
    const test::TempFolder folder;
    folder.write("scene.toml", "[camera]\nfocal_length_mm = 50\naperture_mm = 25\n");
    const auto run_of = [&](const std::string& daemon) {
        const auto file = folder.write("daemon.toml", "[scene]\nfile = \"scene.toml\"\n" + daemon);
        return emulator::Imaging(emulator::load_config(file), 1).maker->run();
    };
    CHECK(run_of("[daemon]\nrun = 0\n") == 0);
    CHECK(run_of("[daemon]\nrun = 4294967295\n") == 0xFFFFFFFF);
    CHECK(run_of("") != run_of("")); // but for once in 2^32
    CHECK_THROWS_AS(run_of("[daemon]\nrun = 4294967296\n"), ConfigError);

    // The cameras of one daemon have different words, and the printed configuration the one that was given.
    const std::string cameras = "[[camera]]\ngige = { enabled = false }\n";
    const emulator::DaemonConfig config = emulator::load_config(
        folder.write("several.toml", "[scene]\nfile = \"scene.toml\"\n[daemon]\nrun = 4294967294\n" +
                                         cameras + cameras + cameras));
    std::vector<std::uint32_t> words;
    for (const emulator::DaemonConfig* camera : config.cameras())
        words.push_back(emulator::Imaging(*camera, 1).maker->run());
    CHECK(words == std::vector<std::uint32_t>{4294967294, 4294967295, 0});
    CHECK_THAT(emulator::print_config(config), Catch::Matchers::ContainsSubstring("\nrun = 4294967294\n"));
}

} // namespace assemble_test
