// SPDX-License-Identifier: Apache-2.0
// Lexical analysis of SuMoL: identifiers, numbers, operators and comments.
#pragma once

#include "models/language/findings.hpp"

#include <cstdint>
#include <string_view>
#include <vector>

namespace obscura::models {

struct Token {
    enum class Kind : std::uint8_t { identifier, number, symbol, end };
    Kind kind = Kind::end;
    Place at;
    std::string_view text; ///< in the source, which must outlive the token
    double value = 0;      ///< of a number
    /// Comment behind the token that begins with "//!", without that; only of the last token of a line.
    std::string_view remark{};

    [[nodiscard]] bool is(std::string_view word) const noexcept {
        return kind != Kind::number && kind != Kind::end && text == word;
    }
};

/// Longest identifier, in bytes.
inline constexpr std::size_t max_name_bytes = 64;

/// Tokens of `source`, the last is of Kind::end. Comments are `// ...` and `/* ... */`; numbers are decimal,
/// or hexadecimal integers (0x1F). Characters that begin no token are errors and are skipped.
[[nodiscard]] std::vector<Token> tokens_of(std::string_view source, Findings& findings);

} // namespace obscura::models
