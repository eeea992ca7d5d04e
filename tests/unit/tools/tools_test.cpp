// SPDX-License-Identifier: Apache-2.0
// The parts the verbs are made of.
#include "core/camera/frame.hpp"
#include "host/command_line.hpp"
#include "images/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/characterise/spectrogram.hpp"
#include "tools/check/report.hpp"
#include "tools/pictures/colour_map.hpp"
#include "tools/pictures/figure.hpp"
#include "tools/pictures/font.hpp"
#include "tools/pictures/layer_picture.hpp"
#include "tools/pictures/plot.hpp"
#include "tools/pictures/preview.hpp"
#include "tools/pictures/ticks.hpp"
#include "tools/receive/frame_chunks.hpp"
#include "tools/receive/receiver.hpp"
#include "tools/receive/sequence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <utility>

namespace tools_test {

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
    host::CommandLine line;
    line.positional("SCENE", &scene, "a scene");
    line.option("-o,--output", &output, "FILE", "a file").required = true;
    line.option("--format", &format, "F", "a format").choices = {"png", "raw"};
    line.number("-n,--frames", &frames, "N", "a number", 1, 10);
    line.number("--rate", &rate, "HZ", "a rate", -1, 100);
    line.flag("--json", json, "a flag");
    const auto complaint = [&](std::vector<std::string> arguments) -> std::string {
        try {
            (void)line.parse("verb", arguments);
        } catch (const host::UsageError& error) {
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
    host::parse_size("640x512", width, height);
    CHECK(width == 640);
    CHECK(height == 512);
    for (const char* bad :
         {"", "x", "640", "640x", "x512", "0x5", "-1x5", "6.5x5", "640x512x3", "70000x5", " 1x1"})
        CHECK_THROWS_AS(host::parse_size(bad, width, height), host::UsageError);
}

TEST_CASE("sequences number their files") {
    CHECK(numbered("a_%04d.png", 7) == "a_0007.png");
    CHECK(numbered("%d", 12345) == "12345");
    for (const char* bad : {"a.png", "a%s.png", "a%d%d", "a%", "a%3", "a%-3d", "a%d%%", "a%99d"})
        CHECK_THROWS_AS(numbered(bad, 1), host::UsageError);
    CHECK(sequence("a.png", {3}).at(0).file == "a.png");
    const auto frames = sequence("a%d.png", {0, 0.5, 2});
    REQUIRE(frames.size() == 3);
    CHECK(frames[2].number == 3);
    CHECK(frames[2].time_s == 2);
    CHECK(frames[2].file == "a3.png");
    CHECK_THROWS_AS(sequence("a.png", {0, 1}), host::UsageError);
}

TEST_CASE("previews are black at the background, white at the brightest, and keep the order") {
    std::vector<float> image(1000, 1.0F);
    for (std::size_t i = 0; i < 100; ++i)
        image[i] = 1.0F + static_cast<float>(i);
    const std::vector<std::uint8_t> picture = host::stretched(image, {});
    CHECK(picture[500] == 0);
    CHECK(picture[99] == 255);
    for (std::size_t i = 1; i < 100; ++i)
        CHECK(picture[i] >= picture[i - 1]);
    CHECK(picture[50] > 127); // brighter than linear
    const std::vector<std::uint8_t> flat = host::stretched(std::vector<float>(10, 5.0F), {});
    CHECK(flat == std::vector<std::uint8_t>(10, 0));
    CHECK(host::stretched({}, {}).empty());
}

TEST_CASE("each stretch has its curve, with and without parameters") {
    const auto level = [](const char* text, double value, double gamma = 1) {
        // Quantiles of numbers spread evenly over 100 .. 1100, of which 4095 is the largest possible.
        const host::ToneCurve curve(
            host::Stretch::parse("verb", text, gamma), [](double part) { return 100 + 1000 * part; }, 4095);
        return curve.level(value);
    };
    using Catch::Matchers::WithinAbs;
    CHECK_THAT(level("linear", 4095.0 / 2), WithinAbs(0.5, 1e-9));
    CHECK_THAT(level("linear:100,300", 150), WithinAbs(0.25, 1e-9));
    CHECK(level("linear:100,300", 50) == 0);
    CHECK(level("linear:100,300", 400) == 1);
    CHECK_THAT(level("percentile:10,90", 600), WithinAbs(0.5, 1e-9));
    CHECK_THAT(level("percentile:10,90", 200), WithinAbs(0, 1e-9));
    CHECK_THAT(level("percentile", 1095), WithinAbs(1, 1e-9));
    // asinh(1/2 / s) / asinh(1 / s) and log(1 + R/2) / log(1 + R) at half of black to white, by hand.
    const double half = (150 + 1099.9) / 2;
    CHECK_THAT(level("asinh:0.1", half), WithinAbs(2.3124383 / 2.9982230, 1e-6));
    CHECK_THAT(level("log:100", half), WithinAbs(3.9318256 / 4.6151205, 1e-6));
    CHECK_THAT(level("linear:100,300", 150, 2), WithinAbs(0.5, 1e-9)); // gamma 2: the root of 1/4
    for (const char* bad :
         {"", "liner", "linear:", "linear:1", "linear:3,1", "linear:1,2,3", "percentile:-1,50",
          "percentile:0,101", "asinh:0", "asinh:nan", "log:0.5", "auto:1", "log:1e10"})
        CHECK_THROWS_AS(host::Stretch::parse("verb", bad, 1), host::UsageError);
}

TEST_CASE("previews of frames mark windows and padding, and only these need colour") {
    const test::TempFolder folder;
    // Two windows, 20 x 8 and 12 x 8, one below the other; the padding holds nonsense.
    std::vector<std::uint16_t> pixels(20 * 16);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        pixels[i] = static_cast<std::uint16_t>(i / 20 >= 8 && i % 20 >= 12 ? 60000 : 100 + i % 20);
    const auto write = [&](const char* name, const std::vector<Region>& windows, int rows) {
        write_preview(folder.path() / name,
                      {20, rows, 12, std::span(pixels).first(static_cast<std::size_t>(20 * rows)), windows},
                      host::Stretch::parse("verb", "percentile:0,100", 1));
        return folder.path() / name;
    };
    const auto marked = write("marked.png", {{0, 0, 20, 8}, {0, 8, 12, 8}}, 16);
    REQUIRE(images::colour_planes(marked).size() == 3);
    const images::Image red = images::read_image(marked, "red"), blue = images::read_image(marked, "blue");
    for (const auto& [x, y] : {std::pair{0, 0}, {19, 4}, {5, 8}, {11, 12}, {3, 15}}) { // outlines: orange
        CHECK(red.at(x, y) == 255);
        CHECK(blue.at(x, y) == 0);
    }
    for (const auto& [x, y] : {std::pair{14, 10}, {18, 15}, {12, 8}}) // padding: blue
        CHECK(blue.at(x, y) > red.at(x, y));
    for (const auto& [x, y] : {std::pair{10, 4}, {6, 11}}) { // grey, of the windows' own contrast
        CHECK(red.at(x, y) == blue.at(x, y));
        CHECK(red.at(x, y) == std::lround(255 * x / 19.0));
    }
    CHECK(images::colour_planes(write("one.png", {{0, 0, 20, 8}}, 8)).size() == 1);
    CHECK(images::colour_planes(write("unknown.png", {}, 16)).size() == 1);
}

TEST_CASE("ticks are round numbers inside the range") {
    using Values = std::vector<double>;
    CHECK(round_ticks(0, 1, 6) == Values{0, 0.2, 0.4, 0.6000000000000001, 0.8, 1});
    CHECK(round_ticks(-3.7, 12, 5) == Values{0, 5, 10});
    CHECK(round_ticks(5, 5, 5).empty());
    CHECK(decade_ticks(0.5, 2000) == Values{1, 10, 100, 1000});
    CHECK(decade_ticks(15, 300).size() == 4); // 20, 50, 100, 200
    CHECK(tick_labels({1000.1, 1000.2}) == std::vector<std::string>{"1000.1", "1000.2"});
    CHECK(tick_labels({50000, 150000, 2e6}) == std::vector<std::string>{"50000", "150000", "2e+06"});
    CHECK(tick_labels({0, 0.5}) == std::vector<std::string>{"0", "0.5"});
    const auto logarithmic = [](double v) { return std::log1p(v) / std::log1p(10000.0); };
    const Values spread = spread_ticks(0, 10000, logarithmic, 0.1);
    for (const double decade : {0.0, 10.0, 100.0, 1000.0, 10000.0})
        CHECK(std::find(spread.begin(), spread.end(), decade) != spread.end());
    for (std::size_t i = 1; i < spread.size(); ++i)
        CHECK(logarithmic(spread[i]) - logarithmic(spread[i - 1]) >= 0.1 - 1e-12);
}

TEST_CASE("panels have their title, image and colour bar side by side") {
    // Every character has its own shape, and one that is missing is a question mark.
    REQUIRE(glyphs("a\u00b2?\u4e00").size() == 4);
    CHECK(glyphs("\u4e00")[0] == glyphs("?")[0]);
    CHECK(glyphs("a")[0]->rows != glyphs("b")[0]->rows);
    Panel panel{"title", 40, 40, std::vector<Rgb>(1600, Rgb{1, 2, 3}), {}, {}};
    const Canvas plain = draw_panels({panel});
    panel.scale = ColourScale{ColourMap::viridis, 0, 10, "km", {}};
    const Canvas with_bar = draw_panels({panel});
    CHECK(with_bar.width() > plain.width());
    CHECK(with_bar.height() == plain.height());
    const auto has = [](const Canvas& canvas, Rgb wanted) {
        for (std::int32_t y = 0; y < canvas.height(); ++y)
            for (std::int32_t x = 0; x < canvas.width(); ++x)
                if (canvas.at(x, y) == wanted) return true;
        return false;
    };
    CHECK(has(plain, {1, 2, 3}));
    for (const double level : {0.02, 0.5, 0.98}) {
        bool near = false;
        const Rgb wanted = colour(ColourMap::viridis, level);
        for (std::int32_t y = 0; y < with_bar.height() && !near; ++y)
            for (std::int32_t x = 0; x < with_bar.width() && !near; ++x)
                near = std::abs(with_bar.at(x, y)[0] - wanted[0]) < 4 &&
                       std::abs(with_bar.at(x, y)[1] - wanted[1]) < 4 &&
                       std::abs(with_bar.at(x, y)[2] - wanted[2]) < 4;
        CHECK(near);
    }
    // Brightness rises along the map, so that it reads in grey as well.
    double before = -1;
    for (double level = 0; level <= 1; level += 0.05) {
        const Rgb c = colour(ColourMap::viridis, level);
        const double brightness = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        CHECK(brightness > before);
        before = brightness;
    }
}

TEST_CASE("chunks that are missing, short or overlong are refused by name") {
    // All chunks as zeros, long enough; the ids are those of core/camera/frame_record.cpp.
    constexpr std::uint32_t first = 0x4F420001, regions = first + 11, rows = first + 12, truth = first + 13;
    std::map<std::uint32_t, std::vector<std::uint8_t>> chunks;
    for (std::uint32_t k = 0; k < chunk_count; ++k)
        chunks[first + k] = std::vector<std::uint8_t>(4096);
    const auto complaint = [&]() -> std::string {
        try {
            (void)parse_chunks([&](std::uint32_t id) { return std::span<const std::uint8_t>(chunks[id]); });
        } catch (const InputError& error) {
            return error.what();
        }
        return "none";
    };
    CHECK(complaint() == "none");
    using Catch::Matchers::ContainsSubstring;
    for (std::uint32_t k = 0; k < chunk_count; ++k) {
        const auto kept = std::exchange(chunks[first + k], std::vector<std::uint8_t>(3));
        CHECK_THAT(complaint(), ContainsSubstring(std::string(name_of(static_cast<Chunk>(k)))));
        chunks[first + k] = kept;
    }
    // Counts beyond what there can be, or beyond the bytes that came.
    for (const auto& [id, count] : {std::pair<std::uint32_t, std::uint8_t>{regions, 33}, {rows, 255}}) {
        chunks[id][3] = count, chunks[id].resize(4000);
        if (id == rows) chunks[id].resize(100);
        CHECK(complaint() != "none");
        chunks[id].assign(4096, 0);
    }
    chunks[truth].resize(104 + 16 * 88 + 48 + 8 + 16 * 8 - 1); // one byte less than its contents
    CHECK_THAT(complaint(), ContainsSubstring("GroundTruth"));
}

TEST_CASE("the quality of a frame is read from its chunk") {
    constexpr std::uint32_t first = 0x4F420001, quality = first + 18;
    std::map<std::uint32_t, std::vector<std::uint8_t>> chunks;
    for (std::uint32_t k = 0; k < chunk_count; ++k)
        chunks[first + k] = std::vector<std::uint8_t>(4096);
    // By the layout in core/camera/frame_record.cpp.
    std::vector<std::uint8_t>& bytes = chunks[quality];
    bytes.assign(488, 0);
    bytes[3] = 6, bytes[7] = 5, bytes[11] = 2, bytes[15] = 16, bytes[27] = 16;
    bytes[32] = 0x3F, bytes[33] = 0xA0;      // 2^-5 in binary64
    bytes[96 + 6] = 1, bytes[96 + 7] = 0x2C; // 300 us
    bytes[200] = 6, bytes[201] = 77;         // one of no level
    bytes[459] = 3;                          // instants
    bytes[480] = 0x3F, bytes[481] = 0xE0;    // 2^-1
    const FrameChunks read =
        parse_chunks([&](std::uint32_t id) { return std::span<const std::uint8_t>(chunks[id]); });
    CHECK(read.quality.level_max == QualityLevel::sixteenth);
    CHECK(read.quality.reasons == 5);
    CHECK(read.quality.groups == 2);
    CHECK(read.quality.rows_degraded == 16);
    CHECK(read.quality.error_rms == 0.03125F);
    CHECK(read.quality.budget_us == 300);
    CHECK(read.quality.instants == 3);
    CHECK(read.quality.noise_ratio_p95 == 0.5F);
    CHECK(read.quality.group_level[0] == QualityLevel::sixteenth);
    CHECK(read.quality.group_level[1] == QualityLevel::missing);
    CHECK_THAT(chunk_json(read, "a.fits"),
               Catch::Matchers::ContainsSubstring(R"("group_levels":["sixteenth","missing"])"));
    const images::Cards cards = chunk_cards(read);
    CHECK(std::any_of(cards.begin(), cards.end(), [](const images::Card& card) {
        return card.key == "QLEVEL" && images::card_text(card) == "sixteenth";
    }));
    bytes.resize(487);
    CHECK_THROWS_AS(parse_chunks([&](std::uint32_t id) { return std::span<const std::uint8_t>(chunks[id]); }),
                    InputError);
}

TEST_CASE("layers are shown in their units") {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> depth{12000, 15000, 20000, nan}, variance{4, 1, 0, 0}, light{100, 100, 5, 0},
        bodies{1, 2, 3, 0}, up{0, 0, 0, nan}, along{1, -1, 0, nan};
    const std::vector<images::FitsPlane> planes{{"depth_m", "m", depth}, {"variance", "", variance},
                                                {"body", "", bodies},    {"normal.x", "", along},
                                                {"normal.y", "", up},    {"normal.z", "", up}};
    const auto panel = [&](const char* name) {
        return layer_panel(name, {4, 1, planes, light, {"moon", "ship"}});
    };
    const Panel lengths = panel("depth");
    REQUIRE(lengths.scale);
    CHECK(lengths.scale->label == "km");
    CHECK(lengths.scale->low == 12);
    CHECK(lengths.scale->high == 20);
    CHECK(lengths.pixels[0] == colour(ColourMap::viridis, 0));
    CHECK(lengths.pixels[2] == colour(ColourMap::viridis, 1));
    CHECK(lengths.pixels[3] == no_value_colour);
    const Panel error = panel("error");
    REQUIRE(error.scale);
    CHECK(error.scale->low == 1); // %
    CHECK(error.scale->high == 2);
    CHECK(error.pixels[0] == colour(ColourMap::viridis, 1));
    CHECK(error.pixels[1] == colour(ColourMap::viridis, 0));
    CHECK(error.pixels[2] == no_value_colour);
    const Panel classes = panel("body");
    REQUIRE(classes.legend.size() == 3);
    CHECK(classes.legend[1].second == "2 ship");
    CHECK(classes.legend[2].second == "3 Sun");
    CHECK(classes.pixels[3] == no_value_colour);
    CHECK(panel("normal").pixels[0] == Rgb{255, 128, 128});
    CHECK(panel("normal").pixels[1] == Rgb{0, 128, 128});
}

TEST_CASE("spectrograms hold the amplitude of noise and find stripes") {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    using Catch::Matchers::WithinRel;
    // Lengths with small factors, a prime, and odd numbers of lines.
    for (const auto& size : {std::pair<std::size_t, std::size_t>{96, 45}, {101, 60}}) {
        const std::size_t width = size.first, height = size.second;
        CAPTURE(width, height);
        std::vector<double> values(width * height);
        for (double& v : values)
            v = 3 * normal(random);
        for (const bool along_rows : {true, false}) {
            const auto spectrum = spectrogram(values, width, along_rows);
            const std::size_t length = along_rows ? width : height, lines = along_rows ? height : width;
            REQUIRE(spectrum.size() == length / 2);
            // The definition, at one frequency.
            constexpr std::size_t f = 7;
            double power = 0;
            for (std::size_t k = 0; k < lines; ++k) {
                double re = 0, im = 0;
                for (std::size_t i = 0; i < length; ++i) {
                    const double angle =
                        2 * std::numbers::pi * static_cast<double>(f * i) / static_cast<double>(length);
                    const double v = along_rows ? values[k * width + i] : values[i * width + k];
                    re += v * std::cos(angle), im -= v * std::sin(angle);
                }
                power += (re * re + im * im) / static_cast<double>(length * lines);
            }
            CHECK_THAT(spectrum[f - 1].first,
                       WithinRel(static_cast<double>(f) / static_cast<double>(length), 1e-12));
            CHECK_THAT(spectrum[f - 1].second, WithinRel(std::sqrt(power), 1e-9));
            double mean = 0;
            for (const auto& [frequency, amplitude] : spectrum)
                mean += amplitude / static_cast<double>(spectrum.size());
            CHECK_THAT(mean, WithinRel(3.0, 0.1));
        }
        // Columns of period 8 stand out along the rows alone.
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] += std::sin(2 * std::numbers::pi / 8 * static_cast<double>(i % width));
        const auto highest = [&](bool along_rows) {
            const auto spectrum = spectrogram(values, width, along_rows);
            return *std::max_element(spectrum.begin(), spectrum.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
        };
        CHECK(std::abs(highest(true).first - 0.125) < 0.01);
        CHECK(highest(true).second > 4.5);
        CHECK(highest(false).second < 4.5);
    }
    CHECK(spectrogram({}, 0, true).empty());
}

TEST_CASE("plots have round ticks, powers of ten, a legend and marks") {
    Plot plot{"A < B", "x", "y", false, true, {}, {}};
    plot.series = {{"measured", Drawn::points, {{0.13, 1e-3}, {0.97, 1e7}, {0.5, 0}, {0.6, std::nan("")}}},
                   {"fit", Drawn::line, {{0.2, 1}, {0.9, 1e4}}}};
    plot.marks = {{0.5, "middle", false}};
    const std::string text = svg(plot);
    using Catch::Matchers::ContainsSubstring;
    for (const char* part :
         {">A &lt; B<", ">0.2<", ">0.4<", ">1<", "10<tspan dy=\"-5\" font-size=\"9\">6</tspan>", ">measured<",
          ">fit<", ">middle<", "</svg>"})
        CHECK_THAT(text, ContainsSubstring(part));
    CHECK_THAT(text, !ContainsSubstring("nan"));
    // Two points and the legend's sample: zero is not on a logarithmic axis.
    std::size_t circles = 0;
    for (std::size_t at = 0; (at = text.find("<circle", at)) != std::string::npos; ++at)
        ++circles;
    CHECK(circles == 3);
    CHECK_THAT(svg({"empty", "x", "y", true, true, {}, {}}), ContainsSubstring("</svg>"));
}

} // namespace tools_test
