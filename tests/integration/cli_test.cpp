// SPDX-License-Identifier: Apache-2.0
// The command line doing what it is asked: help, check, render, capture, bench.
#include "images/image.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/daf_writer.hpp"
#include "tests/support/data.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>

using namespace obscura::test;
namespace images = obscura::images;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::StartsWith;

namespace {

const std::string program = OBSCURA_BINARY_DIR "/tools/obscura";

std::string run(const TempFolder& folder, std::vector<std::string> arguments, int expected = 0) {
    arguments.insert(arguments.begin(), program);
    ChildProcess child(folder.path(), "obscura", arguments);
    const int status = child.wait(100s).value_or(-1);
    INFO(child.err());
    REQUIRE(status == expected);
    return child.out();
}

std::string small_configuration(const TempFolder& folder) {
    DaemonOptions options;
    options.size = 64;
    return write_configuration(folder, options).string();
}

} // namespace

TEST_CASE("help of every verb has usage, options and examples") {
    const TempFolder folder;
    const std::string help = run(folder, {"--help"});
    for (const std::string verb :
         {"render", "capture", "grab", "check", "compare", "import flight-image", "bench", "timing"}) {
        CHECK_THAT(help, ContainsSubstring("\n  " + verb + " "));
        const std::string text = run(folder, {verb, "--help"});
        CHECK_THAT(text, StartsWith("obscura " + verb + " - "));
        CHECK_THAT(text, ContainsSubstring("\nUsage: obscura " + verb + " "));
        CHECK_THAT(text, ContainsSubstring("\nExamples:\n  obscura " + verb));
        CHECK_THAT(text, ContainsSubstring("\nExit status: "));
    }
    CHECK_THAT(run(folder, {"--version"}), StartsWith("obscura 0."));
}

TEST_CASE("check accepts what is sound and prints what loads again") {
    const TempFolder folder;
    const std::string config = small_configuration(folder);
    CHECK_THAT(run(folder, {"check", config}), StartsWith(config + ": good: generic, sensor 64 x 64 px"));
    const std::string printed = run(folder, {"check", "--print", config});
    const auto again = folder.write("printed.toml", printed);
    const std::string second = run(folder, {"check", "--print", again});
    CHECK(printed.substr(printed.find('\n')) == second.substr(second.find('\n')));
    CHECK_THAT(run(folder, {"check", "--scene", OBSCURA_SOURCE_DIR "/config/scenes/demo.toml"}),
               ContainsSubstring("good: \"demo\" with 1 body, 4995 stars, 1 band"));
}

TEST_CASE("check tells a scene and a sensor from a configuration by their tables") {
    const TempFolder folder;
    CHECK_THAT(run(folder, {"check", OBSCURA_SOURCE_DIR "/config/scenes/demo.toml"}),
               ContainsSubstring("good: \"demo\" with 1 body, 4995 stars, 1 band"));
    for (const auto& file : std::filesystem::directory_iterator(OBSCURA_SOURCE_DIR "/config/sensors"))
        CHECK_THAT(run(folder, {"check", file.path()}), ContainsSubstring("good: sensor "));
    CHECK_THAT(run(folder, {"check", OBSCURA_SOURCE_DIR "/config/demo.toml"}),
               ContainsSubstring("good: generic 640x512, sensor 640 x 512 px, scene"));
    // A mistake in a key is reported as that of a scene or a sensor, and the rest is known.
    const auto refusal = [&](std::vector<std::string> arguments, int status) {
        arguments.insert(arguments.begin(), program);
        ChildProcess child(folder.path(), "obscura", arguments);
        CHECK(child.wait(100s).value_or(-1) == status);
        return child.err();
    };
    const auto scene = folder.write("scene.toml", R"(name = "moon"
[sun]
direction = [1, 0, 0]
distance_au = "near"
[camera]
focal_length_mm = 50
[[body]]
shape = "sphere"
)");
    const std::string of_scene = refusal({"check", scene}, 78);
    CHECK_THAT(of_scene, ContainsSubstring("scene.toml:4:"));
    CHECK_THAT(of_scene, !ContainsSubstring("name"));
    const auto sensor = folder.write("sensor.toml", "name = \"mine\"\n[readout]\nwidth = -1\n[detector]\n");
    CHECK_THAT(refusal({"check", sensor}, 78), StartsWith(sensor.string() + ":3:"));
    CHECK_THAT(refusal({"check", "--print", scene}, 64), ContainsSubstring("is a scene file"));
    // Tables of neither are those of a configuration.
    CHECK_THAT(refusal({"check", folder.write("empty.toml", "")}, 78),
               ContainsSubstring("a scene file is wanted"));
}

