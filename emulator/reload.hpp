// Which keys of a configuration may change while the daemon runs.
#pragma once

#include "emulator/config/daemon_config.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Names of the keys ("gige.port") that differ between two configurations, as printed. What the scene file
/// holds is not compared.
[[nodiscard]] std::vector<std::string> changed_keys(const emulator::DaemonConfig& before,
                                                    const emulator::DaemonConfig& after);

/// Of the scene file and of every file that it names: changes when one of them does. 0 when it cannot be
/// read.
[[nodiscard]] std::uint64_t scene_fingerprint(const std::filesystem::path& scene_file);

/// Whether a running daemon takes a new value of `key` on: the bench's clock in [trigger], the
/// late policy in [deadline], the scene, and daemon.log_level.
[[nodiscard]] bool is_reloadable(const std::string& key);

} // namespace obscura::emulator
