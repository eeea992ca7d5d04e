// SPDX-License-Identifier: Apache-2.0
// Share and time left of a start.
#include "emulator/daemon/start_progress.hpp"
#include "tests/support/catch.hpp"

namespace start_progress_test {

using namespace obscura;
using emulator::StartProgress;

namespace {

Time at(double seconds) {
    return Time{static_cast<std::int64_t>(seconds * 1e9)};
}

} // namespace

TEST_CASE("the time left is that of the rest at the pace so far") {
    StartProgress progress;
    progress.note("scene", {}, at(100));
    CHECK(progress.report().text() == "starting: scene");
    CHECK_FALSE(progress.report().share);
    progress.note("tiles", 0, at(200));
    CHECK(progress.report().text() == "starting: tiles 0 %");
    progress.note("tiles", 0.4, at(360)); // 160 s for 40 %: 240 s for the rest
    CHECK(progress.report().text() == "starting: tiles 40 %, 4 min left");
    CHECK(std::abs(*progress.report().left_s - 240) < 1e-9);
    progress.note("tiles", 0.9, at(560)); // 360 s for 90 %
    CHECK(progress.report().text() == "starting: tiles 90 %, 40 s left");
    progress.note("first frame", 0, at(561));
    CHECK(progress.report().text() == "starting: first frame 0 %");
    progress.note("cameras", {}, at(562));
    CHECK(progress.report().text() == "starting: cameras");
}

TEST_CASE("a step that was found half done is timed by what it has done since") {
    StartProgress progress;
    progress.note("tiles", 0.5, at(10));
    CHECK_FALSE(progress.report().left_s);
    progress.note("tiles", 0.75, at(30));
    CHECK(std::abs(*progress.report().left_s - 20) < 1e-9);
}

TEST_CASE("hours are told as such, and shares stay within 0 and 1") {
    StartProgress progress;
    progress.note("tiles", -1, at(0));
    CHECK(*progress.report().share == 0);
    progress.note("tiles", 0.01, at(100)); // 9900 s for the rest
    CHECK(progress.report().text() == "starting: tiles 1 %, 3 h left");
    progress.note("tiles", 2, at(110));
    CHECK(*progress.report().share == 1);
}

} // namespace start_progress_test
