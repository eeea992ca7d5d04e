// SPDX-License-Identifier: Apache-2.0
#include "models/language/tokens.hpp"

#include "core/text/number.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>

namespace obscura::models {
namespace {

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
bool begins_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

/// Operators and brackets, those of two characters first.
constexpr std::array<std::string_view, 36> symbols{
    "<=", ">=", "==", "!=", "&&", "||", "+=", "-=", "*=", "/=", "++", "--", "+", "-", "*", "/", "<", ">",
    "!",  "|",  "?",  ":",  "=",  "(",  ")",  "{",  "}",  ",",  ";",  ".",  "$", "%", "&", "[", "]", "^"};

class Lexer {
public:
    Lexer(std::string_view source, Findings& findings) : source_(source), findings_(findings) {}

    std::vector<Token> all() {
        while (skip_blanks(), at_ < source_.size())
            read_token();
        tokens_.push_back({Token::Kind::end, place_, source_.substr(source_.size())});
        return std::move(tokens_);
    }

private:
    [[nodiscard]] char peek(std::size_t ahead = 0) const {
        return at_ + ahead < source_.size() ? source_[at_ + ahead] : '\0';
    }
    void advance(std::size_t bytes) {
        for (; bytes > 0 && at_ < source_.size(); --bytes, ++at_) {
            if (source_[at_] == '\n')
                place_ = {place_.line + 1, 1};
            else
                ++place_.column;
        }
    }

    void skip_blanks() {
        for (;;) {
            if (peek() == ' ' || peek() == '\t' || peek() == '\n' || peek() == '\f') {
                advance(1);
            } else if (peek() == '/' && peek(1) == '/') {
                const std::size_t end = std::min(source_.find('\n', at_), source_.size());
                const std::string_view comment = source_.substr(at_, end - at_);
                if (comment.starts_with("//!") && !tokens_.empty() && tokens_.back().at.line == place_.line)
                    tokens_.back().remark = trimmed(comment.substr(3));
                advance(end - at_);
            } else if (peek() == '/' && peek(1) == '*') {
                const std::size_t end = source_.find("*/", at_ + 2);
                if (end == std::string_view::npos)
                    findings_.error(place_, "the comment has no end: */ is missing");
                advance(end == std::string_view::npos ? source_.size() : end + 2 - at_);
            } else {
                return;
            }
        }
    }

    void read_token() {
        const Place begin = place_;
        if (is_digit(peek()) || (peek() == '.' && is_digit(peek(1)))) return read_number(begin);
        if (begins_name(peek())) {
            std::size_t length = 1;
            while (begins_name(peek(length)) || is_digit(peek(length)))
                ++length;
            if (length > max_name_bytes)
                findings_.error(begin,
                                fmt::format("a name of {} bytes: allowed are {}", length, max_name_bytes));
            return push(Token::Kind::identifier, begin, length);
        }
        for (const std::string_view symbol : symbols)
            if (source_.substr(at_).starts_with(symbol))
                return push(Token::Kind::symbol, begin, symbol.size());
        std::size_t length = 1; // of a character in UTF-8
        while ((static_cast<unsigned char>(peek(length)) & 0xC0U) == 0x80)
            ++length;
        findings_.error(begin,
                        fmt::format("'{}' is not used in SuMoL", printable(source_.substr(at_, length))));
        advance(length);
    }

    void read_number(Place begin) {
        std::size_t length = 1;
        const bool hexadecimal = peek() == '0' && (peek(1) == 'x' || peek(1) == 'X');
        // A sign belongs to the number behind the e of a decimal exponent.
        const auto continues = [&](char c) {
            const char before = peek(length - 1);
            return is_digit(c) || begins_name(c) || c == '.' ||
                   ((c == '+' || c == '-') && !hexadecimal && (before == 'e' || before == 'E'));
        };
        while (continues(peek(length)))
            ++length;
        const std::string_view text = source_.substr(at_, length);
        push(Token::Kind::number, begin, length);
        if (hexadecimal) {
            std::uint32_t value = 0;
            const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), value, 16);
            if (error != std::errc{} || end != text.data() + text.size())
                findings_.error(
                    begin, fmt::format("'{}' is no number: allowed are 0x0 to 0xFFFFFFFF", printable(text)));
            tokens_.back().value = value;
        } else if (const auto value = decimal_number(text)) {
            tokens_.back().value = *value;
        } else {
            findings_.error(begin,
                            fmt::format("'{}' is no number: write for example 0.5 or 1e-3", printable(text)));
        }
    }

    void push(Token::Kind kind, Place begin, std::size_t length) {
        tokens_.push_back({kind, begin, source_.substr(at_, length)});
        advance(length);
    }

    std::string_view source_;
    Findings& findings_;
    std::size_t at_ = 0;
    Place place_;
    std::vector<Token> tokens_;
};

} // namespace

std::vector<Token> tokens_of(std::string_view source, Findings& findings) {
    return Lexer(source, findings).all();
}

} // namespace obscura::models
