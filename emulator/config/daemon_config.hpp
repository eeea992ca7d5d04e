// SPDX-License-Identifier: Apache-2.0
// Read this first: TOML files become plain structs here, checked whole or refused with one line.
#pragma once

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
    std::filesystem::path source; ///< the file it was read from; relative paths in it start from its folder
    std::string scene_file;       ///< absolute
    DaemonSection daemon;
    RenderSection render;
    sync::TriggerSettings trigger;
    sync::PtpSettings ptp;
    DeadlineSection deadline;
    SimulatorSection simulator;
    OutputsSection outputs;
    ThreadsSection threads;
    CameraSection camera;
    transports::ConfiguredTransports transports;
    SensorDescription sensor;
    scene::Scene scene;

    /// [[camera]]: the second and further cameras, each a whole configuration with the same [scene],
    /// [daemon], [render] and [ptp]. Empty under a single [camera]; then the following mean nothing.
    std::vector<DaemonConfig> others;
    bool several = false;     ///< written as [[camera]], perhaps with one element
    bool own_trigger = false; ///< has a [camera.trigger]; else what [trigger] names reaches it
    std::string view;         ///< the keys of [camera.view] that were given, as TOML

    /// This one and the others.
    [[nodiscard]] std::vector<const DaemonConfig*> cameras() const;
};

/// The sections that all cameras of a file share, and those that each camera may have of its own, in the
/// order in which they are printed. `config` outlives them.
[[nodiscard]] std::vector<config::Section> shared_sections(DaemonConfig& config);
[[nodiscard]] std::vector<config::Section> camera_sections(DaemonConfig& config);

/// Reads a daemon configuration with its sensor and scene files, and checks it: what it returns can be
/// started if the machine has what it names. Nothing but files is opened. Throws ConfigError with a line for
/// each mistake, `file:line:column: key: what is wrong, what is allowed`.
[[nodiscard]] DaemonConfig load_config(const std::filesystem::path& file);

/// The effective configuration as TOML with every key, its unit, range and help as comments.
[[nodiscard]] std::string print_config(const DaemonConfig& config);

/// Whether a reload takes on a new value of the key at this dotted path, as print_config() names it.
[[nodiscard]] bool is_reloadable(const std::string& path);

/// The reset CameraSettings of a configuration.
[[nodiscard]] CameraSettings camera_settings(const DaemonConfig& config);

} // namespace obscura::emulator
