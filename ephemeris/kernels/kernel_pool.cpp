// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/kernel_pool.hpp"

#include "core/error.hpp"
#include "core/io/text_file.hpp"
#include "core/text/number.hpp"

#include <erfa.h>
#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <limits>

namespace obscura::ephemeris {
namespace {

/// Larger files are no text kernels.
constexpr std::size_t max_kernel_bytes = 256U << 20;

bool blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

/// What a message shows of a word from a file.
std::string shown(std::string_view word) {
    std::string text(word.substr(0, 40));
    for (char& c : text)
        if (c < ' ' || c > '~') c = '?';
    return text;
}

std::optional<int> month_number(std::string_view word) {
    constexpr std::string_view months = "JANFEBMARAPRMAYJUNJULAUGSEPOCTNOVDEC";
    const std::string name = kernel_name(word);
    if (name.size() < 3) return std::nullopt;
    const std::size_t at = months.find(name.substr(0, 3));
    if (at == std::string_view::npos || at % 3 != 0) return std::nullopt;
    return static_cast<int>(at / 3) + 1;
}

/// Date of a text kernel without its '@': year, month (name or number) and day, or day, month name and year;
/// then hours, minutes and seconds. Seconds since J2000 in a scale without leap seconds.
std::optional<double> parse_date(std::string_view word) {
    std::vector<std::string_view> parts;
    for (std::size_t i = 0; i < word.size();) {
        const std::size_t end = std::min(word.find_first_of("-/:T", i), word.size());
        // The T of OCT is no separator.
        std::size_t stop = end;
        if (stop < word.size() && word[stop] == 'T' && stop > i &&
            std::isalpha(static_cast<unsigned char>(word[i])))
            stop = std::min(word.find_first_of("-/:", i), word.size());
        parts.push_back(word.substr(i, stop - i));
        i = stop + 1;
    }
    if (parts.size() < 3 || parts.size() > 6) return std::nullopt;
    std::array<double, 6> values{};
    for (std::size_t i = 0; i < parts.size(); ++i) {
        if (i == 1)
            if (const auto month = month_number(parts[i])) {
                values[i] = *month;
                continue;
            }
        const auto number = decimal_number(parts[i]);
        if (!number || *number < 0 || (i != 5 && *number != std::floor(*number)) || *number > 9999)
            return std::nullopt;
        values[i] = *number;
    }
    if (values[0] <= 31 && values[2] > 31) std::swap(values[0], values[2]);
    if (values[3] > 24 || values[4] >= 60 || values[5] >= 61) return std::nullopt;
    double day0 = 0, day = 0;
    if (eraCal2jd(static_cast<int>(values[0]), static_cast<int>(values[1]), static_cast<int>(values[2]),
                  &day0, &day) != 0)
        return std::nullopt;
    return ((day0 - 2451545.0) + day) * 86400 + values[3] * 3600 + values[4] * 60 + values[5];
}

struct Token {
    enum class Kind { word, string, open, close, assign, append, end } kind = Kind::end;
    std::string_view text{};
    std::size_t line = 0;
};

/// Splits the data of a text kernel into tokens.
class Tokens {
public:
    Tokens(std::string_view text, const std::string& file) : text_(text), file_(file) {}

    Token next() {
        while (true) {
            if (at_ >= line_end_) {
                if (!next_data_line()) return {Token::Kind::end, {}, line_};
                continue;
            }
            const char c = text_[at_];
            if (!blank(c) && c != ',') break;
            ++at_;
        }
        const std::size_t start = at_;
        switch (text_[at_]) {
        case '(':
            ++at_;
            return {Token::Kind::open, text_.substr(start, 1), line_};
        case ')':
            ++at_;
            return {Token::Kind::close, text_.substr(start, 1), line_};
        case '=':
            ++at_;
            return {Token::Kind::assign, text_.substr(start, 1), line_};
        case '\'':
            return string();
        default:
            break;
        }
        if (text_.substr(at_, 2) == "+=") {
            at_ += 2;
            return {Token::Kind::append, text_.substr(start, 2), line_};
        }
        while (at_ < line_end_ && !blank(text_[at_]) && text_.substr(at_, 2) != "+=" &&
               std::string_view(",()='").find(text_[at_]) == std::string_view::npos)
            ++at_;
        return {Token::Kind::word, text_.substr(start, at_ - start), line_};
    }

    /// Whether a \begindata was met.
    [[nodiscard]] bool data_seen() const { return data_seen_; }

private:
    Token string() {
        const std::size_t start = ++at_;
        for (; at_ < line_end_; ++at_) {
            if (text_[at_] != '\'') continue;
            // Two quotes stand for one.
            if (at_ + 1 < line_end_ && text_[at_ + 1] == '\'') {
                ++at_;
                continue;
            }
            return {Token::Kind::string, text_.substr(start, at_++ - start), line_};
        }
        throw InputError(fmt::format("{}:{}: string without closing quote", file_, line_));
    }

    /// Moves to the next line between \begindata and \begintext. False: the text ends.
    bool next_data_line() {
        while (next_line_ < text_.size()) {
            const std::size_t start = next_line_;
            const std::size_t end = std::min(text_.find('\n', start), text_.size());
            next_line_ = end + 1;
            ++line_;
            std::string_view content = text_.substr(start, end - start);
            while (!content.empty() && blank(content.back()))
                content.remove_suffix(1);
            while (!content.empty() && blank(content.front()))
                content.remove_prefix(1);
            if (content == "\\begindata") {
                in_data_ = data_seen_ = true;
                continue;
            }
            if (content == "\\begintext") {
                in_data_ = false;
                continue;
            }
            if (!in_data_ || content.empty()) continue;
            at_ = start;
            line_end_ = end;
            return true;
        }
        return false;
    }

