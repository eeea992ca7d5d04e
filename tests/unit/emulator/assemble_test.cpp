// SPDX-License-Identifier: Apache-2.0
// What a configuration asks for is a camera that can be.
#include "emulator/assemble.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

using namespace obscura;

TEST_CASE("The triggers of a camera begin with an edge that its line tells of") {
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
