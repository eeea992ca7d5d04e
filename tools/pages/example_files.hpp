// SPDX-License-Identifier: Apache-2.0
// Shipped examples and their explanations.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// One shipped example: a folder with a configuration or scene whose first comment explains it.
struct Example {
    std::string name;
    std::filesystem::path folder;
    std::filesystem::path main_file; ///< camera.toml, or else scene.toml
    std::vector<std::string> header; ///< lines of the first comment of main_file without "# "

    /// Commands of the header: the indented lines below its line "Run:", without their indentation.
    [[nodiscard]] std::vector<std::string> run_lines() const;
};

/// All examples, sorted by name. Throws InputError.
[[nodiscard]] std::vector<Example> examples();

} // namespace obscura::tools
