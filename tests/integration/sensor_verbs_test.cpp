// SPDX-License-Identifier: Apache-2.0
// obscura sensor and obscura characterise: the shipped chips measured through the command line, and a real
// camera's series.
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>

namespace sensor_verbs_test {

using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;
using Json = nlohmann::json;

namespace {

const std::string program = OBSCURA_BINARY_DIR "/tools/obscura";

struct Result {
    std::string out, err;
};
Result run(const TempFolder& folder, std::vector<std::string> arguments, int expected = 0) {
    arguments.insert(arguments.begin(), program);
    ChildProcess child(folder.path(), "obscura", arguments);
    const int status = child.wait(250s).value_or(-1);
    Result result{child.out(), child.err()};
    INFO(result.out << result.err);
    REQUIRE(status == expected);
    return result;
}

} // namespace

TEST_CASE("the readout plan of the HAS2 as JSON, text and picture") {
    const TempFolder folder;
    const std::string svg = (folder.path() / "plan.svg").string();
    const Json full = Json::parse(
        run(folder, {"sensor", "plan", "has2", "--json", "--exposure-us", "66000", "--svg", svg}).out);
    CHECK(full["readout_ns"] == 217'907'200);
    CHECK(full["frame_period_ns"] == 217'907'200);
    CHECK(full["windows"][0]["rows"] == 1024);
    CHECK(full["windows"][0]["exposure_ns"]["requested"] == 66'000'000);
    CHECK(full["windows"][0]["exposure_ns"]["min"] == 311 * 212'800 - 2000);
    CHECK(full["windows"][0]["flags"] == Json::array({"T_QUANTISED"}));
    std::ifstream picture(svg);
    const std::string text((std::istreambuf_iterator<char>(picture)), {});
    CHECK_THAT(text, ContainsSubstring("<polyline"));
    const Json small =
        Json::parse(run(folder, {"sensor", "plan", "has2", "--json", "--windows", "500,500,20,20,100"}).out);
    CHECK(small["readout_ns"] == 240'000);
    CHECK_THAT(
        run(folder, {"sensor", "plan", "has3-like", "--windows", "0,0,20,20,100;0,10,300,300,15000"}).out,
        ContainsSubstring("ROW_SHARED"));
    CHECK_THAT(run(folder, {"sensor", "list"}).out, ContainsSubstring("imx-3.45um"));
    CHECK_THAT(run(folder, {"sensor", "show", "has2"}).out, ContainsSubstring("SSTL Rigel-L"));
    run(folder, {"sensor", "maps", "star250", "-o", folder.path().string()});
    CHECK(std::filesystem::file_size(folder.path() / "offset_e.fits") > 512 * 512 * 4);
}

TEST_CASE("impossible requests are refused with one line") {
    const TempFolder folder;
    CHECK_THAT(run(folder, {"sensor", "plan", "has2", "--windows", "1000,0,100,100,10"}, 78).err,
               ContainsSubstring("1024x1024"));
    CHECK_THAT(run(folder, {"sensor", "plan", "has2", "--windows", "1,0,100,100,10"}, 78).err,
               ContainsSubstring("OffsetX"));
    CHECK_THAT(run(folder, {"sensor", "plan", "has2", "--exposure-us", "0"}, 78).err,
               ContainsSubstring("ExposureTime"));
    CHECK_THAT(run(folder, {"sensor", "plan", "has2", "--exposure-us", "-5"}, 78).err,
               ContainsSubstring("ExposureTime"));
    CHECK_THAT(run(folder, {"sensor", "plan", "has2", "--windows", "1,2,3"}, 64).err,
               ContainsSubstring("--windows"));
    CHECK_THAT(run(folder, {"sensor", "show", "nosuch"}, 66).err, ContainsSubstring("star250"));
    CHECK_THAT(run(folder, {"characterise"}, 64).err, ContainsSubstring("--preset"));
    CHECK_THAT(run(folder, {"characterise", "--series", "/nowhere"}, 66).err,
               ContainsSubstring("EMVA1288_Data.txt"));
    std::ofstream(folder.path() / "empty.toml").close();
    CHECK_THAT(run(folder, {"sensor", "show", (folder.path() / "empty.toml").string()}, 78).err,
               ContainsSubstring("empty"));
}

TEST_CASE("characterise recovers what each shipped sensor is made of") {
    const TempFolder folder;
    const std::string name = GENERATE("has2", "has3-like", "generic", "imx-3.45um", "cmv4000", "star250");
    const std::string html = (folder.path() / "report.html").string();
    const Json report =
        Json::parse(run(folder, {"characterise", "--preset", name, "--json", "-o", html}).out);
    INFO(name << report.dump(1));
    const auto check = [&](const char* parameter, double tolerance) {
        const Json& p = report["parameters"][parameter];
        REQUIRE(p.contains("true"));
        CHECK_THAT(p["measured"].get<double>(), WithinRel(p["true"].get<double>(), tolerance));
    };
    check("gain", 0.01);
    check("dark_noise", 0.02);
    check("dsnu", 0.03);
    check("prnu", 0.03);
    check("dark_current", 0.03);
    check("saturation", 0.01);
    std::ifstream page(html);
    const std::string text((std::istreambuf_iterator<char>(page)), {});
    for (const char* shown : {"Photon transfer", "Test conditions", "550 nm", "Overall system gain", ">pass<",
                              "PASS: ", "Horizontal spectrogram PRNU"})
        CHECK_THAT(text, ContainsSubstring(shown));
    CHECK_THAT(text, !ContainsSubstring("FAIL"));
    CHECK(report["conditions"]["Bit depth"].get<std::string>().ends_with(" bit"));
    CHECK(report["parameters"]["gain"]["pass"] == true);
    CHECK_THAT(text, !ContainsSubstring("src="));
}

namespace {

/// A camera before a wall that fills its view and shines with `radiance`, W/m2/sr.
DaemonOptions before_a_wall(const TempFolder& folder, int number, double radiance) {
    DaemonOptions options;
    options.address = own_address(number);
    options.size = 256;
    options.scene = folder
                        .write("wall.toml", fmt::format(R"(
[sun]
direction = [0, 0, -1]
distance_au = 100
[camera]
focal_length_mm = 50
aperture_mm = 25
position_m = [0, 0, 0]
orientation = [1, 0, 0, 0]
[[body]]
shape = "polygons"
faces_m = [[[-9, -9, 50], [-9, 9, 50], [9, 9, 50], [9, -9, 50]]]
material = "lambert"
albedo = 0
emission_w_m2_sr = [{}]
)",
                                                        radiance))
                        .string();
    options.more = R"(shutter = "global"
[sensor.detector]
gain_dn_per_e = 0.08
full_well_e = 48000
read_noise_e = 12
prnu_local = 0.01
dark_current_e_per_s = 20000
)";
    return options;
}

} // namespace

TEST_CASE("characterise recovers gain, saturation and PRNU of a running camera") {
    const TempFolder folder;
    const DaemonOptions options = before_a_wall(folder, 1, 1.5);
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const std::string html = (folder.path() / "report.html").string();
    const Json report = Json::parse(run(folder, {"characterise", "--camera", options.address, "--levels",
                                                 "14", "--packet-size", "8000", "--json", "-o", html})
                                        .out);
    INFO(report.dump(1));
    const auto measured = [&](const char* name) {
        CHECK(!report["parameters"][name].contains("true"));
        return report["parameters"][name]["measured"].get<double>();
    };
    CHECK_THAT(measured("gain"), WithinRel(0.08, 0.015));
    CHECK_THAT(measured("saturation"), WithinRel(48'000.0, 0.03));
    CHECK_THAT(measured("prnu"), WithinRel(1.0, 0.05));
    CHECK(!report["parameters"].contains("quantum_efficiency"));
    CHECK(!report["parameters"].contains("dark_noise"));
    CHECK(std::filesystem::file_size(html) > 10'000);
    run(folder, {"characterise", "--camera", options.address, "--preset", "has2"}, 64);
}

TEST_CASE("characterise recovers dark noise and dark current of a running camera with the cap on") {
    const TempFolder folder;
    const DaemonOptions options = before_a_wall(folder, 2, 0);
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    const Json report =
        Json::parse(run(folder, {"characterise", "--camera", options.address, "--dark", "--gain", "0.08",
                                 "--most-us", "20000", "--levels", "6", "--packet-size", "8000", "--json"})
                        .out);
    INFO(report.dump(1));
    const auto measured = [&](const char* name) {
        return report["parameters"][name]["measured"].get<double>();
    };
    CHECK_THAT(measured("dark_noise"), WithinRel(12.0, 0.02));
    CHECK_THAT(measured("dark_current"), WithinRel(20'000.0, 0.02));
    // Without light there is no photon transfer.
    CHECK_THAT(run(folder,
                   {"characterise", "--camera", options.address, "--most-us", "2000", "--levels", "6",
                    "--packet-size", "8000"},
                   69)
                   .err,
               ContainsSubstring("light"));
}

TEST_CASE("characterise finds gain and responsivity of a real CCD camera") {
    const auto folder_of_data = data_file("emva1288/EMVA1288_ReferenceSet_001_CCD_12Bit");
    if (!folder_of_data) return;
    const TempFolder folder;
    const Json report =
        Json::parse(run(folder, {"characterise", "--series", folder_of_data->string(), "--json"}).out);
    CHECK_THAT(report["parameters"]["gain"]["measured"].get<double>(), WithinRel(0.28, 0.03));
    CHECK_THAT(report["parameters"]["responsivity"]["measured"].get<double>(), WithinRel(0.125, 0.03));
    CHECK(!report["parameters"]["gain"].contains("true"));
}

} // namespace sensor_verbs_test
