// SPDX-License-Identifier: Apache-2.0
// Where the third-party data lie, if they are there at all.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>

namespace obscura::test {

/// The file `relative` of the data folder (OBSCURA_DATA, default ../shared/data beside the project), or
/// nothing, having said on standard output that the test is skipped.
inline std::optional<std::filesystem::path> data_file(const std::filesystem::path& relative) {
    const char* set = std::getenv("OBSCURA_DATA");
    const std::filesystem::path file =
        std::filesystem::path(set != nullptr ? set : OBSCURA_DATA_DEFAULT) / relative;
    if (std::filesystem::exists(file)) return file;
    std::cout << "SKIPPED: " << file.string() << " is not there\n";
    return std::nullopt;
}

} // namespace obscura::test
