// SPDX-License-Identifier: Apache-2.0
#include "config/shipped_files.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

namespace obscura::config {
namespace {

namespace fs = std::filesystem;

/// See shipped_data_folder().
fs::path find_data_folder() {
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    for (const fs::path& folder : {program.parent_path().parent_path() / "share" / "obscura",
                                   fs::path(OBSCURA_SHIPPED_SOURCE), fs::path(OBSCURA_SHIPPED_INSTALLED)})
        if (fs::is_directory(folder / shipped_sensors.name, error)) return folder;
    return {};
}

/// Whether `name` can be that of a shipped file: "imx-3.45um" can, "imx.toml" and "./imx" are paths.
bool is_name(const ShippedFolder& folder, std::string_view name) {
    return !name.empty() && name.front() != '.' && name.find('/') == std::string_view::npos &&
           !name.ends_with(folder.ending);
}

} // namespace

const fs::path& shipped_data_folder() {
    // Found once: a daemon that has given up its rights need not look again.
    static const fs::path folder = find_data_folder();
    return folder;
}

std::vector<fs::path> shipped_files(const ShippedFolder& folder) {
    std::vector<fs::path> files;
    std::error_code error;
    for (const std::filesystem::path& entry : paths_in(shipped_data_folder() / folder.name, error))
        if (entry.extension() == folder.ending) files.push_back(entry);
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        return a.stem() < b.stem(); // "moon" before "moon-realtime"
    });
    return files;
}

std::optional<fs::path> find_shipped(const ShippedFolder& folder, std::string_view name) {
    if (!is_name(folder, name)) return std::nullopt;
    const fs::path file = shipped_data_folder() / folder.name / fmt::format("{}{}", name, folder.ending);
    if (!is_file_at(file)) return std::nullopt;
    return file;
}

std::string explain_missing(std::initializer_list<ShippedFolder> folders, std::string_view name) {
    std::vector<std::string> kinds, lists, all;
    for (const ShippedFolder& folder : folders) {
        if (!is_name(folder, name)) continue;
        std::vector<std::string> names;
        for (const fs::path& file : shipped_files(folder))
            names.push_back(file.stem().string());
        kinds.emplace_back(folder.one);
        lists.push_back(fmt::format("{}{}", folders.size() > 1 ? fmt::format("{}s ", folder.one) : "",
                                    fmt::join(names, ", ")));
        all.insert(all.end(), names.begin(), names.end());
    }
    if (kinds.empty()) return "no such file";
    return fmt::format("no such file, and no shipped {}: there are {}{}", fmt::join(kinds, " or "),
                       fmt::join(lists, "; "), did_you_mean(name, {all.begin(), all.end()}));
}

fs::path file_or_shipped(const ShippedFolder& folder, const std::string& name) {
    if (is_file_at(name) || !is_name(folder, name)) return name;
    if (const auto file = find_shipped(folder, name)) return *file;
    throw InputError(fmt::format("{}: {}", printable(name), explain_missing({folder}, name)));
}

std::string file_of_key(const Value& value, const Where& where, const std::string& path,
                        const ShippedFolder& folder) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_regular_file(status)) return path;
    if (fs::exists(status)) fail(where, value.at, fmt::format("{}: not a regular file", path));
    if (const auto file = find_shipped(folder, value.string)) return file->string();
    fail_missing(where, value.at, path, explain_missing({folder}, value.string), error);
}

} // namespace obscura::config
