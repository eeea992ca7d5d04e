// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/resource_table.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <string_view>
#include <system_error>

namespace obscura::serve::compatible {

ResourceTable::ResourceTable(const std::filesystem::path& file) {
    const config::Value root = config::parse_file(file);
    const auto mistake = [&](const config::Position& at, std::string_view what) {
        return ConfigError(fmt::format("{}:{}:{}: {}", file.string(), at.line, at.column, what));
    };
    for (const config::Member& row : root.members) {
        if (row.value.kind != config::Value::Kind::string)
            throw mistake(row.at, fmt::format("\"{}\": the name of a file is wanted", printable(row.key)));
        std::error_code error;
        const std::filesystem::path found =
            std::filesystem::canonical(file.parent_path() / row.value.string, error);
        if (error) throw mistake(row.at, fmt::format("{}: {}", row.value.string, error.message()));
        rows_.emplace_back(row.key, found);
    }
}

std::optional<std::filesystem::path> ResourceTable::find(const std::string& name) const {
    const std::string last = name.substr(name.find_last_of('/') + 1);
    for (const auto& [pattern, file] : rows_)
        if (::fnmatch(pattern.c_str(), last.c_str(), 0) == 0 || pattern == name) return file;
    return {};
}

std::vector<std::filesystem::path> ResourceTable::files() const {
    std::vector<std::filesystem::path> all;
    for (const auto& row : rows_)
        all.push_back(row.second);
    return all;
}

} // namespace obscura::serve::compatible
