// SPDX-License-Identifier: Apache-2.0
// Check that a path named by a client stays below a folder.
#pragma once

#include <filesystem>

namespace obscura {

/// Whether `path` is `folder` or below it, links followed; `path` need not exist. False for an empty folder
/// or one that is not there.
[[nodiscard]] bool is_below(const std::filesystem::path& path, const std::filesystem::path& folder);

} // namespace obscura
