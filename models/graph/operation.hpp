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

/// What is known of an operation.
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

/// e^x as vector_exp, but 0 below -700 and infinite above 700.
template<typename Number>
inline Number model_exp(Number x) {
    const Number value = vector_exp(x);
    const Number low = select(x < -700.0, Number(0), value);
    const Number high = select(x > 700.0, Number(std::numeric_limits<double>::infinity()), low);
    return select(is_number(x), high, x);
}
/// ln x; -infinity at 0 and for subnormal numbers, NaN below.
template<typename Number>
inline Number model_log(Number x) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Number value = vector_log(x);
    const Number finite = select(x < std::numeric_limits<double>::min(), Number(-infinity), value);
    const Number high = select(x == infinity, Number(infinity), finite);
    return select(x >= 0.0, high, Number(std::numeric_limits<double>::quiet_NaN()));
}
inline double round_down(double x) {
    return std::floor(x);
}
/// x^y for x > 0; of x = 0 as C's, of x < 0 NaN unless y is a whole number.
template<typename Number>
inline Number model_pow(Number x, Number y) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Number none = std::numeric_limits<double>::quiet_NaN();
    const Number magnitude = select(x < 0.0, -x, x);
    const Number value = model_exp(y * model_log(magnitude));
    const Number of_zero = select(y > 0.0, Number(0), Number(infinity));
    const Number positive = select(magnitude == 0.0, of_zero, value);
    const Number half = y * 0.5;
    const Number of_odd = select(half == round_down(half), positive, -positive);
    const Number negative = select(y == round_down(y), of_odd, none);
    const Number result = select(x < 0.0, negative, positive);
    const Number known = select(is_number(x), select(is_number(y), result, none), none);
    return select(y == 0.0, Number(1), known);
}

} // namespace obscura::models
