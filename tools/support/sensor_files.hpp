// Where the shipped sensors lie, and how a user names one.
#pragma once

#include "sensors/description.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// The folders with sensor files: that of the source tree and that of the installation, where they exist.
[[nodiscard]] std::vector<std::filesystem::path> sensor_folders();
/// The sensor files there are, sorted by name.
[[nodiscard]] std::vector<std::filesystem::path> sensor_files();
/// The file of a shipped sensor, or `name` itself where it is a path. Throws InputError.
[[nodiscard]] std::filesystem::path find_sensor(const std::string& name);

} // namespace obscura::tools
