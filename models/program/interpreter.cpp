// SPDX-License-Identifier: Apache-2.0
// The interpreter: one dispatch for each instruction and up to 128 lanes.
#include "core/math/vector_clones.hpp"
#include "models/program/program.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace obscura::models {
namespace {

/// Operand of an instruction: an array with a number for each lane, or one number for all lanes.
struct Source {
    const double* values;
    bool same;
};

template<typename F>
[[gnu::always_inline]] inline void unary(F compute, Source a, double* out, std::size_t lanes) {
#pragma GCC ivdep
    for (std::size_t i = 0; i < lanes; ++i)
        out[i] = compute(a.values[i]);
}

template<typename F>
[[gnu::always_inline]] inline void binary(F compute, Source a, Source b, double* out, std::size_t lanes) {
    if (a.same) {
        const double x = *a.values;
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = compute(x, b.values[i]);
    } else if (b.same) {
        const double y = *b.values;
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = compute(a.values[i], y);
    } else {
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = compute(a.values[i], b.values[i]);
    }
}

[[gnu::always_inline]] inline void select(Source when, Source a, Source b, double* out, std::size_t lanes) {
    if (when.same) {
        const Source chosen = *when.values != 0 ? a : b;
        return chosen.same ? (void)std::fill_n(out, lanes, *chosen.values)
                           : (void)std::memmove(out, chosen.values, lanes * sizeof(double));
    }
    const std::size_t step_a = a.same ? 0 : 1, step_b = b.same ? 0 : 1;
    if (step_a == 1 && step_b == 1) {
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = when.values[i] != 0 ? a.values[i] : b.values[i];
    } else if (step_a == 1) {
        const double y = *b.values;
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = when.values[i] != 0 ? a.values[i] : y;
    } else if (step_b == 1) {
        const double x = *a.values;
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = when.values[i] != 0 ? x : b.values[i];
    } else {
        const double x = *a.values, y = *b.values;
#pragma GCC ivdep
        for (std::size_t i = 0; i < lanes; ++i)
            out[i] = when.values[i] != 0 ? x : y;
    }
}

/// Runs one instruction. The formulas are those of result_of() (models/graph/graph.cpp).
[[gnu::always_inline]] inline void run_instruction(Operation operation, Source a, Source b, Source c,
                                                   double* out, std::size_t lanes) {
    const auto one = [&](auto compute) { unary(compute, a, out, lanes); };
    const auto two = [&](auto compute) { binary(compute, a, b, out, lanes); };
    switch (operation) {
    case Operation::constant:
    case Operation::uniform:
    case Operation::input:
        return;
    case Operation::add:
        return two([](double x, double y) { return x + y; });
    case Operation::subtract:
        return two([](double x, double y) { return x - y; });
    case Operation::multiply:
        return two([](double x, double y) { return x * y; });
    case Operation::divide:
        return two([](double x, double y) { return x / y; });
    case Operation::minimum:
        return two([](double x, double y) { return x < y ? x : y; });
    case Operation::maximum:
        return two([](double x, double y) { return x > y ? x : y; });
    case Operation::power:
        return two([](double x, double y) { return model_pow(x, y); });
    case Operation::remainder:
        return two([](double x, double y) { return std::fmod(x, y); });
    case Operation::arc_tangent_2:
        return two([](double x, double y) { return vector_atan2(x, y); });
    case Operation::less:
        return two([](double x, double y) { return x < y ? 1.0 : 0.0; });
    case Operation::less_or_equal:
        return two([](double x, double y) { return x <= y ? 1.0 : 0.0; });
    case Operation::equal:
        return two([](double x, double y) { return x == y ? 1.0 : 0.0; });
    case Operation::both:
        return two([](double x, double y) { return ((x != 0) & (y != 0)) ? 1.0 : 0.0; });
    case Operation::either:
        return two([](double x, double y) { return ((x != 0) | (y != 0)) ? 1.0 : 0.0; });
    case Operation::negate:
        return one([](double x) { return -x; });
    case Operation::invert:
        return one([](double x) { return x != 0 ? 0.0 : 1.0; });
    case Operation::absolute:
        return one([](double x) { return std::fabs(x); });
    case Operation::square_root:
        return one([](double x) { return std::sqrt(x); });
    case Operation::round_down:
        return one([](double x) { return std::floor(x); });
    case Operation::exponential:
        return one([](double x) { return model_exp(x); });
    case Operation::logarithm:
        return one([](double x) { return model_log(x); });
    case Operation::arc_sine:
        return one([](double x) { return vector_asin(x); });
    case Operation::arc_cosine:
        return one([](double x) { return vector_acos(x); });
    case Operation::arc_tangent:
        return one([](double x) { return vector_atan(x); });
    case Operation::sine:
        return one([](double x) {
            double s, k;
            vector_sincos(x, s, k);
            return s;
        });
    case Operation::cosine:
        return one([](double x) {
            double s, k;
            vector_sincos(x, s, k);
            return k;
        });
    case Operation::tangent:
        return one([](double x) {
            double s, k;
            vector_sincos(x, s, k);
            return s / k;
        });
    case Operation::select:
        return select(a, b, c, out, lanes);
    }
}

/// Numbers of the scratch memory, on the stack of the caller: 64 KiB.
constexpr std::size_t scratch_numbers = 8192;

} // namespace

/// With all that it calls made part of it, so that each clone has its own.
[[gnu::flatten]] OBSCURA_VECTOR_CLONES void Program::run_block(const double* uniforms,
                                                               const double* const* inputs,
                                                               double* const* outputs, std::size_t first,
                                                               std::size_t lanes) const noexcept {
    alignas(64) double scratch[scratch_numbers];
    const auto source = [&](const Operand& o) -> Source {
        switch (o.kind) {
        case Operand::Kind::slot:
            return {scratch + static_cast<std::size_t>(o.index) * lanes, false};
        case Operand::Kind::input:
            return {inputs[o.index] + first, false};
        case Operand::Kind::uniform:
            break;
        }
        return {uniforms + o.index, true};
    };
    for (const Instruction& i : instructions_)
        run_instruction(i.operation, source(i.operands[0]), source(i.operands[1]), source(i.operands[2]),
                        scratch + static_cast<std::size_t>(i.slot) * lanes, lanes);
    for (std::size_t k = 0; k < outputs_.size(); ++k) {
        const Source from = source(outputs_[k]);
        for (std::size_t i = 0; i < lanes; ++i)
            outputs[k][first + i] = from.values[from.same ? 0 : i];
    }
}

void Program::interpret(const Uniforms& uniforms, const double* const* inputs, double* const* outputs,
                        std::size_t lanes) const noexcept {
    const auto slots = static_cast<std::size_t>(std::max(slots_, 1));
    const std::size_t block = std::min(max_lanes, scratch_numbers / slots / lane_step * lane_step);
    for (std::size_t first = 0; first < lanes; first += block)
        run_block(uniforms.values().data(), inputs, outputs, first, std::min(block, lanes - first));
}

} // namespace obscura::models
