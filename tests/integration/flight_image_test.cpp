// SPDX-License-Identifier: Apache-2.0
// Flight images and rectangular pixels on the command line: import, render, pointing fit, I/F, header cards.
#include "core/geometry.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <fitsio.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

namespace flight_image_test {

using namespace obscura;
using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double degree = std::numbers::pi / 180;

std::string run(const TempFolder& folder, std::vector<std::string> arguments, int expected = 0) {
    arguments.insert(arguments.begin(), OBSCURA_BINARY_DIR "/tools/obscura");
    ChildProcess child(folder.path(), "obscura", arguments);
    const int status = child.wait(100s).value_or(-1);
    INFO(child.err());
    REQUIRE(status == expected);
    return child.out();
}

double card(const std::string& file, const char* key) {
    fitsfile* fits = nullptr;
    int status = 0;
    double value = std::nan("");
    fits_open_diskfile(&fits, file.c_str(), READONLY, &status);
    fits_read_key(fits, TDOUBLE, key, &value, nullptr, &status);
    int ignored = 0;
    fits_close_file(fits, &ignored);
    CHECK(status == 0);
    return value;
}

/// The resampled frame with the lines of the raw format: each the mean of the 412 / 244 lines that it covers.
void write_raw_frame(const std::string& resampled, const std::string& raw) {
    fitsfile *from = nullptr, *to = nullptr;
    int status = 0;
    constexpr long width = 537, lines = 412, raw_lines = 244;
    std::vector<double> pixels(width * lines), out(width * raw_lines);
    fits_open_diskfile(&from, resampled.c_str(), READONLY, &status);
    fits_read_img(from, TDOUBLE, 1, width * lines, nullptr, pixels.data(), nullptr, &status);
    for (long y = 0; y < raw_lines; ++y) {
        const double top = static_cast<double>(y) * lines / raw_lines,
                     bottom = static_cast<double>(y + 1) * lines / raw_lines;
        for (long row = static_cast<long>(top); row < lines && static_cast<double>(row) < bottom; ++row) {
            const double share =
                std::min(bottom, static_cast<double>(row + 1)) - std::max(top, static_cast<double>(row));
            for (long x = 0; x < width; ++x)
                out[static_cast<std::size_t>(y * width + x)] +=
                    pixels[static_cast<std::size_t>(row * width + x)] * share * raw_lines / lines;
        }
    }
    fits_create_diskfile(&to, raw.c_str(), &status);
    fits_copy_header(from, to, &status);
    long size[2] = {width, raw_lines};
    fits_resize_img(to, FLOAT_IMG, 2, size, &status);
    fits_write_img(to, TDOUBLE, 1, width * raw_lines, out.data(), &status);
    fits_close_file(to, &status);
    fits_close_file(from, &status);
    REQUIRE(status == 0);
}

} // namespace

