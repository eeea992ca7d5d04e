// SPDX-License-Identifier: Apache-2.0
#include "core/text/printable.hpp"

#include "core/text/utf8.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace obscura {
namespace {

/// A control character of ASCII, or (two bytes) of ISO 6429's upper set, which terminals obey as well.
bool is_control(std::string_view character) noexcept {
    const auto first = static_cast<unsigned char>(character[0]);
    if (character.size() == 2) return first == 0xC2 && static_cast<unsigned char>(character[1]) < 0xA0;
    return character.size() == 1 && (first < 0x20 || first == 0x7F);
}

} // namespace

std::string printable(std::string_view text, std::size_t limit) {
    std::string out;
    const bool cut = text.size() > limit;
    text = text.substr(0, limit);
    while (!text.empty()) {
        const Utf8Start start = utf8_start(text);
        const std::string_view character = text.substr(0, start.bytes);
        text.remove_prefix(start.bytes);
        if (character == "\t" || character == "\n" || character == "\r") {
            out += ' ';
        } else if (start.character && !is_control(character)) {
            out += character;
        } else if (start.character || !cut || !text.empty()) { // a character that was cut is left out
            for (const char byte : character)
                out += fmt::format("\\x{:02X}", static_cast<unsigned char>(byte));
        }
    }
    return cut ? out + "..." : out;
}

std::string for_terminal(std::string_view text) {
    std::string out;
    for (;;) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        out += printable(text.substr(0, end), max_message_bytes);
        if (end == text.size()) return out;
        out += '\n';
        text.remove_prefix(end + 1);
    }
}

void print_message(std::string_view message) {
    fmt::print(stderr, "{}\n", for_terminal(message));
}

} // namespace obscura
