// SPDX-License-Identifier: Apache-2.0
// Position in a list of tokens, for the parsers of expressions, statements and declarations.
#pragma once

#include "models/language/findings.hpp"
#include "models/language/syntax.hpp"
#include "models/language/tokens.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::models {

/// Thrown within the parser at an error that has been noted: the statement cannot be read further.
struct Unreadable {};

/// Words of the language, which are no names of functions or variables.
[[nodiscard]] std::span<const std::string_view> keyword_names();
[[nodiscard]] bool is_keyword(std::string_view word);

class TokenReader {
public:
    TokenReader(const std::vector<Token>& tokens, Findings& findings)
        : tokens_(tokens), findings_(findings) {}

    [[nodiscard]] const Token& token(std::size_t ahead = 0) const {
        return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
    }
    [[nodiscard]] bool is(std::string_view word) const { return token().is(word); }
    [[nodiscard]] bool at_end() const { return token().kind == Token::Kind::end; }
    const Token& take() {
        const Token& t = token();
        if (at_ + 1 < tokens_.size()) ++at_;
        return t;
    }
    /// Takes the token if it is `word`.
    bool take(std::string_view word) { return is(word) && (take(), true); }
    /// Takes `word`, or throws Unreadable.
    void expect(std::string_view word, std::string_view where);
    /// Takes ";". Where it is missing at the end of a line, the rest is read as if it were there.
    void expect_end_of_statement(std::string_view where);
    /// Takes a name that is no keyword, or throws Unreadable.
    std::string_view expect_name(std::string_view what);
    /// Takes the name of a type; nothing: it is none.
    std::optional<Type> take_type();
    [[noreturn]] void fail(Place at, std::string what);
    /// `'x'` or `the end of the file`, for messages.
    [[nodiscard]] std::string found() const;
    [[nodiscard]] Findings& findings() { return findings_; }

    /// Skips to behind the next ";" or to "}" of the statement that cannot be read.
    void skip_statement();

private:
    const std::vector<Token>& tokens_;
    Findings& findings_;
    std::size_t at_ = 0;
};

/// Counts how deep constructs stand in each other, while one is read.
class Nesting {
public:
    Nesting(TokenReader& reader, int& depth, int max) : depth_(depth) {
        if (++depth_ > max) {
            --depth_;
            reader.fail(reader.token().at,
                        "nested too deeply: allowed are " + std::to_string(max) + " levels");
        }
    }
    ~Nesting() { --depth_; }
    Nesting(const Nesting&) = delete;
    Nesting& operator=(const Nesting&) = delete;

private:
    int& depth_;
};

} // namespace obscura::models