TEST_CASE("a render has the same bytes on any number of threads, in every format") {
    const TempFolder folder;
    const std::string scene = OBSCURA_SOURCE_DIR "/config/scenes/demo.toml";
    for (const std::string extension : {"exr", "fits", "png"}) {
        std::vector<std::string> files;
        for (const std::string threads : {"1", "2", "7"}) {
            const auto file = folder.path() / (threads + "." + extension);
            run(folder, {"render", scene, "-o", file, "--size", "160x128", "--threads", threads});
            files.push_back(text_of(file));
        }
        CHECK(files[0].size() > 1000);
        CHECK(files[0] == files[1]);
        CHECK(files[0] == files[2]);
    }
    // A window holds what the whole picture has there, and knows where it lies; at a fixed number of samples
    // and with samples where they are needed.
    for (const std::string error : {"0", "0.02"}) {
        const auto whole = folder.path() / "whole.fits", part = folder.path() / "part.fits";
        run(folder, {"render", scene, "-o", whole, "--size", "160x128", "--error", error});
        run(folder, {"render", scene, "-o", part, "--size", "160x128", "--error", error, "--window",
                     "37,41,75x50", "--threads", "7"});
        const auto pixels = [](const std::string& file) {
            const std::size_t end = file.find("END     ");
            return file.substr((end / 2880 + 1) * 2880);
        };
        const std::string all = pixels(text_of(whole)), some = pixels(text_of(part));
        REQUIRE(some.size() >= std::size_t{75} * 50 * 4);
        bool same = true, dark = true;
        for (std::size_t y = 0; y < 50; ++y) {
            const std::string row = some.substr(y * 75 * 4, 75 * 4);
            same = same && row == all.substr(((y + 41) * 160 + 37) * 4, 75 * 4);
            dark = dark && row.find_first_not_of('\0') == std::string::npos;
        }
        CHECK(same);
        CHECK_FALSE(dark);
    }
    // OpenEXR: every channel, pixel for pixel, truth layers too.
    const auto whole = folder.path() / "whole.exr", part = folder.path() / "part.exr";
    run(folder, {"render", scene, "-o", whole, "--size", "160x128", "--layers"});
    run(folder, {"render", scene, "-o", part, "--size", "160x128", "--layers", "--window", "37,41,75x50",
                 "--threads", "7"});
    double light = 0;
    for (int channel = 0; channel < 12; ++channel) {
        INFO("channel " << channel);
        const obscura::images::Image all = obscura::images::read_image(whole, std::to_string(channel));
        const obscura::images::Image some = obscura::images::read_image(part, std::to_string(channel));
        REQUIRE(all.width == 160);
        REQUIRE(some.width == 75);
        REQUIRE(some.height == 50);
        int different = 0;
        for (std::int32_t y = 0; y < 50; ++y)
            for (std::int32_t x = 0; x < 75; ++x) {
                const double a = all.at(x + 37, y + 41), b = some.at(x, y);
                different += a == b || (std::isnan(a) && std::isnan(b)) ? 0 : 1;
                light += std::isnan(b) ? 0 : std::abs(b);
            }
        CHECK(different == 0);
    }
    CHECK(light > 0);
    run(folder,
        {"render", scene, "-o", folder.path() / "x.fits", "--size", "160x128", "--window", "150,0,20x20"},
        64);
    const auto report = nlohmann::json::parse(
        run(folder, {"render", scene, "-o", folder.path() / "x.exr", "--size", "80x64", "--json"}));
    CHECK(report["width"] == 80);
    CHECK(report["height"] == 64);
    CHECK(report["rays"] > 0);
    CHECK(report["noise_rms"] > 1e-4);
    CHECK(report["noise_rms"] < 0.1);
    // The same field in fewer pixels: the same light, to the sampling's precision.
    const auto larger = nlohmann::json::parse(
        run(folder, {"render", scene, "-o", folder.path() / "x.exr", "--size", "320x256", "--json"}));
    const double ratio = larger["total_w_m2"].get<double>() / report["total_w_m2"].get<double>();
    CHECK(std::abs(ratio - 1) < 0.02);
}

