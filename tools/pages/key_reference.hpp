// SPDX-License-Identifier: Apache-2.0
// Reference of every key of configurations, scene files and sensor files, made from the sections of their
// owners.
#pragma once

#include "config/section.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// One kind of file with all of its tables.
struct KeyReference {
    std::string_view name;  ///< "configuration", "scene", "sensor"
    std::string_view title; ///< "Configuration of the daemon"
    std::string_view intro; ///< a paragraph
    std::vector<config::DocumentedTable> tables;
    std::shared_ptr<const void> bound; ///< what the keys' defaults are read from
};

/// All kinds of files.
[[nodiscard]] std::vector<KeyReference> key_references();

/// A page of the reference in Markdown.
[[nodiscard]] std::string reference_page(const KeyReference& reference);

/// The tables as text for a terminal.
[[nodiscard]] std::string reference_text(const std::vector<config::DocumentedTable>& tables);

/// Tables whose heading or variant has `word` as its last part, or all of whose dotted path begins with it:
/// "gige", "gige.faults", "faults".
[[nodiscard]] std::vector<config::DocumentedTable> find_tables(const KeyReference& reference,
                                                               std::string_view word);
/// The words that find_tables() takes: paths and the names of variants, each once.
[[nodiscard]] std::vector<std::string_view> table_words(const std::vector<config::DocumentedTable>& tables);

} // namespace obscura::tools
