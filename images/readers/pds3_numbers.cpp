// SPDX-License-Identifier: Apache-2.0
#include "images/readers/pds3_numbers.hpp"

#include "core/text/number.hpp"
#include "core/text/text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <string>

namespace obscura::images {
namespace {

/// Value of a sample whose bits are `word`.
double value_of_bits(const Pds3SampleType& type, std::uint64_t word) {
    if (type.kind == Pds3SampleType::Kind::real)
        return type.bytes == 4 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(word)))
                               : std::bit_cast<double>(word);
    if (type.kind == Pds3SampleType::Kind::signed_integer) {
        const std::uint64_t sign = std::uint64_t{1} << (8 * type.bytes - 1);
        return static_cast<double>(static_cast<std::int64_t>(word ^ sign) - static_cast<std::int64_t>(sign));
    }
    return static_cast<double>(word);
}

/// Bits of "16#8000#" (any radix from 2 to 16) or "0x8000".
std::optional<std::uint64_t> bits_of(std::string_view text) {
    int radix = 0;
    if (text.starts_with("0x") || text.starts_with("0X")) {
        radix = 16;
        text.remove_prefix(2);
    } else if (const std::size_t mark = text.find('#');
               mark != std::string_view::npos && text.ends_with('#')) {
        const auto given = whole_number(text.substr(0, mark));
        if (!given || *given < 2 || *given > 16 || mark + 1 >= text.size()) return std::nullopt;
        radix = static_cast<int>(*given);
        text = text.substr(mark + 1, text.size() - mark - 2);
    } else {
        return std::nullopt;
    }
    std::uint64_t bits = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), bits, radix);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return bits;
}

} // namespace

double pds3_sample(const Pds3SampleType& type, const std::uint8_t* at) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < type.bytes; ++i)
        word |= std::uint64_t{at[type.little_endian ? i : type.bytes - 1 - i]} << (8 * i);
    return value_of_bits(type, word);
}

std::optional<double> pds3_number(std::string_view text, const Pds3SampleType& type) {
    text = trimmed(text, " \t\r\n\"'");
    if (const auto bits = bits_of(text)) {
        // More bits than a sample has: no sample is that.
        if (type.bytes < 8 && *bits >> (8 * type.bytes) != 0) return std::nullopt;
        return value_of_bits(type, *bits);
    }
    const auto value = decimal_number(text);
    const bool single = type.kind == Pds3SampleType::Kind::real && type.bytes == 4;
    return value && single ? static_cast<double>(static_cast<float>(*value)) : value;
}

std::vector<double> pds3_missing(const PdsLabel& label, const Pds3SampleType& type) {
    constexpr std::array keywords{"MISSING_CONSTANT",
                                  "MISSING",
                                  "CORE_MISSING_CONSTANT",
                                  "NULL_CONSTANT",
                                  "NULL",
                                  "CORE_NULL",
                                  "INVALID_CONSTANT",
                                  "INVALID",
                                  "CORE_INVALID_CONSTANT",
                                  "UNKNOWN_CONSTANT",
                                  "NOT_APPLICABLE_CONSTANT",
                                  "DUMMY"};
    std::vector<double> missing;
    for (const char* const keyword : keywords) {
        const std::string key = std::string("IMAGE.") + keyword;
        if (!label.has(key)) continue;
        const auto number = pds3_number(label.text(key, ""), type);
        if (number && std::find(missing.begin(), missing.end(), *number) == missing.end())
            missing.push_back(*number);
    }
    return missing;
}

} // namespace obscura::images