TEST_CASE("sequences, resumption and time budgets") {
    const TempFolder folder;
    const std::string scene = OBSCURA_SOURCE_DIR "/config/scenes/demo.toml";
    const auto render = [&](std::vector<std::string> more) {
        std::vector<std::string> arguments{
            "render", scene, "--size", "80x64", "--json", "-o", folder.path() / "f%02d.fits"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return nlohmann::json::parse(run(folder, arguments));
    };
    CHECK(render({"--frames", "3", "--step", "40"})["frames"] == 3);
    const std::string second = text_of(folder.path() / "f02.fits");
    CHECK(second.size() > 1000);
    CHECK(second != text_of(folder.path() / "f01.fits"));
    std::filesystem::remove(folder.path() / "f02.fits");
    const auto resumed = render({"--frames", "3", "--step", "40", "--resume"});
    CHECK(resumed["frames"] == 1);
    CHECK(resumed["present"] == 2);
    CHECK(text_of(folder.path() / "f02.fits") == second);
    // Passes average: more of them, less noise, the same mean.
    const auto once = nlohmann::json::parse(
        run(folder, {"render", scene, "--size", "80x64", "--json", "-o", folder.path() / "a.fits"}));
    const auto longer = nlohmann::json::parse(run(folder, {"render", scene, "--size", "80x64", "--json", "-o",
                                                           folder.path() / "b.fits", "--time-budget", "1"}));
    CHECK(longer["passes"] >= 1);
    CHECK(std::abs(longer["total_w_m2"].get<double>() / once["total_w_m2"].get<double>() - 1) < 0.02);
}

TEST_CASE("a flight image is imported, rendered from its header alone and compared") {
    const auto flight = data_file("flight_near_msi_eros/m0157063318f4_2p_iof_gbl.fit");
    const auto mesh = data_file("shapes_celestia49k/obj_km/eros_49k.obj");
    if (!flight || !mesh) return;
    const TempFolder folder;
    const std::string scene = folder.path() / "eros.toml", picture = folder.path() / "eros.fits";
    run(folder, {"import", "flight-image", *flight, "--shape", *mesh, "-o", scene});
    run(folder, {"render", scene, "-o", picture, "--samples", "4"});
    const auto report = nlohmann::json::parse(run(
        folder, {"compare", *flight, picture, "--max-shift", "0", "--min-correlation", "0.83", "--json",
                 "--picture", folder.path() / "side.png", "--residual", folder.path() / "residual.fits"}));
    CHECK(report["correlation"] >= 0.83);
    CHECK(report["pixels"] == 537 * 412);
    CHECK(std::filesystem::exists(folder.path() / "side.png"));
    // Facets of 200 m are 60 pixels here, and of edges only that of a shadow at grazing light is in the
    // picture: moved by some pixels it fits as well, along that edge by any number, and that is what is told
    // (the pose is held against the label in images_test).
    const auto moved = nlohmann::json::parse(run(folder, {"compare", *flight, picture, "--json"}));
    CHECK(moved["correlation"].get<double>() - report["correlation"].get<double>() < 0.02);
    CHECK(moved["shift_y_error_px"].is_null());
    // A picture that shows something else fails the same command.
    run(folder, {"compare", *flight, picture, "--max-shift", "0", "--min-correlation", "0.99"}, 1);
}

TEST_CASE("captures repeat to the byte, and a later frame does not need the earlier ones") {
    const TempFolder folder;
    const std::string config = small_configuration(folder);
    const auto frame = [&](const std::string& out, const std::string& name) {
        return text_of(folder.path() / out / name);
    };
    run(folder,
        {"capture", config, "-n", "4", "-o", folder.path() / "a", "--format", "raw", "--exr", "--preview"});
    run(folder, {"capture", config, "-n", "1", "--first", "3", "-o", folder.path() / "b", "--format", "raw"});
    CHECK(frame("a", "frame_000003.raw").size() == 64 * 64 * 2);
    CHECK(frame("a", "frame_000003.raw") == frame("b", "frame_000003.raw"));
    CHECK(frame("a", "frame_000003.toml") == frame("b", "frame_000003.toml"));
    CHECK(frame("a", "frame_000003.raw") != frame("a", "frame_000002.raw"));
    for (const char* name : {"ideal_000004.exr", "preview_000004.png"})
        CHECK(std::filesystem::exists(folder.path() / "a" / name));
}

TEST_CASE("previews come with captured frames, and PNG files are aligned on request") {
    const TempFolder folder;
    const std::string config = small_configuration(folder);
    const auto capture = [&](const char* out, std::vector<std::string> more, int status = 0) {
        more.insert(more.begin(), {"capture", config, "-o", folder.path() / out});
        run(folder, more, status);
        return folder.path() / out;
    };
    const auto plain = capture("plain", {}), without = capture("without", {"--no-preview"}),
               aligned = capture("aligned", {"--msb", "--stretch", "percentile:1,99", "--gamma", "1.8"});
    const images::Image preview = images::read_image(plain / "preview_000001.png");
    CHECK(preview.full_scale == 255);
    CHECK(*std::max_element(preview.values.begin(), preview.values.end()) > 250);
    CHECK(!std::filesystem::exists(without / "preview_000001.png"));
    CHECK(text_of(aligned / "preview_000001.png") != text_of(plain / "preview_000001.png"));
    const images::Image low = images::read_image(plain / "frame_000001.png"),
                        high = images::read_image(aligned / "frame_000001.png");
    CHECK_THAT(text_of(aligned / "frame_000001.png"), ContainsSubstring(std::string("MSBSHIFT\0004", 10)));
    bool shifted = true;
    for (std::size_t i = 0; i < low.values.size(); ++i)
        shifted = shifted && high.values[i] == 16 * low.values[i];
    CHECK(shifted);
    capture("bad", {"--stretch", "linear:2,1"}, 64);
    capture("bad", {"--msb", "--format", "fits"}, 64);
    capture("bad", {"--preview", "--no-preview"}, 64);
}

TEST_CASE("layers are rendered in false colour") {
    const TempFolder folder;
    const std::string scene = OBSCURA_SOURCE_DIR "/config/scenes/demo.toml";
    for (const char* layer : {"depth", "normal", "error", "body"}) {
        const auto file = folder.path() / (std::string(layer) + ".png");
        run(folder, {"render", scene, "-o", file, "--size", "80x64", "--samples", "4", "--layer", layer});
        CHECK(images::colour_planes(file).size() == 3);
        CHECK(images::read_image(file, "red").width > 80 * 4); // magnified, with its key
    }
    // Two images side by side with their difference: three panels, each magnified, and the bars.
    const auto image = [&](const char* name, const char* seed) {
        run(folder, {"render", scene, "-o", folder.path() / name, "--size", "80x64", "--seed", seed});
        return (folder.path() / name).string();
    };
    const std::string picture = folder.path() / "pair.png";
    run(folder, {"compare", image("a.fits", "1"), image("b.fits", "2"), "--picture", picture, "--stretch",
                 "asinh:0.05"});
    CHECK(images::colour_planes(picture).size() == 3);
    CHECK(images::read_image(picture, "red").width > 3 * 4 * 80);
    run(folder, {"render", scene, "-o", folder.path() / "a.exr", "--layer", "depth"}, 64);
    run(folder, {"render", scene, "-o", folder.path() / "a.png", "--layer", "mood"}, 64);
}

TEST_CASE("a later frame has the image lag of the frames before it") {
    const TempFolder folder;
    struct Case {
        const char* lag;
        int first;
    };
    // With 0.3 % the lag of the seven frames before counts: the capture begins with the fifth.
    for (const auto& [lag, first] : {Case{"0.2", 5}, Case{"0.003", 12}}) {
        CAPTURE(lag);
        DaemonOptions options;
        options.size = 64;
        options.more = std::string("[sensor.detector]\nlag = ") + lag + "\n";
        const std::string config = write_configuration(folder, options).string();
        const std::string last =
            "frame_" + std::string(first < 10 ? "00000" : "0000") + std::to_string(first);
        const auto text = [&](const std::string& out, const std::string& name) {
            return text_of(folder.path() / out / name);
        };
        const auto capture = [&](const std::string& configuration, int from, int frames, const char* out) {
            run(folder, {"capture", configuration, "-n", std::to_string(frames), "--first",
                         std::to_string(from), "-o", folder.path() / out, "--format", "raw"});
        };
        capture(config, 1, first, "all");
        capture(config, first, 1, "last");
        CHECK(text("all", last + ".raw") == text("last", last + ".raw"));
        CHECK(text("all", last + ".toml") == text("last", last + ".toml"));
        CHECK_THAT(text("all", "frame_000001.toml"), ContainsSubstring("NOLAG = true"));
        CHECK_THAT(text("last", last + ".toml"), ContainsSubstring("NOLAG = false"));
        options.more.clear();
        capture(write_configuration(folder, options).string(), first, 1, "without");
        CHECK(text("without", last + ".raw") != text("last", last + ".raw"));
    }
}

TEST_CASE("captures share no noise unless the run word of one is given to the other") {
    const TempFolder folder;
    std::string text = text_of(small_configuration(folder));
    const std::string word = "run = 0\n";
    text.erase(text.find(word), word.size());
    const std::string config = folder.write("random.toml", text).string();
    const auto capture = [&](const std::string& out, std::vector<std::string> more = {}) {
        more.insert(more.begin(),
                    {"capture", config, "-o", folder.path() / out, "--format", "raw", "--json"});
        return nlohmann::json::parse(run(folder, more))["run"].get<std::uint64_t>();
    };
    const auto pixels = [&](const std::string& out) {
        return text_of(folder.path() / out / "frame_000001.raw");
    };
    const std::uint64_t first = capture("first"), second = capture("second");
    CHECK(first != second); // but for once in 2^32
    std::size_t equal = 0;
    for (std::size_t i = 0; i + 1 < pixels("first").size(); i += 2)
        equal += pixels("first").compare(i, 2, pixels("second"), i, 2) == 0 ? 1 : 0;
    CHECK(equal < std::size_t{64 * 64} / 2); // black level with a few DN of noise
    CHECK(capture("replay", {"--run", std::to_string(first)}) == first);
    CHECK(pixels("replay") == pixels("first"));
    CHECK_THAT(text_of(folder.path() / "replay/frame_000001.toml"),
               ContainsSubstring("\nRUN = " + std::to_string(first) + " "));
    CHECK(capture("zero", {"--run", "0"}) == 0);
}

TEST_CASE("import ephemeris converts a big-endian kernel and refuses what is none") {
    const TempFolder folder;
    // A body at rest: one Chebyshev record.
    const DafSegment rest{"REST", {0, 100}, {-900, 0, 1, 2}, {50, 50, 1, 2, 3, 0, 100, 5, 1}};
    const auto big = folder.write("big.bsp", daf_bytes("SPK", {rest}, true));
    const std::string out = (folder.path() / "little.bsp").string();
    CHECK_THAT(run(folder, {"import", "ephemeris", big, "-o", out}),
               ContainsSubstring("bodies: 1, orientations: 0;"));
    CHECK(text_of(out).substr(88, 8) == "LTL-IEEE");
    const auto text = folder.write("text.txt", "no kernel");
    run(folder, {"import", "ephemeris", text, "-o", out}, 66);
    run(folder, {"import", "ephemeris", folder.path() / "none", "-o", out}, 66);
}

TEST_CASE("bench measures everything it promises and loses nothing") {
    const TempFolder folder;
    const auto report = nlohmann::json::parse(run(folder, {"bench", "--json", "--frames", "4", "--rate", "10",
                                                           "--config", small_configuration(folder)}));
    for (const char* key : {"rays_per_s", "samples_per_s", "render_ms_p50", "detector_ms_p50", "frame_ms_p50",
                            "transmit_ms_p50", "trigger_to_first_packet_ms_p50",
                            "trigger_to_first_packet_ms_p99", "trigger_to_complete_ms_p50"}) {
        INFO(key);
        REQUIRE(report[key].is_number());
        CHECK(report[key] > 0);
    }
    CHECK(report["frames"] == 4);
    CHECK(report["lost"] == 0);
}
