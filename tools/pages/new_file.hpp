// SPDX-License-Identifier: Apache-2.0
// Commented configuration and scene files to begin with, made from the reference of all keys.
#pragma once

#include "tools/pages/key_reference.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Value of a key in a new file, as TOML.
struct NewValue {
    std::string_view table; ///< heading as in the reference: "[trigger]", "" for the root
    std::string_view key;
    std::string value;
};

/// What a new file says beside the reference.
struct NewFile {
    std::string introduction;  ///< lines of its first comment, without "# "
    std::vector<NewValue> set; ///< keys that are given; all others stand behind "#" with their defaults
    std::vector<std::string_view> absent;   ///< headings of tables that stand behind "#" as a whole
    std::vector<std::string_view> left_out; ///< headings of tables that are not mentioned
    std::vector<std::string_view> variants; ///< variants of lists whose keys are mentioned: "shape = \"box\""
};

/// The file as TOML: every table of `reference` with every key, its meaning and its range in comments. Words
/// stand behind "# ", keys that can be uncommented behind "#". Throws std::logic_error if `file` names a
/// table or key that does not exist.
[[nodiscard]] std::string new_file_text(const KeyReference& reference, const NewFile& file);

} // namespace obscura::tools
