// SPDX-License-Identifier: Apache-2.0
// Verb `obscura check`: validation and plausibility of a configuration, scene or sensor file.
#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "core/io/input_file.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/unit/assemble.hpp"
#include "host/interrupt.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/scene_files/scene_section.hpp"
#include "sensors/sensor_file.hpp"
#include "sensors/sensor_model.hpp"
#include "tools/check/camera_plausibility.hpp"
#include "tools/check/device_check.hpp"
#include "tools/check/report.hpp"
#include "tools/scene/progress.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

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
    void declare(host::CommandLine& line) override {
        line.summary = "checks a configuration, a scene or a sensor without starting anything";
        line.description =
            "Reads a daemon configuration with its sensor and scene files, or a scene file or sensor file alone, and reports each mistake in one line: "
            "FILE:LINE:COLUMN: KEY: what is wrong, what is allowed. "
            "The tables of the file tell which of them it is. "
            "For what is free of mistakes it prints figures to judge it by: field of view, extent, distance, size in pixels and phase angle of each body, stars in the field, the brightest expected signal, readout and rendering time. "
            "What is odd is a warning on standard error: what, the figure, and what to try; "
            "the exit status stays 0 without --strict. "
            "Signal and rendering time are estimated by rendering a frame, or for about 2 seconds as many of its rows as this machine can; "
            "with a terrain the first frame whole, whose tiles are made for it as obscura capture makes them, unless that takes more than 5 minutes. "
            "What is judged by a part of the rows says so. "
            "Opens no device and no socket without --devices.";
        line.positional(
            "FILE", &file_,
            "Daemon configuration, scene file or sensor file (TOML), or name of a shipped scene or sensor");
        line.flag("--scene", scene_, "Treat FILE as a scene file, whatever its tables");
        line.flag("--print", print_,
                  "Print the effective configuration: every key with its value, unit, range and meaning");
        line.flag("--quick", quick_, "Render nothing: no expected signal, no rendering time");
        line.flag("--strict", strict_, "Exit with status 1 if anything is odd");
        line.flag(
            "--devices", devices_,
            "Also try what the configuration needs of this machine, without starting the camera: network interface, ports, GPIO lines, device nodes, displays, folders, real-time permissions. "
            "Exit status 69 if the daemon could not start. "
            "Not while the daemon runs: what it holds is in use, and output lines become inactive");
        line.flag("--json", json_, "Print the figures, warnings and devices as one JSON object");
        line.examples = {"obscura check config/demo.toml", "obscura check config/scenes/demo.toml",
                         "obscura check has2", "obscura check --devices config/demo.toml",
                         "obscura check --print config/demo.toml > full.toml"};
    }

    int run() override {
        find_file();
        const FileKind kind = scene_ ? FileKind::scene : kind_of(file_);
        for (const auto& [given, name] : {std::pair(print_, "--print"), std::pair(devices_, "--devices")})
            if (given && kind != FileKind::configuration)
                throw host::UsageError(
                    fmt::format("obscura check: {} goes with a configuration; {} is a {} file", name, file_,
                                kind == FileKind::scene ? "scene" : "sensor"));
        if (print_ && (json_ || devices_))
            throw host::UsageError("obscura check: --print goes without --json and --devices");
        if (kind == FileKind::sensor) {
            const SensorDescription sensor = sensors::load_sensor(file_);
            sensor_warnings_ = sensors::sensor_model_warnings(sensor);
            return finish("sensor", fmt::format("sensor {}, {} x {} px", sensor.name, sensor.readout.width,
                                                sensor.readout.height));
        }
        if (kind == FileKind::scene) {
            scene::Scene scene = scene::load_scene(file_);
            const std::string summary = describe(scene);
            const renderer::Renderer built(std::move(scene), {});
            Plausibility view("", built, instants_of(built.scene(), 0));
            if (!quick_) estimate(view, built, estimate_s);
            judged_.push_back(std::move(view));
            return finish("scene", summary);
        }
        const emulator::DaemonConfig config = emulator::load_config(file_);
        if (print_) {
            const emulator::Imaging built(config, 1);
            std::fputs(emulator::print_config(config).c_str(), stdout);
            return exit_ok;
        }
        const std::vector<const emulator::DaemonConfig*> cameras = config.cameras();
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            const emulator::DaemonConfig& camera = *cameras[i];
            const emulator::Imaging built(camera, 1);
            Plausibility view =
                view_of_camera(config.several ? fmt::format("camera[{}]", i) : "", camera, built);
            view.add_times(times_of_camera(camera, built));
            for (std::string& line : sensors::sensor_model_warnings(camera.sensor))
                view.add_model(std::move(line));
            if (!quick_) estimate(view, camera, built, estimate_s / static_cast<double>(cameras.size()));
            judged_.push_back(std::move(view));
        }
        if (devices_) trials_ = try_devices(config);
        return finish("configuration", fmt::format("{}, sensor {} x {} px, scene {}", config.sensor.name,
                                                   config.sensor.readout.width, config.sensor.readout.height,
                                                   describe(config.scene)));
    }

