// SPDX-License-Identifier: Apache-2.0
// Look-up of the shipped configurations, scenes and examples.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// Folder with demo.toml, scenes/, stars/ and examples/: that of the source tree, or else of the
/// installation. Throws InputError if neither exists.
[[nodiscard]] std::filesystem::path shipped_folder();

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
