// SPDX-License-Identifier: Apache-2.0
#include "models/language/token_reader.hpp"

#include "core/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace obscura::models {
namespace {

constexpr std::array<std::string_view, 13> keywords{"property", "parameter", "global",  "scalar", "vec2",
                                                    "vec3",     "vec4",      "texture", "if",     "else",
                                                    "return",   "for",       "void"};
/// Words of C that a reader may expect, each with what to write instead.
constexpr std::array<std::pair<std::string_view, std::string_view>, 14> foreign{
    std::pair<std::string_view, std::string_view>{"int", "write scalar"},
    {"bool", "write scalar, or use the condition where it is needed"},
    {"float", "write scalar"},
    {"double", "write scalar"},
    {"char", "there are no characters"},
    {"while", "write for, with constant bounds"},
    {"do", "write for, with constant bounds"},
    {"break", "write the condition into the loop's if"},
    {"continue", "write the condition into the loop's if"},
    {"goto", "there are no jumps"},
    {"switch", "write if and else"},
    {"struct", "there are no structs"},
    {"const", "leave it out"},
    {"static", "leave it out"}};

} // namespace

std::span<const std::string_view> keyword_names() {
    return keywords;
}

bool is_keyword(std::string_view word) {
    return std::find(keywords.begin(), keywords.end(), word) != keywords.end();
}

void TokenReader::fail(Place at, std::string what) {
    findings_.error(at, std::move(what));
    throw Unreadable{};
}

std::string TokenReader::found() const {
    return at_end() ? "the end of the file" : fmt::format("'{}'", printable(token().text));
}

void TokenReader::expect(std::string_view word, std::string_view where) {
    if (!take(word)) fail(token().at, fmt::format("'{}' is missing {}, found {}", word, where, found()));
}

void TokenReader::expect_end_of_statement(std::string_view where) {
    if (at_ > 0 && !is(";")) {
        const Token& before = tokens_[at_ - 1];
        if (before.at.line < token().at.line) {
            const Place end{before.at.line, before.at.column + static_cast<int>(before.text.size())};
            findings_.error(end, fmt::format("';' is missing {}", where));
            return;
        }
    }
    expect(";", where);
}

std::string_view TokenReader::expect_name(std::string_view what) {
    const Token& t = token();
    if (t.kind != Token::Kind::identifier || is_keyword(t.text))
        fail(t.at, fmt::format("{} is missing, found {}", what, found()));
    return take().text;
}

std::optional<Type> TokenReader::take_type() {
    for (const Type type : {Type::scalar, Type::vec2, Type::vec3, Type::vec4, Type::texture})
        if (take(name_of(type))) return type;
    for (const auto& [word, instead] : foreign)
        if (is(word)) fail(token().at, fmt::format("'{}' is not used in SuMoL: {}", word, instead));
    return {};
}

void TokenReader::skip_statement() {
    int depth = 0;
    while (!at_end()) {
        if (is("{")) ++depth;
        if (is("}") && --depth < 0) return;
        const bool ends = is(";") || (is("}") && depth == 0);
        take();
        if (ends && depth <= 0) return;
    }
}

} // namespace obscura::models
