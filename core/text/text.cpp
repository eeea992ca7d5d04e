// SPDX-License-Identifier: Apache-2.0
#include "core/text/text.hpp"

namespace obscura {
namespace {

std::string moved_case(std::string_view text, char from, char to) {
    std::string result(text);
    for (char& c : result)
        if (c >= from && c <= from + 25) c = static_cast<char>(c - from + to);
    return result;
}

} // namespace

std::string_view trimmed(std::string_view text, std::string_view blanks) noexcept {
    const std::size_t first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string lower_case(std::string_view text) {
    return moved_case(text, 'A', 'a');
}

std::string upper_case(std::string_view text) {
    return moved_case(text, 'a', 'A');
}

std::string escaped_xml(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
        case '&':
            result += "&amp;";
            break;
        case '<':
            result += "&lt;";
            break;
        case '>':
            result += "&gt;";
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

} // namespace obscura
