// SPDX-License-Identifier: Apache-2.0
// Numbers and conditions side by side in a register, as values of the machine code that is being made: C++
// that computes with them emits the instructions.
#pragma once

#include <asmjit/x86.h>

#include <bit>
#include <cstdint>
#include <vector>

namespace obscura::models::native {

/// Makes instructions for one width. Thread-bound.
class Emitter {
public:
    Emitter(asmjit::x86::Compiler& compiler, bool avx512) : cc(compiler), is_avx512(avx512) {}

    asmjit::x86::Compiler& cc;
    const bool is_avx512;
    asmjit::x86::Gp constants_base;
    std::vector<std::uint64_t> constants; ///< bits of each, in the order of their places

    [[nodiscard]] asmjit::x86::Vec new_vector() {
        return is_avx512 ? asmjit::x86::Vec(cc.newZmm()) : asmjit::x86::Vec(cc.newYmm());
    }
    [[nodiscard]] asmjit::x86::Mem at(const asmjit::x86::Gp& base, std::size_t place) const {
        const auto offset = static_cast<std::int32_t>(place * 64);
        return is_avx512 ? asmjit::x86::zmmword_ptr(base, offset) : asmjit::x86::ymmword_ptr(base, offset);
    }
    /// Place in memory of eight copies of a constant.
    [[nodiscard]] asmjit::x86::Mem constant(std::uint64_t bits) {
        for (std::size_t i = 0; i < constants.size(); ++i)
            if (constants[i] == bits) return at(constants_base, i);
        constants.push_back(bits);
        return at(constants_base, constants.size() - 1);
    }
};

/// Number: a register, a place in memory or a constant.
struct Wide {
    Wide(double constant) : value(constant) {} // NOLINT(google-explicit-constructor)
    Wide(Emitter& the_emitter, const asmjit::x86::Vec& the_register)
        : emitter(&the_emitter), reg(the_register) {}
    Wide(Emitter& the_emitter, const asmjit::x86::Mem& place)
        : emitter(&the_emitter), memory(place), in_memory(true) {}

    Emitter* emitter = nullptr; ///< null: a constant
    asmjit::x86::Vec reg{};
    asmjit::x86::Mem memory{};
    bool in_memory = false;
    double value = 0;

    /// As an operand that may be in memory.
    [[nodiscard]] asmjit::Operand operand(Emitter& e) const {
        if (emitter == nullptr) return e.constant(std::bit_cast<std::uint64_t>(value));
        return in_memory ? asmjit::Operand(memory) : asmjit::Operand(reg);
    }
    /// In a register.
    [[nodiscard]] asmjit::x86::Vec loaded(Emitter& e) const {
        if (emitter != nullptr && !in_memory) return reg;
        const asmjit::x86::Vec loaded = e.new_vector();
        e.cc.emit(asmjit::x86::Inst::kIdVmovapd, loaded, operand(e));
        return loaded;
    }
};

/// Condition: a mask register with AVX-512, all bits of each number else.
struct WideMask {
    Emitter* emitter = nullptr;
    asmjit::x86::KReg k{};
    asmjit::x86::Vec reg{};
};

[[nodiscard]] Wide operator+(const Wide& a, const Wide& b);
[[nodiscard]] Wide operator-(const Wide& a, const Wide& b);
[[nodiscard]] Wide operator*(const Wide& a, const Wide& b);
[[nodiscard]] Wide operator/(const Wide& a, const Wide& b);
[[nodiscard]] Wide operator-(const Wide& a);
[[nodiscard]] WideMask operator<(const Wide& a, const Wide& b);
[[nodiscard]] WideMask operator<=(const Wide& a, const Wide& b);
[[nodiscard]] WideMask operator>(const Wide& a, const Wide& b);
[[nodiscard]] WideMask operator>=(const Wide& a, const Wide& b);
[[nodiscard]] WideMask operator==(const Wide& a, const Wide& b);
[[nodiscard]] WideMask is_number(const Wide& a);
[[nodiscard]] WideMask operator&(const WideMask& a, const WideMask& b);
[[nodiscard]] WideMask operator|(const WideMask& a, const WideMask& b);
[[nodiscard]] WideMask operator!(const WideMask& a);
/// a < b ? a : b, a > b ? a : b.
[[nodiscard]] Wide smaller(const Wide& a, const Wide& b);
[[nodiscard]] Wide larger(const Wide& a, const Wide& b);
[[nodiscard]] Wide absolute(const Wide& a);
[[nodiscard]] Wide square_root(const Wide& a);
[[nodiscard]] Wide round_down(const Wide& a);
[[nodiscard]] Wide select(const WideMask& when, const Wide& a, const Wide& b);
[[nodiscard]] WideMask select(const WideMask& when, const WideMask& a, const WideMask& b);
/// As of numbers, see core/math/vector_functions.hpp and trigonometry.hpp.
[[nodiscard]] Wide power_of_two(const Wide& shifted);
void split(const Wide& x, Wide& mantissa, Wide& exponent);
[[nodiscard]] WideMask has_bit(const Wide& shifted, std::uint64_t more, std::uint64_t bit);
/// 1 and 0, and what is not 0.
[[nodiscard]] Wide number_of(const WideMask& mask);
[[nodiscard]] WideMask is_true(Emitter& e, const Wide& a);

} // namespace obscura::models::native
