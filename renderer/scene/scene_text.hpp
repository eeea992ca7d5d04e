// SPDX-License-Identifier: Apache-2.0
// Text of a scene file, and the names of files in it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// Text of a scene file; empty: it cannot be read.
[[nodiscard]] std::string text_of_file(const std::filesystem::path& file);
/// What stands in double quotes in the text of a scene file: all that may name a file.
[[nodiscard]] std::vector<std::string> quoted_texts(std::string_view text);

} // namespace obscura::scene
