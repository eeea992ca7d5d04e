// SPDX-License-Identifier: Apache-2.0
#include "tools/pages/example_files.hpp"

#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <string_view>
#include <system_error>

namespace obscura::tools {
namespace {

std::vector<std::string> first_comment(const std::filesystem::path& file) {
    std::vector<std::string> lines;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line) && line.starts_with("#");)
        lines.push_back(line.starts_with("# ") ? line.substr(2) : line.substr(1));
    if (lines.empty())
        throw InputError(fmt::format("{}: cannot be read, or has no comment at its top", file.string()));
    return lines;
}

} // namespace

std::vector<std::string> Example::run_lines() const {
    constexpr std::string_view indentation = "    ";
    std::vector<std::string> lines;
    auto line = std::find(header.begin(), header.end(), "Run:");
    while (line != header.end() && ++line != header.end() && line->starts_with(indentation))
        lines.push_back(line->substr(indentation.size()));
    return lines;
}

std::vector<Example> examples() {
    const std::filesystem::path folder = config::shipped_data_folder() / "examples";
    std::vector<Example> found;
    std::error_code error;
    for (const std::filesystem::path& entry : paths_in(folder, error)) {
        Example example{entry.filename(), entry, entry / "camera.toml", {}};
        if (!path_exists(example.main_file)) example.main_file = entry / "scene.toml";
        if (!path_exists(example.main_file)) continue;
        example.header = first_comment(example.main_file);
        found.push_back(std::move(example));
    }
    if (error)
        throw InputError(
            fmt::format("{}: {}; the installation is incomplete", folder.string(), error.message()),
            error.value());
    std::sort(found.begin(), found.end(), [](const Example& a, const Example& b) { return a.name < b.name; });
    return found;
}

} // namespace obscura::tools
