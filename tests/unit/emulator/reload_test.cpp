// SPDX-License-Identifier: Apache-2.0
// Which keys two configurations differ in, and which of them a running daemon takes on.
#include "emulator/unit/reload.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

namespace reload_test {

using namespace obscura;
using namespace obscura::test;
using emulator::changed_keys;
using Keys = std::vector<std::string>;

namespace {

emulator::DaemonConfig configuration(const TempFolder& folder, const std::string& more) {
    folder.write("scene.toml", "[camera]\nfocal_length_mm = 50\naperture_mm = 25\n");
    return emulator::load_config(folder.write("daemon.toml", "[scene]\nfile = \"scene.toml\"\n" + more));
}

} // namespace

TEST_CASE("changed keys go by their names, elements of lists by their number") {
    const TempFolder folder;
    const std::string two =
        "[[camera]]\nexposure_us = 1000\n[camera.gige]\ninterface = \"127.0.0.8\"\n"
        "[[camera]]\nexposure_us = {}\n[camera.gige]\ninterface = \"127.0.0.9\"\nserial = \"TWO\"\n";
    const auto with = [&](const std::string& exposure, const std::string& more = "") {
        std::string text = two;
        return configuration(folder, text.replace(text.find("{}"), 2, exposure) + more);
    };
    const emulator::DaemonConfig before = with("2000");
    CHECK(changed_keys(before, before).empty());
    CHECK(changed_keys(before, with("3000")) == Keys{"camera[1].exposure_us"});
    const Keys with_fault =
        changed_keys(before, with("2000", "[[camera.gige.faults]]\nkind = \"lose\"\npercent = 1\n"));
    REQUIRE_FALSE(with_fault.empty());
    for (const std::string& key : with_fault)
        CHECK(key.rfind("camera[1].gige.faults[0].", 0) == 0);
}

TEST_CASE("a value that looks like another line of the file changes its own key only") {
    const TempFolder folder;
    const emulator::DaemonConfig before = configuration(folder, "[gige]\nuser_name = \"A\"\n"),
                                 after = configuration(folder, "[gige]\nuser_name = \"[trigger] x=1\"\n");
    CHECK(changed_keys(before, after) == Keys{"gige.user_name"});
}

TEST_CASE("the bench's clock may change while running, the camera may not") {
    CHECK(emulator::is_reloadable("trigger.rate_hz"));
    CHECK(emulator::is_reloadable("scene.file"));
    CHECK_FALSE(emulator::is_reloadable("trigger.over_trigger"));
    CHECK_FALSE(emulator::is_reloadable("camera.exposure_us"));
    CHECK_FALSE(emulator::is_reloadable("camera[1].trigger.rate_hz"));
}

} // namespace reload_test
