// SPDX-License-Identifier: Apache-2.0
#include "core/text/number.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace obscura {
namespace {

/// Without a plus sign before a digit or a point, which std::from_chars does not take.
std::string_view without_plus(std::string_view text) {
    if (text.size() > 1 && text.front() == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
    return text;
}

} // namespace

std::optional<double> decimal_number(std::string_view text) noexcept {
    text = without_plus(text);
    // Fortran writes exponents of double precision with a D.
    std::array<char, 64> copy;
    if (const std::size_t d = text.find_first_of("dD"); d != std::string_view::npos) {
        if (d == 0 || text.size() > copy.size()) return std::nullopt;
        std::copy(text.begin(), text.end(), copy.begin());
        copy[d] = 'e';
        text = {copy.data(), text.size()};
    }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::result_out_of_range && end == text.data() + text.size()) {
        // Less than the smallest number is 0; from_chars does not say which side it is.
        const std::size_t e = text.find_first_of("eE");
        if (e != std::string_view::npos && e + 1 < text.size() && text[e + 1] == '-')
            return text.front() == '-' ? -0.0 : 0.0;
    }
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

bool is_number_not_finite(std::string_view text) noexcept {
    text = without_plus(text);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (end != text.data() + text.size()) return false;
    return error == std::errc::result_out_of_range || (error == std::errc{} && !std::isfinite(value));
}

std::optional<std::int64_t> whole_number(std::string_view text) noexcept {
    text = without_plus(text);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

} // namespace obscura