private:
    static constexpr double estimate_s = 2;

    /// Replaces the name of a shipped file by its path. Throws InputError if there is neither file nor name.
    void find_file() {
        if (path_exists(file_)) return;
        require_permission(file_);
        for (const auto* folder : {&config::shipped_sensors, &config::shipped_scenes})
            if (const auto shipped = config::find_shipped(*folder, file_)) {
                file_ = shipped->string();
                return;
            }
        throw InputError(
            fmt::format("{}: {}", printable(file_),
                        config::explain_missing({config::shipped_sensors, config::shipped_scenes}, file_)));
    }

    /// add_estimates() with its progress. Throws Error when interrupted.
    template<typename... Camera>
    static void estimate(Plausibility& view, const Camera&... camera) {
        {
            constexpr double thousandths = 1000;
            Progress progress("check: first frame", static_cast<std::uint64_t>(thousandths));
            double done = 0;
            add_estimates(view, camera..., [&](double share) {
                done += share;
                progress.done(static_cast<std::uint64_t>(thousandths * done));
                return !host::interrupted();
            });
        }
        if (host::interrupted()) throw Error(exit_failure, "obscura check: interrupted");
    }

    static std::string describe(const scene::Scene& scene) {
        const std::size_t stars = scene::star_totals(scene).count;
        return fmt::format("\"{}\" with {} {}, {} {}, {} {}", scene.name, scene.bodies.size(),
                           scene.bodies.size() == 1 ? "body" : "bodies", stars, stars == 1 ? "star" : "stars",
                           scene.bands.size(), scene.bands.size() == 1 ? "band" : "bands");
    }

    /// Prints the results and returns the exit status.
    int finish(std::string_view kind, const std::string& summary) {
        if (json_)
            print_json(kind, summary);
        else
            print_text(summary);
        for (Plausibility& view : judged_)
            view.warn("check");
        for (const std::string& line : sensor_warnings_)
            print_message("obscura check: warning: " + line);
        const auto state = [&](DeviceState wanted) {
            return std::any_of(trials_.begin(), trials_.end(),
                               [&](const DeviceTrial& trial) { return trial.state == wanted; });
        };
        if (state(DeviceState::failed)) return exit_hardware;
        const bool odd = !sensor_warnings_.empty() ||
                         std::any_of(judged_.begin(), judged_.end(),
                                     [](const Plausibility& view) { return !view.oddities().empty(); });
        return strict_ && (odd || state(DeviceState::missing)) ? exit_failure : exit_ok;
    }

    void print_text(const std::string& summary) const {
        fmt::print("{}: good: {}\n", file_, summary);
        Report figures;
        for (const Plausibility& view : judged_)
            for (const Plausibility::Line& line : view.lines())
                figures.add_line(line.label, line.text);
        for (const DeviceTrial& trial : trials_)
            figures.add_line(trial.device, fmt::format("{}: {}", name_of(trial.state), trial.text));
        figures.print(false);
    }

    void print_json(std::string_view kind, const std::string& summary) const {
        Report report;
        report.add("file", "file", std::string_view(file_));
        report.add("kind", "kind", kind);
        report.add("summary", "summary", std::string_view(summary));
        std::string cameras;
        for (const Plausibility& view : judged_)
            cameras += (cameras.empty() ? "" : ",") + view.json();
        report.add_object("cameras", "[" + cameras + "]");
        nlohmann::ordered_json devices = nlohmann::ordered_json::array();
        for (const DeviceTrial& trial : trials_)
            devices.push_back(
                {{"device", trial.device}, {"state", name_of(trial.state)}, {"text", trial.text}});
        if (devices_)
            report.add_object("devices",
                              devices.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
        report.print(true);
    }

    std::string file_;
    bool scene_ = false, print_ = false, quick_ = false, strict_ = false, devices_ = false, json_ = false;
    std::vector<Plausibility> judged_;         ///< of each camera
    std::vector<std::string> sensor_warnings_; ///< of a sensor file's model
    std::vector<DeviceTrial> trials_;
};

} // namespace

std::unique_ptr<Verb> make_check() {
    return std::make_unique<Check>();
}

} // namespace obscura::tools
