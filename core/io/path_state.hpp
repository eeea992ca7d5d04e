// SPDX-License-Identifier: Apache-2.0
// What a path leads to, without exceptions of the standard library: a user's path may be too long, a loop of
// links, or in a folder that must not be entered.
#pragma once

#include <cstdint>
#include <filesystem>
#include <system_error>
#include <vector>

namespace obscura {

/// Whether a path, links followed, leads to something, to a regular file, to a folder; false where that is
/// unknown.
[[nodiscard]] bool path_exists(const std::filesystem::path& path) noexcept;
[[nodiscard]] bool is_file_at(const std::filesystem::path& path) noexcept;
[[nodiscard]] bool is_folder_at(const std::filesystem::path& path) noexcept;

/// Size of a regular file in bytes, 0 where it cannot be looked at.
[[nodiscard]] std::uintmax_t file_bytes_at(const std::filesystem::path& path) noexcept;

/// Absolute and lexically normal. Throws InputError if it is relative and the working folder is gone.
[[nodiscard]] std::filesystem::path absolute_path(const std::filesystem::path& path);

/// Absolute and without links. Throws InputError if it leads to nothing.
[[nodiscard]] std::filesystem::path real_path(const std::filesystem::path& path);

/// Folder for temporary files, from the variable TMPDIR, else /tmp. Throws OutputError if it is no folder.
[[nodiscard]] std::filesystem::path temporary_files_folder();

/// Paths of all that lies in `folder`, sorted; what was read before an error.
[[nodiscard]] std::vector<std::filesystem::path> paths_in(const std::filesystem::path& folder,
                                                          std::error_code& error);

} // namespace obscura
