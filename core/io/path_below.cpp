// SPDX-License-Identifier: Apache-2.0
#include "core/io/path_below.hpp"

#include <algorithm>
#include <system_error>

namespace obscura {

bool is_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
    if (folder.empty()) return false;
    std::error_code error;
    const std::filesystem::path real = std::filesystem::weakly_canonical(path, error);
    if (error) return false;
    const std::filesystem::path top = std::filesystem::canonical(folder, error);
    return !error && std::mismatch(top.begin(), top.end(), real.begin(), real.end()).first == top.end();
}

} // namespace obscura
