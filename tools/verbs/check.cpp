// SPDX-License-Identifier: Apache-2.0
// Verb `obscura check`: validation of a configuration or scene file.
#include "emulator/assemble.hpp"
#include "emulator/config/daemon_config.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cstdio>

namespace obscura::tools {
namespace {

class Check final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "checks a configuration or a scene without starting anything";
        line.description =
            "Reads a daemon configuration with its sensor and scene files, or with --scene a scene file "
            "alone, and reports each mistake in one line: FILE:LINE:COLUMN: KEY: what is wrong, what is "
            "allowed. Opens no device and no socket.";
        line.positional("FILE", &file_, "Daemon configuration (TOML), or a scene file with --scene");
        line.flag("--scene", scene_, "Treat FILE as a scene file");
        line.flag("--print", print_,
                  "Print the effective configuration: every key with its value, unit, range and meaning");
        line.examples = {"obscura check config/demo.toml", "obscura check --scene config/scenes/demo.toml",
                         "obscura check --print config/demo.toml > full.toml"};
    }

    int run() override {
        if (scene_) {
            if (print_)
                throw UsageError("obscura check: --print goes with a configuration, not with --scene");
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
