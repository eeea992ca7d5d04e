// SPDX-License-Identifier: Apache-2.0
// Folder that names of files cannot leave: neither by "..", nor by an absolute name, nor through a link.
#pragma once

#include "core/io/file_descriptor.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::serve {

/// Resolves names below one folder with openat2(RESOLVE_BENEATH). Thread-bound.
class FolderBelow {
public:
    /// Throws InputError unless `folder` is a folder.
    explicit FolderBelow(std::filesystem::path folder);

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    /// Where `name`, relative to the folder, really is; none: there is nothing of that name. Throws Failure
    /// (forbidden) if it leads out of the folder, and for names that no file can have.
    [[nodiscard]] std::optional<std::filesystem::path> find(const std::string& name) const;
    /// Where a file called `name` would be: its folder exists, or is made. Throws Failure, also if there is
    /// something of that name that is no file.
    [[nodiscard]] std::filesystem::path place_for(const std::string& name, bool make_folders) const;
    /// Names in the folder `name`, sorted, those of folders with "/". Throws Failure if it is none.
    [[nodiscard]] std::vector<std::string> list(const std::string& name) const;

private:
    std::filesystem::path path_;
    FileDescriptor folder_;
};

} // namespace obscura::serve
