// SPDX-License-Identifier: Apache-2.0
// The parts the verbs are made of.
#include "core/frame.hpp"
#include "tests/support/catch.hpp"
#include "tools/support/command_line.hpp"
#include "tools/support/preview.hpp"
#include "tools/support/receiver.hpp"
#include "tools/support/report.hpp"
#include "tools/support/sequence.hpp"

#include <cmath>
#include <random>

using namespace obscura;
using namespace obscura::tools;

TEST_CASE("percentiles are nearest rank, whatever the order") {
    CHECK_FALSE(percentile({}, 50).has_value());
    CHECK(percentile({7}, 99) == 7);
    CHECK(percentile({15, 20, 35, 40, 50}, 30) == 20); // the textbook example of the nearest-rank method
    CHECK(percentile({50, 15, 40, 20, 35}, 50) == 35);
    CHECK(percentile({50, 15, 40, 20, 35}, 100) == 50);
    CHECK(percentile({50, 15, 40, 20, 35}, 0) == 15);
}

TEST_CASE("every pixel format that the camera packs is unpacked again") {
    std::mt19937 random(3);
    constexpr std::size_t count = 23; // ends inside a byte for the packed formats
    const std::pair<PixelFormat, int> formats[] = {
        {PixelFormat::mono8, 8},    {PixelFormat::mono10, 10}, {PixelFormat::mono12, 12},
        {PixelFormat::mono14, 14},  {PixelFormat::mono16, 16}, {PixelFormat::mono10p, 10},
        {PixelFormat::mono12p, 12},
    };
    for (const auto& [format, depth] : formats) {
        std::vector<std::uint16_t> pixels(count);
        for (std::uint16_t& p : pixels)
            p = static_cast<std::uint16_t>(random() & ((1u << depth) - 1));
        std::vector<std::uint8_t> wire(packed_bytes(format, count));
        pack_pixels(format, depth, pixels, wire);
        int bits = 0;
        CHECK(unpack_pixels(static_cast<std::uint32_t>(format), count, wire, bits) == pixels);
        CHECK(bits == depth);
        wire.pop_back();
        CHECK(unpack_pixels(static_cast<std::uint32_t>(format), count, wire, bits).empty()); // too short
    }
    int bits = 0;
    CHECK(unpack_pixels(0x02180014, 1, std::vector<std::uint8_t>(3), bits).empty()); // RGB8
}

TEST_CASE("Mono12p by hand: 0xABC, 0x123 are the bytes BC 3A 12") {
    int bits = 0;
    const std::vector<std::uint8_t> wire{0xBC, 0x3A, 0x12};
    CHECK(unpack_pixels(static_cast<std::uint32_t>(PixelFormat::mono12p), 2, wire, bits) ==
          std::vector<std::uint16_t>{0xABC, 0x123});
}

TEST_CASE("reports: a table for people, JSON for machines, missing values in both") {
    Report report;
    report.add("frames", "frames", std::int64_t{25});
    report.add("fps", "fps", 4.9996, "", 3);
    report.add("delay_ms", "delay, p50", std::nullopt, "ms", 3);
    report.add("output", "saved in", std::string_view("a \"b\""));
    CHECK(report.table() == "frames         25\n"
                            "fps         5.000\n"
                            "delay, p50      -\n"
                            "saved in    a \"b\"\n");
    CHECK(report.json() == "{\n  \"frames\": 25,\n  \"fps\": 4.9996,\n  \"delay_ms\": null,\n"
                           "  \"output\": \"a \\\"b\\\"\"\n}\n");
    // What is no number is missing.
    Report undefined;
    undefined.add("ratio", "ratio", std::nan(""), "", 3);
    CHECK(undefined.table() == "ratio  -\n");
    CHECK(undefined.json() == "{\n  \"ratio\": null\n}\n");
}