TEST_CASE("a raw flight frame is imported with its rectangular pixels, rendered and compared") {
    const auto flight = data_file("flight_near_msi_eros/m0157063318f4_2p_iof_gbl.fit");
    const auto mesh = data_file("shapes_celestia49k/obj_km/eros_49k.obj");
    if (!flight || !mesh) return;
    const TempFolder folder;
    const std::string raw = folder.path() / "raw.fit", resampled = *flight;
    write_raw_frame(*flight, raw);
    nlohmann::json reports[2];
    for (const bool is_raw : {false, true}) {
        const std::string name = is_raw ? "raw" : "resampled", scene = folder.path() / (name + ".toml"),
                          picture = folder.path() / (name + ".render.fits");
        run(folder, {"import", "flight-image", is_raw ? raw : resampled, "--shape", *mesh, "--utc",
                     "2001-02-08T17:24:42.2485", "-o", scene});
        CHECK((text_of(scene).find("pixel_pitch_y_um = 27\n") != std::string::npos) == is_raw);
        run(folder, {"render", scene, "-o", picture, "--samples", "4"});
        CHECK_THAT(card(picture, "XPIXSZ"), WithinRel(16, 1e-12));
        CHECK_THAT(card(picture, "YPIXSZ"), WithinRel(is_raw ? 27 : 16, 1e-12));
        CHECK_THAT(card(picture, "FY"), WithinRel(0.16685 / (is_raw ? 27e-6 : 16e-6), 1e-12));
        CHECK_THAT(card(picture, "CY"), WithinAbs(is_raw ? 121.5 : 205.5, 1e-12));
        reports[is_raw ? 1 : 0] =
            nlohmann::json::parse(run(folder, {"compare", is_raw ? raw : resampled, picture, "--max-shift",
                                               "0", "--scene", scene, "--json"}));
    }
    // The same correlation and brightness: the frames show the same field (2.95 by 2.26 degrees).
    CHECK(reports[1]["correlation"] >= 0.83);
    CHECK(std::abs(reports[1]["correlation"].get<double>() - reports[0]["correlation"].get<double>()) < 0.02);
    CHECK_THAT(reports[1]["i_over_f"].get<double>(), WithinRel(reports[0]["i_over_f"].get<double>(), 0.01));
    // The mean I/F in the label of the flight frame is 0.0407073, of a few pixels less.
    CHECK_THAT(reports[0]["reference_mean"].get<double>(), WithinRel(0.0407073, 2e-3));
    // The photometric model is of the published mean albedo: within a factor of two without any fit.
    // With w as at 550 nm, and 1.08 times the reflectance, it would be 0.590 of the frame's.
    CHECK(reports[0]["i_over_f"] > 0.597 * 0.0407);
    CHECK(reports[0]["i_over_f"] < 2 * 0.0407);
    run(folder, {"compare", raw, folder.path() / "raw.render.fits", "--pointing"}, 64);
    run(folder,
        {"compare", raw, folder.path() / "raw.render.fits", "--scene", folder.path() / "resampled.toml"}, 66);
}

TEST_CASE("the pointing of a camera is fitted, and the corrected attitude aligns its images") {
    const TempFolder folder;
    const auto scene_with = [&](const std::string& name, const std::string& orientation) {
        return folder
            .write(name, R"(
[sun]
direction = [-1, -1, 0.3]
[camera]
width = 160
height = 100
pixel_pitch_um = 10
pixel_pitch_y_um = 16
focal_length_mm = 100
aperture_mm = 25
psf_sigma_px = 0.7
position_m = [0, 0, -20000]
orientation = )" + orientation +
                             R"(
[[body]]
shape = "procedural"
mean_radius_m = 120
axis_ratios = [1, 0.9, 0.8]
seed = 3
subdivisions = 6
material = "lambert"
albedo = 0.2
)")
            .string();
    };
    // The second camera points 0.0172 degrees (3 columns) right, 0.0183 (2 rows) up, with 0.7 degrees of
    // roll.
    const Quat turn = axis_angle({0, 1, 0}, 0.0172 * degree) * axis_angle({1, 0, 0}, 0.0183 * degree) *
                      axis_angle({0, 0, 1}, 0.7 * degree);
    const auto text = [](Quat q) {
        return fmt::format("[{:.12f}, {:.12f}, {:.12f}, {:.12f}]", q.w, q.x, q.y, q.z);
    };
    const std::string wrong = scene_with("wrong.toml", text(Quat{})),
                      right = scene_with("right.toml", text(turn));
    for (const auto& [scene, picture] : {std::pair{wrong, "wrong.fits"}, {right, "right.fits"}})
        run(folder, {"render", scene, "-o", folder.path() / picture, "--samples", "16"});
    const auto report = nlohmann::json::parse(
        run(folder, {"compare", folder.path() / "right.fits", folder.path() / "wrong.fits", "--scene", wrong,
                     "--pointing", "--json"}));
    // A column is 0.0057 degrees.
    CHECK_THAT(report["pointing_right_deg"].get<double>(), WithinAbs(0.0172, 0.0003));
    CHECK_THAT(report["pointing_down_deg"].get<double>(), WithinAbs(-0.0183, 0.0003));
    CHECK_THAT(report["pointing_roll_deg"].get<double>(), WithinAbs(0.7, 0.03));
    CHECK(report["pointing_roll_error_deg"].get<double>() < 0.1);
    CHECK(report["correlation"] > 0.998);
    // Both are of one scene: I/F over W/m2 is one factor.
    CHECK_THAT(report["scale"].get<double>(), WithinRel(1, 0.01));
    const std::string corrected = scene_with("corrected.toml", report["orientation"].get<std::string>());
    run(folder, {"render", corrected, "-o", folder.path() / "corrected.fits", "--samples", "16"});
    const auto again = nlohmann::json::parse(
        run(folder, {"compare", folder.path() / "right.fits", folder.path() / "corrected.fits", "--json"}));
    CHECK(again["shift_px"].get<double>() < 0.05);
}

