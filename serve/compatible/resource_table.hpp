// SPDX-License-Identifier: Apache-2.0
// Files that stand for names which the published client asks for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace obscura::serve::compatible {

/// Rows of a TOML file: "name or pattern" = "file". Patterns are those of a shell, for the
/// name without its folders. Immutable; thread-safe.
class ResourceTable {
public:
    ResourceTable() = default;
    /// Relative files start from the folder of the table. Throws ConfigError, also for files that there are
    /// not.
    explicit ResourceTable(const std::filesystem::path& file);

    /// The file of the first row that fits; none: no row does.
    [[nodiscard]] std::optional<std::filesystem::path> find(const std::string& name) const;
    /// All files, absolute.
    [[nodiscard]] std::vector<std::filesystem::path> files() const;

private:
    std::vector<std::pair<std::string, std::filesystem::path>> rows_;
};

} // namespace obscura::serve::compatible
