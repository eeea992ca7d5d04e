// SPDX-License-Identifier: Apache-2.0
// ASCII text: blanks at the ends, upper and lower case, content of XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace obscura {

/// Without the characters of `blanks` at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text, std::string_view blanks = " \t") noexcept;

/// ASCII letters in lower or upper case, other bytes as they are; independent of the locale.
[[nodiscard]] std::string lower_case(std::string_view text);
[[nodiscard]] std::string upper_case(std::string_view text);
[[nodiscard]] constexpr char upper_case_letter(char c) noexcept {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

/// As content or attribute value of XML and HTML: & < > and " as entities.
[[nodiscard]] std::string escaped_xml(std::string_view text);

} // namespace obscura
