// SPDX-License-Identifier: Apache-2.0
// Verb `obscura check`: validation of a configuration, scene or sensor file.
#include "config/document.hpp"
#include "emulator/assemble.hpp"
#include "emulator/config/daemon_config.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/scene_files/scene_section.hpp"
#include "sensors/sensor_file.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>

namespace obscura::tools {
namespace {

enum class FileKind { configuration, scene, sensor };

/// Members of the root that `section` has a key, table or list for.
std::ptrdiff_t known_members(const config::Value& root, const config::Section& section) {
    return std::count_if(root.members.begin(), root.members.end(), [&](const config::Member& member) {
        const auto named = [&](const auto& item) { return item.name == member.key; };
        return std::any_of(section.keys.begin(), section.keys.end(), named) ||
               std::any_of(section.tables.begin(), section.tables.end(), named) ||
               std::any_of(section.lists.begin(), section.lists.end(), named);
    });
}

/// The kind of file that knows most of the root's keys and tables; a configuration where that is undecided.
FileKind kind_of(const std::filesystem::path& file) {
    const config::Value root = config::parse_file(file);
    emulator::DaemonConfig configuration;
    scene::Scene scene;
    SensorDescription sensor;
    FileKind kind = FileKind::configuration;
    std::ptrdiff_t most = known_members(root, emulator::root_section(configuration));
    const auto compare = [&](FileKind other, const config::Section& section) {
        const std::ptrdiff_t known = known_members(root, section);
        if (known > most) kind = other, most = known;
    };
    compare(FileKind::scene, scene::scene_section(scene));
    compare(FileKind::sensor, sensors::section_of(sensor));
    return kind;
}

class Check final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "checks a configuration, a scene or a sensor without starting anything";
        line.description =
            "Reads a daemon configuration with its sensor and scene files, or a scene file or sensor file "
            "alone, and reports each mistake in one line: FILE:LINE:COLUMN: KEY: what is wrong, what is "
            "allowed. The tables of the file tell which of them it is. Opens no device and no socket.";
        line.positional("FILE", &file_, "Daemon configuration, scene file or sensor file (TOML)");
        line.flag("--scene", scene_, "Treat FILE as a scene file, whatever its tables");
        line.flag("--print", print_,
                  "Print the effective configuration: every key with its value, unit, range and meaning");
        line.examples = {"obscura check config/demo.toml", "obscura check config/scenes/demo.toml",
                         "obscura check config/sensors/has2.toml",
                         "obscura check --print config/demo.toml > full.toml"};
    }

    int run() override {
        const FileKind kind = scene_ ? FileKind::scene : kind_of(file_);
        if (print_ && kind != FileKind::configuration)
            throw UsageError(fmt::format("obscura check: --print goes with a configuration; {} is a {} file",
                                         file_, kind == FileKind::scene ? "scene" : "sensor"));
        if (kind == FileKind::sensor) {
            const SensorDescription sensor = sensors::load_sensor(file_);
            fmt::print("{}: good: sensor {}, {} x {} px\n", file_, sensor.name, sensor.readout.width,
                       sensor.readout.height);
            return exit_ok;
        }
        if (kind == FileKind::scene) {
            const scene::Scene scene = scene::load_scene(file_);
            const renderer::Renderer built(scene, {});
            fmt::print("{}: good: {}\n", file_, describe(scene));
            return exit_ok;
        }
        const emulator::DaemonConfig config = emulator::load_config(file_);
        const emulator::Imaging built(config, 1);
        if (print_)
            std::fputs(emulator::print_config(config).c_str(), stdout);
        else
            fmt::print("{}: good: {}, sensor {} x {} px, scene {}\n", file_, config.sensor.name,
                       config.sensor.readout.width, config.sensor.readout.height, describe(config.scene));
        return exit_ok;
    }

private:
    static std::string describe(const scene::Scene& scene) {
        return fmt::format("\"{}\" with {} {}, {} {}, {} {}", scene.name, scene.bodies.size(),
                           scene.bodies.size() == 1 ? "body" : "bodies", scene.stars.size(),
                           scene.stars.size() == 1 ? "star" : "stars", scene.bands.size(),
                           scene.bands.size() == 1 ? "band" : "bands");
    }

    std::string file_;
    bool scene_ = false, print_ = false;
};

} // namespace

std::unique_ptr<Verb> make_check() {
    return std::make_unique<Check>();
}

} // namespace obscura::tools
