// SPDX-License-Identifier: Apache-2.0
#include "tools/support/sensor_files.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

namespace obscura::tools {

std::vector<std::filesystem::path> sensor_folders() {
    std::vector<std::filesystem::path> folders;
    for (const char* folder : {OBSCURA_SENSORS_SOURCE, OBSCURA_SENSORS_INSTALLED}) {
        std::error_code ignored;
        if (std::filesystem::is_directory(folder, ignored)) folders.emplace_back(folder);
    }
    return folders;
}

std::vector<std::filesystem::path> sensor_files() {
    std::vector<std::filesystem::path> files;
    for (const auto& folder : sensor_folders()) {
        if (!files.empty()) break;
        for (const auto& entry : std::filesystem::directory_iterator(folder))
            if (entry.path().extension() == ".toml") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::filesystem::path find_sensor(const std::string& name) {
    if (name.find('/') != std::string::npos || name.ends_with(".toml")) return name;
    std::string known;
    for (const auto& file : sensor_files()) {
        if (file.stem() == name) return file;
        known += (known.empty() ? "" : ", ") + file.stem().string();
    }
    throw InputError(
        fmt::format("{}: no such sensor; there are {}, or give the path of a .toml file", name, known));
}

} // namespace obscura::tools
