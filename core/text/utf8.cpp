// SPDX-License-Identifier: Apache-2.0
#include "core/text/utf8.hpp"

namespace obscura {

Utf8Start utf8_start(std::string_view text) noexcept {
    const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(0);
    if (first < 0x80) return {1, true};
    if (first < 0xC2 || first > 0xF4) return {1, false};
    const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
    // The second byte excludes overlong forms, surrogates and codes above U+10FFFF.
    const unsigned char lowest = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
    const unsigned char highest = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
    for (std::size_t i = 1; i < length; ++i)
        if (i == text.size() || byte(i) < (i == 1 ? lowest : 0x80) || byte(i) > (i == 1 ? highest : 0xBF))
            return {i, false};
    return {length, true};
}

bool is_utf8(std::string_view text) noexcept {
    while (!text.empty()) {
        const Utf8Start start = utf8_start(text);
        if (!start.character) return false;
        text.remove_prefix(start.bytes);
    }
    return true;
}

std::string as_utf8(std::string_view text) {
    std::string valid;
    valid.reserve(text.size());
    while (!text.empty()) {
        const Utf8Start start = utf8_start(text);
        valid += start.character ? text.substr(0, start.bytes) : std::string_view("\xEF\xBF\xBD");
        text.remove_prefix(start.bytes);
    }
    return valid;
}

} // namespace obscura
