// SPDX-License-Identifier: Apache-2.0
// Text in XML.
#pragma once

#include <string>
#include <string_view>

namespace obscura::instrument {

/// The text as content or attribute of XML.
[[nodiscard]] inline std::string escaped_xml(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
        case '&':
            result += "&amp;";
            break;
        case '<':
            result += "&lt;";
            break;
        case '"':
            result += "&quot;";
            break;
        default:
            result += c;
        }
    }
    return result;
}

} // namespace obscura::instrument
