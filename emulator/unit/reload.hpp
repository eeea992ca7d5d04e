// SPDX-License-Identifier: Apache-2.0
// Configuration keys that differ between two configurations, and those that a running daemon accepts.
#pragma once

#include "emulator/config/daemon_config.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Names of the keys ("gige.port") that differ between two configurations, as printed. The content of the
/// scene file is not compared.
[[nodiscard]] std::vector<std::string> changed_keys(const emulator::DaemonConfig& before,
                                                    const emulator::DaemonConfig& after);

/// Why the scene of `next` cannot take the place of `before` while the daemon runs; empty: it can.
[[nodiscard]] std::string scene_refusal(const scene::Scene& before, const emulator::DaemonConfig& next);

/// Fingerprint of the scene file and of every file that it names, models in `models_folder` too: changes if
/// one of them does. 0 if the scene file cannot be read.
[[nodiscard]] std::uint64_t scene_fingerprint(const std::filesystem::path& scene_file,
                                              const std::filesystem::path& models_folder);

} // namespace obscura::emulator