TEST_CASE("command lines fill their targets, and say what is wrong") {
    std::string scene, output, format = "png";
    std::uint64_t frames = 3;
    double rate = 0;
    bool json = false;
    CommandLine line;
    line.positional("SCENE", &scene, "a scene");
    line.option("-o,--output", &output, "FILE", "a file").required = true;
    line.option("--format", &format, "F", "a format").choices = {"png", "raw"};
    line.number("-n,--frames", &frames, "N", "a number", 1, 10);
    line.number("--rate", &rate, "HZ", "a rate", -1, 100);
    line.flag("--json", json, "a flag");
    const auto complaint = [&](std::vector<std::string> arguments) -> std::string {
        try {
            (void)line.parse("verb", arguments);
        } catch (const UsageError& error) {
            CHECK(error.status() == exit_usage);
            return error.what();
        }
        return "";
    };
    REQUIRE(line.parse("verb",
                       {"a.toml", "-o", "x", "--frames=7", "--rate", "-0.5", "--json", "--format", "raw"}));
    CHECK(scene == "a.toml");
    CHECK(output == "x");
    CHECK(frames == 7);
    CHECK(rate == -0.5);
    CHECK(json);
    CHECK(format == "raw");
    const std::string hint = " (try: obscura verb --help)";
    CHECK(complaint({"-o", "x"}) == "obscura verb: SCENE is missing" + hint);
    CHECK(complaint({"a"}) == "obscura verb: --output is missing" + hint);
    CHECK(complaint({"a", "-o", "x", "-n", "11"}) ==
          "obscura verb: --frames: \"11\" is not allowed, allowed 1 to 10" + hint);
    CHECK(complaint({"a", "-o", "x", "-n", "2.5"}).find("obscura verb: ") == 0);
    CHECK(complaint({"a", "-o", "x", "-n", "-1"}) ==
          "obscura verb: --frames: \"-1\" is not allowed, allowed 1 to 10" + hint);
    CHECK(complaint({"a", "-o", "x", "--rate", "nan"}) ==
          "obscura verb: --rate: \"nan\" is not allowed, allowed -1 to 100" + hint);
    CHECK(complaint({"a", "-o", "x", "--jsn"}) ==
          "obscura verb: unknown option \"--jsn\", did you mean \"--json\"?" + hint);
    CHECK(complaint({"a", "-o", "x", "b"}) == "obscura verb: unexpected argument \"b\"" + hint);
}

TEST_CASE("sizes") {
    std::int32_t width = 0, height = 0;
    parse_size("640x512", width, height);
    CHECK(width == 640);
    CHECK(height == 512);
    for (const char* bad :
         {"", "x", "640", "640x", "x512", "0x5", "-1x5", "6.5x5", "640x512x3", "70000x5", " 1x1"})
        CHECK_THROWS_AS(parse_size(bad, width, height), UsageError);
}

TEST_CASE("sequences number their files") {
    CHECK(numbered("a_%04d.png", 7) == "a_0007.png");
    CHECK(numbered("%d", 12345) == "12345");
    for (const char* bad : {"a.png", "a%s.png", "a%d%d", "a%", "a%3", "a%-3d", "a%d%%", "a%99d"})
        CHECK_THROWS_AS(numbered(bad, 1), UsageError);
    CHECK(sequence("a.png", {3}).at(0).file == "a.png");
    const auto frames = sequence("a%d.png", {0, 0.5, 2});
    REQUIRE(frames.size() == 3);
    CHECK(frames[2].number == 3);
    CHECK(frames[2].time_s == 2);
    CHECK(frames[2].file == "a3.png");
    CHECK_THROWS_AS(sequence("a.png", {0, 1}), UsageError);
}

TEST_CASE("previews are black at the background, white at the brightest, and keep the order") {
    std::vector<float> image(1000, 1.0F);
    for (std::size_t i = 0; i < 100; ++i)
        image[i] = 1.0F + static_cast<float>(i);
    const std::vector<std::uint8_t> picture = stretched(image);
    CHECK(picture[500] == 0);
    CHECK(picture[99] == 255);
    for (std::size_t i = 1; i < 100; ++i)
        CHECK(picture[i] >= picture[i - 1]);
    CHECK(picture[50] > 127); // brighter than linear
    const std::vector<std::uint8_t> flat = stretched(std::vector<float>(10, 5.0F));
    CHECK(flat == std::vector<std::uint8_t>(10, 0));
    CHECK(stretched({}).empty());
}