    std::string_view text_;
    const std::string& file_;
    std::size_t at_ = 0, line_end_ = 0, next_line_ = 0, line_ = 0;
    bool in_data_ = false, data_seen_ = false;
};

void add_value(KernelPool::Variable& variable, const Token& token) {
    if (token.kind == Token::Kind::string) {
        std::string text;
        for (std::size_t i = 0; i < token.text.size(); ++i) {
            text += token.text[i];
            if (token.text[i] == '\'') ++i;
        }
        variable.strings.push_back(std::move(text));
    } else if (token.text.starts_with('@')) {
        const auto date = parse_date(token.text.substr(1));
        if (!date)
            throw InputError(fmt::format("{}: '{}' is not a date, allowed as in @1972-JAN-1/12:00:00",
                                         variable.place, shown(token.text)));
        variable.numbers.push_back(*date);
    } else {
        const auto number = decimal_number(token.text);
        if (!number)
            throw InputError(fmt::format("{}: '{}' is not a number, a date (@) or a string in quotes",
                                         variable.place, shown(token.text)));
        variable.numbers.push_back(*number);
    }
    if (!variable.strings.empty() && !variable.numbers.empty())
        throw InputError(fmt::format("{}: numbers and strings in one variable", variable.place));
}

} // namespace

std::string kernel_name(std::string_view text) {
    std::string name;
    for (const char c : text) {
        if (blank(c) || c == '\n') {
            if (!name.empty() && name.back() != ' ') name += ' ';
        } else {
            name += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        }
    }
    if (!name.empty() && name.back() == ' ') name.pop_back();
    return name;
}

void KernelPool::read(const std::filesystem::path& file) {
    std::string text;
    if (const std::string why = read_plain_text(file, max_kernel_bytes, text); !why.empty())
        throw InputError(
            fmt::format("{}: neither a text kernel nor a DAF (SPK, CK, PCK): {}", file.string(), why), errno);
    read_text(text, file.string());
}

void KernelPool::read_text(const std::string& text, const std::string& file) {
    Tokens tokens(text, file);
    Token token = tokens.next();
    if (!tokens.data_seen() && !text.starts_with("KPL/"))
        throw InputError(fmt::format("{}: no line \\begindata: not a SPICE kernel", file));
    while (token.kind != Token::Kind::end) {
        const std::size_t line = token.line;
        if (token.kind != Token::Kind::word)
            throw InputError(fmt::format("{}:{}: '{}' where the name of a variable is expected", file, line,
                                         shown(token.text)));
        const std::string name(token.text);
        const Token operation = tokens.next();
        if (operation.kind != Token::Kind::assign && operation.kind != Token::Kind::append)
            throw InputError(fmt::format("{}:{}: '{}' is not followed by = or +=", file, line, shown(name)));
        Variable variable;
        if (operation.kind == Token::Kind::append)
            if (const Variable* present = find(name)) variable = *present;
        variable.place = fmt::format("{}:{}: {}", file, line, shown(name));
        token = tokens.next();
        const bool list = token.kind == Token::Kind::open;
        std::size_t added = 0;
        if (list) token = tokens.next();
        while (token.kind == Token::Kind::word || token.kind == Token::Kind::string) {
            add_value(variable, token);
            ++added;
            token = tokens.next();
            if (!list) break;
        }
        if (added == 0) throw InputError(fmt::format("{}: no value", variable.place));
        if (list) {
            if (token.kind != Token::Kind::close)
                throw InputError(fmt::format("{}: list without closing parenthesis", variable.place));
            token = tokens.next();
        }
        variables_[name] = std::move(variable);
    }
}

const KernelPool::Variable* KernelPool::find(const std::string& name) const {
    const auto found = variables_.find(name);
    return found == variables_.end() ? nullptr : &found->second;
}

std::span<const double> KernelPool::numbers(const std::string& name, std::size_t least,
                                            std::size_t most) const {
    const Variable* const variable = find(name);
    // A value of the other type is none, as in SPICE.
    if (variable == nullptr || !variable->strings.empty()) return {};
    if (variable->numbers.size() < least || variable->numbers.size() > most)
        throw InputError(fmt::format("{}: {} values, allowed {} to {}", variable->place,
                                     variable->numbers.size(), least, most));
    return variable->numbers;
}

std::optional<double> KernelPool::number(const std::string& name) const {
    const auto values = numbers(name, 1, 1);
    return values.empty() ? std::nullopt : std::optional(values.front());
}

std::optional<int> KernelPool::integer(const std::string& name) const {
    const auto value = number(name);
    if (!value) return std::nullopt;
    if (*value != std::floor(*value) || std::abs(*value) > std::numeric_limits<int>::max())
        throw InputError(fmt::format("{}: {} is not a whole number of 32 bits", find(name)->place, *value));
    return static_cast<int>(*value);
}

std::optional<std::string> KernelPool::string(const std::string& name) const {
    const Variable* const variable = find(name);
    if (variable == nullptr || variable->strings.empty()) return std::nullopt;
    if (variable->strings.size() != 1)
        throw InputError(fmt::format("{}: one string is expected", variable->place));
    return variable->strings.front();
}

} // namespace obscura::ephemeris
