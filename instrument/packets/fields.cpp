// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/fields.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace obscura::instrument {
namespace {

double as_double(const FieldValue& value) {
    return std::visit([](auto number) { return static_cast<double>(number); }, value);
}

std::uint64_t as_unsigned(const FieldValue& value) {
    if (const auto* plain = std::get_if<std::uint64_t>(&value)) return *plain;
    if (const auto* number = std::get_if<std::int64_t>(&value))
        return static_cast<std::uint64_t>(std::max<std::int64_t>(*number, 0));
    const double number = as_double(value);
    constexpr double limit = 18446744073709551616.0; // 2^64
    if (!(number > 0)) return 0;
    return number >= limit ? UINT64_MAX : static_cast<std::uint64_t>(number);
}

std::int64_t as_signed(const FieldValue& value) {
    if (const auto* plain = std::get_if<std::int64_t>(&value)) return *plain;
    if (const auto* number = std::get_if<std::uint64_t>(&value))
        return static_cast<std::int64_t>(std::min<std::uint64_t>(*number, INT64_MAX));
    constexpr double limit = 9223372036854775808.0; // 2^63
    const double number = as_double(value);
    if (std::isnan(number)) return 0;
    if (number >= limit) return INT64_MAX;
    return number <= -limit ? INT64_MIN : static_cast<std::int64_t>(number);
}

} // namespace

std::uint64_t encode(FieldType type, const FieldValue& value) {
    switch (type) {
    case FieldType::f32:
        return std::bit_cast<std::uint32_t>(static_cast<float>(as_double(value)));
    case FieldType::f64:
        return std::bit_cast<std::uint64_t>(as_double(value));
    case FieldType::i64:
        return std::bit_cast<std::uint64_t>(as_signed(value));
    case FieldType::u64:
        return as_unsigned(value);
    default:
        return std::min(as_unsigned(value), (std::uint64_t{1} << (8 * bytes_of(type))) - 1);
    }
}

double decode(FieldType type, std::uint64_t bits) {
    switch (type) {
    case FieldType::f32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    case FieldType::f64:
        return std::bit_cast<double>(bits);
    case FieldType::i64:
        return static_cast<double>(std::bit_cast<std::int64_t>(bits));
    default:
        return static_cast<double>(bits);
    }
}

} // namespace obscura::instrument