TEST_CASE("a line camera of one row is rendered and captured with both pitches in the headers") {
    const TempFolder folder;
    DaemonOptions options;
    options.size = 128;
    options.height = 1;
    options.more = "[sensor]\npixel_pitch_um = 4\npixel_pitch_y_um = 80\n";
    const std::string config = write_configuration(folder, options).string();
    run(folder, {"capture", config, "-n", "2", "-o", folder.path() / "out", "--format", "fits"});
    const std::string frame = folder.path() / "out" / "frame_000002.fits";
    CHECK(card(frame, "NAXIS1") == 128);
    CHECK(card(frame, "NAXIS2") == 1);
    CHECK_THAT(card(frame, "XPIXSZ"), WithinRel(4, 1e-12));
    CHECK_THAT(card(frame, "YPIXSZ"), WithinRel(80, 1e-12));
    CHECK_THAT(card(frame, "FOCALLEN"), WithinRel(50, 1e-12));
    CHECK_THAT(card(frame, "FX"), WithinRel(12500, 1e-12));
    CHECK_THAT(card(frame, "FY"), WithinRel(625, 1e-12));
    CHECK(card(frame, "CX") == 63.5);
    CHECK(card(frame, "CY") == 0);
    // The same file with pitches that are too far apart is refused at its place.
    options.more = "[sensor]\npixel_pitch_um = 4\npixel_pitch_y_um = 800\n";
    const std::string bad = write_configuration(folder, options).string();
    ChildProcess child(folder.path(), "check", {OBSCURA_BINARY_DIR "/tools/obscura", "check", bad});
    CHECK(child.wait(100s).value_or(-1) == 78);
    CHECK_THAT(child.err(), ContainsSubstring("sensor.pixel_pitch_y_um: 800 is out of range beside "
                                              "pixel_pitch_um = 4, allowed 0 or 0.125 to 128"));
}

TEST_CASE("I/F of a rendered Lambert disc at opposition is its albedo") {
    const TempFolder folder;
    const auto scene = folder.write("scene.toml", R"(
[sun]
direction = [0, 0, -1]
distance_au = 2.5
[camera]
width = 64
height = 40
pixel_pitch_um = 10
pixel_pitch_y_um = 16
focal_length_mm = 100
aperture_mm = 25
psf_sigma_px = 0
position_m = [0, 0, -20000]
orientation = [1, 0, 0, 0]
[[body]]
shape = "disc"
radius_m = 10000
material = "lambert"
albedo = 0.37
)");
    const std::string picture = folder.path() / "disc.fits";
    run(folder, {"render", scene, "-o", picture, "--samples", "4"});
    const auto report = nlohmann::json::parse(run(folder, {"compare", picture, picture, "--max-shift", "0",
                                                           "--no-offset", "--scene", scene, "--json"}));
    CHECK_THAT(report["i_over_f"].get<double>(), WithinRel(0.37, 2e-3));
    CHECK_THAT(report["i_over_f_scale"].get<double>() * report["reference_mean"].get<double>(),
               WithinRel(0.37, 5e-3));
}

} // namespace flight_image_test
