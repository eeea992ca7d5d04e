// SPDX-License-Identifier: Apache-2.0
// Look-up of shipped sensor files by name.
#pragma once

#include "sensors/description.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// Folders with sensor files: those of the source tree and of the installation, as far as they exist.
[[nodiscard]] std::vector<std::filesystem::path> sensor_folders();
/// All shipped sensor files, sorted by name.
[[nodiscard]] std::vector<std::filesystem::path> sensor_files();
/// File of the shipped sensor `name`, or `name` itself if it is a path. Throws InputError.
[[nodiscard]] std::filesystem::path find_sensor(const std::string& name);

} // namespace obscura::tools
