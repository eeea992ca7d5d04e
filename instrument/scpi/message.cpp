// SPDX-License-Identifier: Apache-2.0
#include "instrument/scpi/message.hpp"

#include "core/text/text.hpp"
#include "instrument/scpi/errors.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace obscura::instrument {
namespace {

constexpr std::size_t max_digits = 255; // IEEE 488.2, 7.7.2.4.1
constexpr int largest_exponent = 32000;

// ASCII only, whatever the locale.
bool is_blank(char c) {
    return static_cast<unsigned char>(c) <= ' ';
}
bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
bool is_letter(char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}
bool is_word(char c) {
    return is_letter(c) || is_digit(c) || c == '_';
}
} // namespace

void MessageParser::skip_blanks() {
    while (!at_end() && is_blank(peek()))
        ++place_;
}

std::string MessageParser::mnemonic() {
    const std::size_t begin = place_;
    if (!is_letter(peek())) throw ScpiError(ScpiCode::invalid_character);
    while (is_word(peek()))
        ++place_;
    if (place_ - begin > max_mnemonic)
        throw ScpiError(ScpiCode::mnemonic_too_long, std::string(text_.substr(begin, max_mnemonic)));
    std::string name(text_.substr(begin, place_ - begin));
    std::transform(name.begin(), name.end(), name.begin(), upper_case_letter);
    return name;
}

void MessageParser::header(ProgramUnit& unit) {
    if (peek() == '*') {
        ++place_;
        unit.common = true;
        unit.header.push_back(mnemonic());
    } else {
        if (peek() == ':') {
            ++place_;
            unit.rooted = true;
        }
        unit.header.push_back(mnemonic());
        while (peek() == ':') {
            ++place_;
            if (unit.header.size() == max_nodes) throw ScpiError(ScpiCode::undefined_header);
            unit.header.push_back(mnemonic());
        }
    }
    if (peek() == '?') {
        ++place_;
        unit.query = true;
    }
    if (!at_end() && !is_blank(peek()) && peek() != ';')
        throw ScpiError(is_word(peek()) || peek() == '"' || peek() == '\'' ? ScpiCode::header_separator_error
                                                                           : ScpiCode::invalid_character);
}

Parameter MessageParser::decimal() {
    Parameter result;
    result.kind = Parameter::Kind::number;
    const std::size_t begin = place_;
    const auto digits = [this] {
        const std::size_t first = place_;
        while (is_digit(peek()))
            ++place_;
        return place_ - first;
    };
    if (peek() == '+' || peek() == '-') ++place_;
    std::size_t count = digits();
    if (peek() == '.') {
        ++place_;
        count += digits();
    }
    if (count == 0) throw ScpiError(ScpiCode::invalid_character_in_number);
    if (count > max_digits) throw ScpiError(ScpiCode::too_many_digits);
    // "5 E3" has the exponent of 5E3; "5 EV" has a suffix.
    const std::size_t mantissa_end = place_;
    std::string number(text_.substr(begin, place_ - begin));
    skip_blanks();
    if (upper_case_letter(peek()) == 'E') {
        ++place_;
        skip_blanks();
        std::string exponent = "e";
        if (peek() == '+' || peek() == '-') {
            exponent += peek();
            ++place_;
        }
        const std::size_t first = place_;
        if (digits() > 0) {
            int value = largest_exponent + 1;
            (void)std::from_chars(text_.data() + first, text_.data() + place_, value);
            if (value > largest_exponent) throw ScpiError(ScpiCode::exponent_too_large);
            number += exponent + std::string(text_.substr(first, place_ - first));
        } else {
            place_ = mantissa_end;
        }
    } else {
        place_ = mantissa_end;
    }
    const char* const from = number.data() + (number[0] == '+' ? 1 : 0);
    const auto [end, error] = std::from_chars(from, number.data() + number.size(), result.number);
    if (error == std::errc::result_out_of_range || !std::isfinite(result.number))
        throw ScpiError(ScpiCode::exponent_too_large, number.substr(0, 32));
    result.text = std::move(number);
    skip_blanks();
    const std::size_t suffix = place_;
    while (is_letter(peek()) || peek() == '/')
        ++place_;
    if (place_ - suffix > max_mnemonic) throw ScpiError(ScpiCode::invalid_suffix);
    result.suffix = text_.substr(suffix, place_ - suffix);
    std::transform(result.suffix.begin(), result.suffix.end(), result.suffix.begin(), upper_case_letter);
    return result;
}

Parameter MessageParser::based_number() {
    ++place_; // "#"
    int base = 0;
    switch (upper_case_letter(peek())) {
    case 'H':
        base = 16;
        break;
    case 'Q':
        base = 8;
        break;
    case 'B':
        base = 2;
        break;
    default:
        throw ScpiError(is_digit(peek()) ? ScpiCode::block_data_not_allowed : ScpiCode::syntax_error);
    }
    ++place_;
    Parameter result;
    result.kind = Parameter::Kind::number;
    std::uint32_t value = 0;
    const char* const begin = text_.data() + place_;
    const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value, base);
    if (end == begin) throw ScpiError(ScpiCode::invalid_character_in_number);
    if (error != std::errc{}) throw ScpiError(ScpiCode::too_many_digits);
    result.text = std::string(begin, end);
    result.number = value;
    place_ += static_cast<std::size_t>(end - begin);
    return result;
}

Parameter MessageParser::quoted() {
    Parameter result;
    result.kind = Parameter::Kind::string;
    const char quote = peek();
    for (++place_; !at_end(); ++place_) {
        const char c = peek();
        if (c == quote) {
            ++place_;
            if (peek() != quote) return result;
        } else if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~') {
            throw ScpiError(ScpiCode::invalid_string_data);
        }
        result.text += c;
    }
    throw ScpiError(ScpiCode::invalid_string_data);
}

Parameter MessageParser::word() {
    Parameter result;
    while (is_word(peek()))
        result.text += text_[place_++];
    if (result.text.size() > max_word_bytes)
        throw ScpiError(ScpiCode::character_data_too_long, result.text.substr(0, max_word_bytes));
    return result;
}

Parameter MessageParser::parameter() {
    const char c = peek();
    if (is_digit(c) || c == '+' || c == '-' || c == '.') return decimal();
    if (is_letter(c)) return word();
    switch (c) {
    case '"':
    case '\'':
        return quoted();
    case '#':
        return based_number();
    case '(':
        throw ScpiError(ScpiCode::expression_data_not_allowed);
    case ',':
    case ';':
    case '\0':
        throw ScpiError(ScpiCode::syntax_error);
    default:
        throw ScpiError(ScpiCode::invalid_character);
    }
}

std::optional<ProgramUnit> MessageParser::next() {
    skip_blanks();
    if (at_end()) return std::nullopt;
    ProgramUnit unit;
    header(unit);
    skip_blanks();
    if (!at_end() && peek() != ';') {
        while (true) {
            if (unit.parameters.size() == max_parameters) throw ScpiError(ScpiCode::parameter_not_allowed);
            unit.parameters.push_back(parameter());
            skip_blanks();
            if (peek() != ',') break;
            ++place_;
            skip_blanks();
        }
        if (!at_end() && peek() != ';') throw ScpiError(ScpiCode::invalid_separator);
    }
    if (peek() == ';') {
        ++place_;
        skip_blanks();
    }
    return unit;
}

} // namespace obscura::instrument
