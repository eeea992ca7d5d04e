// obscura sensor and obscura characterise: the shipped chips measured through the command line, and a real
// camera's series.
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>

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
    CHECK_THAT(text, ContainsSubstring("Photon transfer"));
    CHECK_THAT(text, !ContainsSubstring("src="));
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
