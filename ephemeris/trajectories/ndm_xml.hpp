// SPDX-License-Identifier: Apache-2.0
// Navigation messages in XML (CCSDS 505.0-B, NDM/XML) as lines of keyword = value notation.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// A message as KVN.
struct KvnText {
    std::string text;
    std::vector<std::size_t> lines; ///< line of the XML of each line of the text
};

/// Whether a plain text is XML: its first character is "<".
[[nodiscard]] bool is_xml(std::string_view text);

/// The one OEM or AEM of an XML document, which may stand in an <ndm>. `root` is "oem" or "aem". Throws
/// ConfigError `name:line: what` for what is no XML, for another or a second message and for units other than
/// those of the notation.
[[nodiscard]] KvnText kvn_of_xml(const std::string& xml, const std::string& name, std::string_view root);

} // namespace obscura::ephemeris
