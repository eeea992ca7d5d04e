// SPDX-License-Identifier: Apache-2.0
// UTF-8 (RFC 3629): check of a text, and a text in which what is none is replaced.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace obscura {

/// The beginning of a text: `bytes` of it are one character, or else the maximal part that is none.
struct Utf8Start {
    std::size_t bytes = 0;
    bool character = false;
};

/// `text` is not empty.
[[nodiscard]] Utf8Start utf8_start(std::string_view text) noexcept;

/// Whether `text` is UTF-8 without overlong forms and surrogates.
[[nodiscard]] bool is_utf8(std::string_view text) noexcept;

/// `text` with U+FFFD in place of each maximal part that is no UTF-8 (Unicode 15, section 3.9, "U+FFFD
/// Substitution of Maximal Subparts").
[[nodiscard]] std::string as_utf8(std::string_view text);

} // namespace obscura
