// SPDX-License-Identifier: Apache-2.0
#include "images/readers/pds_sample.hpp"

#include "core/text/number.hpp"
#include "core/text/text.hpp"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>

namespace obscura::images {
namespace {

using PdsKind = PdsSampleType::Kind;

/// A VAX number as the 16-bit words of the file, the first the most significant: sign, `exponent_bits`,
/// fraction with a hidden bit after the point (VAX Architecture Reference Manual, 2.2).
double vax_number(std::uint64_t word, int bits, int exponent_bits) {
    const int fraction_bits = bits - 1 - exponent_bits;
    const bool negative = (word >> (bits - 1) & 1) != 0;
    const auto exponent = static_cast<int>(word >> fraction_bits & ((std::uint64_t{1} << exponent_bits) - 1));
    if (exponent == 0) return negative ? std::numeric_limits<double>::quiet_NaN() : 0;
    const std::uint64_t hidden = std::uint64_t{1} << fraction_bits;
    const auto fraction = static_cast<double>((word & (hidden - 1)) | hidden);
    const double size = std::ldexp(fraction, exponent - (1 << (exponent_bits - 1)) - fraction_bits - 1);
    return negative ? -size : size;
}

/// Words of 16 bits, each with its low byte first.
std::uint64_t vax_word(const std::uint8_t* at, std::size_t bytes) {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < bytes; i += 2)
        word = word << 16 | std::uint64_t{at[i + 1]} << 8 | at[i];
    return word;
}

template<typename T, typename Word>
void decode_words(const std::uint8_t* from, std::size_t stride, bool little_endian, std::span<double> out) {
    static_assert(sizeof(T) == sizeof(Word));
    for (double& number : out) {
        std::uint64_t word = 0;
        if (little_endian)
            for (std::size_t i = 0; i < sizeof(Word); ++i)
                word |= std::uint64_t{from[i]} << (8 * i);
        else
            for (std::size_t i = 0; i < sizeof(Word); ++i)
                word = word << 8 | from[i];
        number = static_cast<double>(std::bit_cast<T>(static_cast<Word>(word)));
        from += stride;
    }
}

/// The number that the bits of a sample are.
double number_of_bits(const PdsSampleType& type, std::uint64_t bits) {
    const int size = static_cast<int>(8 * type.bytes);
    if (type.kind == PdsKind::vax) return vax_number(bits, size, 8);
    if (type.kind == PdsKind::vax_g) return vax_number(bits, size, 11);
    std::array<std::uint8_t, 8> bytes{};
    for (std::size_t i = 0; i < type.bytes; ++i)
        bytes[i] = static_cast<std::uint8_t>(bits >> (8 * i));
    double number = 0;
    decode_samples({type.kind, true, type.bytes}, bytes.data(), type.bytes, {&number, 1});
    return number;
}

struct RadixForm {
    int base;
    bool sign, negative;
    std::string_view digits;
};

std::optional<RadixForm> radix_form(std::string_view text) {
    RadixForm form{16, false, false, {}};
    const auto take_sign = [&](std::string_view& from) {
        if (from.empty() || (from.front() != '-' && from.front() != '+')) return;
        form.sign = true;
        form.negative = form.negative != (from.front() == '-');
        from.remove_prefix(1);
    };
    take_sign(text);
    if (text.starts_with("0x") || text.starts_with("0X")) {
        form.digits = text.substr(2);
        return form;
    }
    const std::size_t mark = text.find('#');
    if (mark == std::string_view::npos || text.size() < mark + 3 || text.back() != '#') return std::nullopt;
    const auto [end, error] = std::from_chars(text.data(), text.data() + mark, form.base);
    if (error != std::errc{} || end != text.data() + mark || form.base < 2 || form.base > 16)
        return std::nullopt;
    form.digits = text.substr(mark + 1, text.size() - mark - 2);
    take_sign(form.digits);
    return form;
}

} // namespace

void decode_samples(const PdsSampleType& type, const std::uint8_t* from, std::size_t stride,
                    std::span<double> out) {
    if (type.kind == PdsKind::vax || type.kind == PdsKind::vax_g) {
        for (double& number : out) {
            number = vax_number(vax_word(from, type.bytes), static_cast<int>(8 * type.bytes),
                                type.kind == PdsKind::vax ? 8 : 11);
            from += stride;
        }
        return;
    }
    const bool little = type.little_endian;
    const bool negative = type.kind == PdsKind::signed_integer, real = type.kind == PdsKind::real;
    switch (type.bytes) {
    case 1:
        return negative ? decode_words<std::int8_t, std::uint8_t>(from, stride, little, out)
                        : decode_words<std::uint8_t, std::uint8_t>(from, stride, little, out);
    case 2:
        return negative ? decode_words<std::int16_t, std::uint16_t>(from, stride, little, out)
                        : decode_words<std::uint16_t, std::uint16_t>(from, stride, little, out);
    case 4:
        if (real) return decode_words<float, std::uint32_t>(from, stride, little, out);
        return negative ? decode_words<std::int32_t, std::uint32_t>(from, stride, little, out)
                        : decode_words<std::uint32_t, std::uint32_t>(from, stride, little, out);
    default:
        if (real) return decode_words<double, std::uint64_t>(from, stride, little, out);
        return negative ? decode_words<std::int64_t, std::uint64_t>(from, stride, little, out)
                        : decode_words<std::uint64_t, std::uint64_t>(from, stride, little, out);
    }
}

std::optional<double> sample_constant(const PdsSampleType& type, std::string_view text) {
    std::optional<double> number;
    if (const std::optional<RadixForm> form = radix_form(text)) {
        std::uint64_t bits = 0;
        const char* const last = form->digits.data() + form->digits.size();
        const auto [end, error] = std::from_chars(form->digits.data(), last, bits, form->base);
        if (error != std::errc{} || end != last) return std::nullopt;
        if (!form->sign) {
            if (type.bytes < 8 && bits >> (8 * type.bytes) != 0) return std::nullopt;
            number = number_of_bits(type, bits);
            return std::isfinite(*number) ? number : std::nullopt;
        }
        number = form->negative ? -static_cast<double>(bits) : static_cast<double>(bits);
    } else {
        number = decimal_number(text);
    }
    return number ? as_sample(type, *number) : std::nullopt;
}

std::optional<double> as_sample(const PdsSampleType& type, double number) {
    if (type.is_real()) return type.bytes == 4 ? static_cast<double>(static_cast<float>(number)) : number;
    const int bits = static_cast<int>(8 * type.bytes);
    const bool negative = type.kind == PdsKind::signed_integer;
    const double least = negative ? -std::ldexp(1, bits - 1) : 0;
    // Numbers of 64 bits are read as reals: the largest is rounded up.
    const double largest = std::ldexp(1, negative ? bits - 1 : bits) - (bits < 64 ? 1 : 0);
    if (number == std::floor(number) && number >= least && number <= largest) return number;
    return std::nullopt;
}

bool says_nothing(std::string_view text) {
    const std::string word = upper_case(text);
    return word.empty() || word == "N/A" || word == "UNK" || word == "NULL" || word == "NONE" ||
           word == "NOT APPLICABLE" || word == "UNKNOWN";
}

} // namespace obscura::images
