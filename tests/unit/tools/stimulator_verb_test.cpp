// SPDX-License-Identifier: Apache-2.0
// obscura stimulator: the patterns, taken as captures of a perfect camera, calibrate to the identity.
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/verbs/verb.hpp"
#include "transports/stimulator/calibration_table.hpp"

#include <cmath>

namespace stimulator_verb_test {

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::ContainsSubstring;

namespace {

int run(const std::vector<std::string>& arguments) {
    const auto verb = make_stimulator();
    host::CommandLine line;
    verb->declare(line);
    REQUIRE(line.parse("stimulator", arguments));
    return verb->run();
}

std::string refused(const std::vector<std::string>& arguments) {
    try {
        (void)run(arguments);
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

} // namespace

TEST_CASE("Pictures written by the patterns action calibrate to the identity") {
    const test::TempFolder folder;
    const std::string pictures = (folder.path() / "pictures").string(),
                      table = (folder.path() / "t.fits").string();
    const std::vector<std::string> common{"--size", "160x120", "--ramp", "9", "--dot-step", "16", "-o"};
    auto arguments = common;
    arguments.insert(arguments.begin(), "patterns");
    arguments.push_back(pictures);
    REQUIRE(run(arguments) == exit_ok);
    arguments = common;
    arguments.insert(arguments.begin(), "calibrate");
    arguments.insert(arguments.end(), {table, "--captures", pictures, "--json"});
    REQUIRE(run(arguments) == exit_ok);
    const auto t = transports::read_calibration(table);
    CHECK(t.screen_width == 160);
    CHECK(t.camera_height == 120);
    CHECK(t.dead.empty());
    for (double y = 0; y < 120; y += 7)
        for (double x = 0; x < 160; x += 7) {
            const auto c = t.map({x, y});
            CHECK(std::hypot(c.x - x, c.y - y) < 0.02);
        }
    REQUIRE(t.curve.size() == 9);
    for (const auto& point : t.curve)
        CHECK(std::abs(point.luminance - point.level / 255) < 1e-6);

    CHECK_THAT(refused({"calibrate", "--size", "160x120", "-o", table, "--captures", folder.path().string()}),
               ContainsSubstring("capture 'white' is missing"));
    CHECK_THAT(refused({"calibrate", "--size", "8x8", "-o", table}),
               ContainsSubstring("allowed 16 to 16384"));
    CHECK_THAT(refused({"patterns", "--size", "64x64"}), ContainsSubstring("--output is missing"));
}

} // namespace stimulator_verb_test
