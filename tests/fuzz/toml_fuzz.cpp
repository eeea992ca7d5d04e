// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a configuration, scene or sensor file from anywhere. Whatever it holds, it is read or
// refused in one line; what was read can be printed, and the print is a configuration again.
#include "core/error.hpp"
#include "emulator/config/daemon_config.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "sensors/sensor_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

using namespace obscura;
using test::require;

namespace {

/// With the scene "scene.toml" in it.
struct Folder : test::ScratchFolder {
    Folder() {
        (void)write("scene.toml",
                    "[sun]\ndirection = [-1, 0, 0]\ndistance_au = 1\n[camera]\n"
                    "width = 64\nheight = 48\nfocal_length_mm = 25\n"
                    "aperture_mm = 12.5\nposition_m = [0, 0, -5000]\n"
                    "boresight = [0, 0, 1]\nup = [0, 1, 0]\n[[body]]\n"
                    "name = \"ball\"\nshape = \"ellipsoid\"\nradii_m = [1000, 1000, 1000]\nalbedo = 0.3\n"
                    "[[band]]\nfrom_nm = 400\nto_nm = 900\n");
    }
};

/// Runs `read`; a refusal has a line for each mistake, without control characters.
template<typename Read>
void try_to(Read read) {
    try {
        read();
    } catch (const Error& error) {
        const std::string_view what = error.what();
        require(!what.empty());
        for (const char c : what)
            require((static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) || c == '\n');
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Folder folder;
    const std::filesystem::path file =
        folder.write("input.toml", {reinterpret_cast<const char*>(data), size});
    try_to([&] { (void)scene::load_scene(file); });
    try_to([&] { (void)sensors::load_sensor(file); });
    std::optional<emulator::DaemonConfig> config;
    try_to([&] { config = emulator::load_config(file); });
    if (!config) return 0;
    for (const emulator::DaemonConfig* camera : config->cameras())
        (void)emulator::camera_settings(*camera);
    // A refusal of this one is a bug.
    const std::string printed = emulator::print_config(*config);
    require(emulator::print_config(emulator::load_config(folder.write("input.toml", printed))) == printed);
    return 0;
}
