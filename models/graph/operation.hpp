// SPDX-License-Identifier: Apache-2.0
// Operations of a model's graph: what each computes, in IEEE double arithmetic without contraction.
#pragma once

#include "core/math/trigonometry.hpp"
#include "core/math/vector_functions.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

namespace obscura::models {

/// Conditions are 1 and 0. One row of operation_table for each.
enum class Operation : std::uint8_t {
    constant,
    uniform, ///< parameter or global: the same for all lanes of a call
    input,   ///< varies from lane to lane
    add,
    subtract,
    multiply,
    divide,
    minimum,
    maximum,
    power,
    remainder,
    arc_tangent_2,
    less,
    less_or_equal,
    equal,
    both,
    either,
    negate,
    invert,
    absolute,
    square_root,
    round_down,
    exponential,
    logarithm,
    sine,
    cosine,
    tangent,
    arc_sine,
    arc_cosine,
    arc_tangent,
    select,
};

struct OperationRow {
    std::string_view name; ///< in listings
    int operands;
};
inline constexpr std::array<OperationRow, 31> operation_table{{
    {"constant", 0}, {"uniform", 0}, {"input", 0},  {"add", 2},  {"sub", 2},   {"mul", 2},  {"div", 2},
    {"min", 2},      {"max", 2},     {"pow", 2},    {"fmod", 2}, {"atan2", 2}, {"less", 2}, {"less_equal", 2},
    {"equal", 2},    {"and", 2},     {"or", 2},     {"neg", 1},  {"not", 1},   {"abs", 1},  {"sqrt", 1},
    {"floor", 1},    {"exp", 1},     {"log", 1},    {"sin", 1},  {"cos", 1},   {"tan", 1},  {"asin", 1},
    {"acos", 1},     {"atan", 1},    {"select", 3},
}};
[[nodiscard]] constexpr const OperationRow& row_of(Operation op) {
    return operation_table[static_cast<std::size_t>(op)];
}

/// e^x as vector_exp, but 0 below -700 and infinite above 709.
inline double model_exp(double x) {
    const double value = vector_exp(x);
    const double low = x < -700 ? 0.0 : value;
    const double high = x > 700 ? std::numeric_limits<double>::infinity() : low;
    return x != x ? x : high;
}
/// ln x; -infinity at 0 and for subnormal numbers, NaN below.
inline double model_log(double x) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double value = vector_log(x);
    const double finite = x < std::numeric_limits<double>::min() ? -infinity : value;
    const double high = x == infinity ? infinity : finite;
    return x >= 0 ? high : std::numeric_limits<double>::quiet_NaN();
}
/// x^y for x > 0; of x = 0 as C's, of x < 0 NaN unless y is a whole number.
inline double model_pow(double x, double y) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double magnitude = x < 0 ? -x : x;
    const double value = model_exp(y * model_log(magnitude));
    const double of_zero = y > 0 ? 0.0 : infinity;
    const double positive = magnitude == 0 ? of_zero : value;
    const bool whole = y == std::floor(y);
    const bool odd = whole && y * 0.5 != std::floor(y * 0.5);
    const double negative = whole ? (odd ? -positive : positive) : std::numeric_limits<double>::quiet_NaN();
    const double result = x < 0 ? negative : positive;
    return y == 0 ? 1.0 : (x != x || y != y ? std::numeric_limits<double>::quiet_NaN() : result);
}

} // namespace obscura::models
