// SPDX-License-Identifier: Apache-2.0
// Keys of a configuration one by one, with their values, defaults and where the values come from.
#pragma once

#include "config/section.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace obscura::config {

/// A key of an effective configuration.
struct Entry {
    std::string key;   ///< dotted path; elements of lists are numbered: "gige.faults[0].kind"
    std::string value; ///< as TOML
    std::string unit;  ///< empty: none
    /// As TOML; that of the first example of its kind for a key of a list; empty: it has none.
    std::string by_default;
    std::string source{}; ///< "FILE:LINE", or "default"
};

/// The printed keys of `section` and of all that is within, as print_section() prints them. `path` is the
/// dotted path of the section itself, empty for the root. Defaults are those of `fresh`, the same section
/// bound to a struct that nothing was read into.
[[nodiscard]] std::vector<Entry> entries_of(const Section& section, const Section& fresh,
                                            const std::string& path);

/// "FILE:LINE" of values by the dotted paths of their keys.
using Sources = std::map<std::string, std::string, std::less<>>;

/// Notes where the members of `table` stand, which is the table `path` of `file`; a later one replaces an
/// earlier one, and all of a list.
void note_sources(const Value& table, const std::string& path, const std::filesystem::path& file,
                  Sources& sources);

} // namespace obscura::config
