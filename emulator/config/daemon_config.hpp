// SPDX-License-Identifier: Apache-2.0
// Configuration of the daemon: reads, checks and prints TOML files as plain structs. Read this header first.
#pragma once

#include "config/entries.hpp"
#include "emulator/config/camera_section.hpp"
#include "emulator/config/daemon_sections.hpp"
#include "renderer/scene/scene.hpp"
#include "sensors/description.hpp"
#include "sync/settings.hpp"
#include "transports/registry.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// The configuration of one daemon and its camera; of the first one when there are several.
struct DaemonConfig {
    std::filesystem::path source; ///< absolute path of the file that it was read from
    std::string scene_file;       ///< absolute
    DaemonSection daemon;
    RenderSection render;
    sync::TriggerSettings trigger;
    sync::PtpSettings ptp;
    DeadlineSection deadline;
    SimulatorSection simulator;
    OutputsSection outputs;
    ThreadsSection threads;
    MonitorSection monitor;
    ModelsSection models;
    ControlSection control;
    CameraSection camera;
    transports::ConfiguredTransports transports;
    SensorDescription sensor;
    scene::Scene scene;

    /// [[camera]]: the second and further cameras, each a whole configuration with the same [scene],
    /// [daemon], [render], [ptp] and [threads]. Empty with a single [camera]; the members below are then
    /// unused.
    std::vector<DaemonConfig> others;
    bool several = false;     ///< written as [[camera]], perhaps with one element
    bool own_trigger = false; ///< has a [camera.trigger]; otherwise [trigger] applies
    std::string view;         ///< the keys of [camera.view] that the file gives, as TOML
    /// Where the values stand that files give, of all cameras: "camera[1].gige.port".
    config::Sources sources;

    /// This one and the others.
    [[nodiscard]] std::vector<const DaemonConfig*> cameras() const;
};

/// Sections that all cameras of a file share, and sections that each camera may have of its own, in the order
/// in which they are printed. `config` outlives them.
[[nodiscard]] std::vector<config::Section> shared_sections(DaemonConfig& config);
[[nodiscard]] std::vector<config::Section> camera_sections(DaemonConfig& config);
/// The whole file: shared sections, then those of a camera.
[[nodiscard]] config::Section root_section(DaemonConfig& config);

/// Reads a daemon configuration with its sensor and scene files, and checks it: the result can be started on
/// a machine that has the devices and interfaces it names. Opens nothing but files; those that a scene names
/// are read by Imaging. Throws ConfigError with one line for each mistake, `file:line:column: key: what is
/// wrong, what is allowed`.
[[nodiscard]] DaemonConfig load_config(const std::filesystem::path& file);

/// The effective configuration as TOML with every key, its unit, range and help as comments. Tables that it
/// does not have appear as commented-out examples.
[[nodiscard]] std::string print_config(const DaemonConfig& config);

/// The configuration with that scene in place of its own, each camera where its [camera.view] says. Throws
/// ConfigError as load_config() does.
[[nodiscard]] DaemonConfig with_scene(DaemonConfig config, const std::filesystem::path& scene_file);

/// The configuration with other values of reloadable keys: `tables` as those of a file, {trigger: {rate_hz:
/// 20}}, which `by` has given, whose name stands for the file in messages. Of several cameras those of tables
/// that all share. Throws ConfigError as load_config() does.
[[nodiscard]] DaemonConfig with_values(DaemonConfig config, const config::Value& tables,
                                       const std::string& by);

/// Whether a reload accepts a new value of the key at this dotted path, as print_config() names it.
[[nodiscard]] bool is_reloadable(const std::string& path);

/// Camera settings after reset, without those that follow from [trigger]; see initial_camera().
[[nodiscard]] CameraSettings camera_settings(const DaemonConfig& config);

} // namespace obscura::emulator
