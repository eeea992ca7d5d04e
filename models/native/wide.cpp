// SPDX-License-Identifier: Apache-2.0
#include "models/native/wide.hpp"

namespace obscura::models::native {
namespace {

using asmjit::Imm;
using asmjit::Operand;
namespace Inst = asmjit::x86::Inst;

Emitter& emitter_of(const Wide& a, const Wide& b) {
    return a.emitter != nullptr ? *a.emitter : *b.emitter;
}

Wide two_operands(std::uint32_t instruction, const Wide& a, const Wide& b) {
    Emitter& e = emitter_of(a, b);
    const asmjit::x86::Vec result = e.new_vector();
    e.cc.emit(instruction, result, a.loaded(e), b.operand(e));
    return {e, result};
}

/// Operation on all bits of `a` and of a constant.
Wide with_bits(std::uint32_t instruction, const Wide& a, std::uint64_t bits) {
    Emitter& e = *a.emitter;
    const asmjit::x86::Vec result = e.new_vector();
    e.cc.emit(instruction, result, a.loaded(e), e.constant(bits));
    return {e, result};
}
std::uint32_t and_id(const Emitter& e) {
    return e.is_avx512 ? Inst::kIdVpandq : Inst::kIdVpand;
}
std::uint32_t or_id(const Emitter& e) {
    return e.is_avx512 ? Inst::kIdVporq : Inst::kIdVpor;
}
std::uint32_t xor_id(const Emitter& e) {
    return e.is_avx512 ? Inst::kIdVpxorq : Inst::kIdVpxor;
}

Wide shifted_by(std::uint32_t instruction, const Wide& a, int bits) {
    Emitter& e = *a.emitter;
    const asmjit::x86::Vec result = e.new_vector();
    e.cc.emit(instruction, result, a.loaded(e), Imm(bits));
    return {e, result};
}

// Predicates of VCMPPD: ordered and quiet, but for "not equal", which a NaN is.
constexpr int compare_equal = 0x00, compare_not_equal = 0x04, compare_less = 0x11,
              compare_less_or_equal = 0x12;

WideMask compare(Emitter& e, const Wide& a, const Wide& b, int predicate) {
    WideMask mask;
    mask.emitter = &e;
    if (e.is_avx512) {
        mask.k = e.cc.newKq();
        e.cc.emit(Inst::kIdVcmppd, mask.k, a.loaded(e), b.operand(e), Imm(predicate));
    } else {
        mask.reg = e.new_vector();
        e.cc.emit(Inst::kIdVcmppd, mask.reg, a.loaded(e), b.operand(e), Imm(predicate));
    }
    return mask;
}

WideMask combined(const WideMask& a, const WideMask& b, std::uint32_t of_masks, std::uint32_t of_vectors) {
    Emitter& e = *a.emitter;
    WideMask result;
    result.emitter = &e;
    if (e.is_avx512) {
        result.k = e.cc.newKq();
        e.cc.emit(of_masks, result.k, a.k, b.k);
    } else {
        result.reg = e.new_vector();
        e.cc.emit(of_vectors, result.reg, a.reg, b.reg);
    }
    return result;
}

} // namespace

Wide operator+(const Wide& a, const Wide& b) {
    return two_operands(Inst::kIdVaddpd, a, b);
}
Wide operator-(const Wide& a, const Wide& b) {
    return two_operands(Inst::kIdVsubpd, a, b);
}
Wide operator*(const Wide& a, const Wide& b) {
    return two_operands(Inst::kIdVmulpd, a, b);
}
Wide operator/(const Wide& a, const Wide& b) {
    return two_operands(Inst::kIdVdivpd, a, b);
}
Wide smaller(const Wide& a, const Wide& b) {
    return two_operands(Inst::kIdVminpd, a, b);
}
Wide larger(const Wide& a, const Wide& b) {
    return two_operands(Inst::kIdVmaxpd, a, b);
}
Wide operator-(const Wide& a) {
    return a.emitter == nullptr ? Wide(-a.value) : with_bits(xor_id(*a.emitter), a, 0x8000000000000000);
}
Wide absolute(const Wide& a) {
    return with_bits(and_id(*a.emitter), a, 0x7fffffffffffffff);
}
Wide square_root(const Wide& a) {
    Emitter& e = *a.emitter;
    const asmjit::x86::Vec result = e.new_vector();
    e.cc.emit(Inst::kIdVsqrtpd, result, a.operand(e));
    return {e, result};
}
Wide round_down(const Wide& a) {
    Emitter& e = *a.emitter;
    const asmjit::x86::Vec result = e.new_vector();
    // Towards minus infinity, without an exception for inexact results.
    e.cc.emit(e.is_avx512 ? Inst::kIdVrndscalepd : Inst::kIdVroundpd, result, a.operand(e), Imm(9));
    return {e, result};
}

WideMask operator<(const Wide& a, const Wide& b) {
    return compare(emitter_of(a, b), a, b, compare_less);
}
WideMask operator<=(const Wide& a, const Wide& b) {
    return compare(emitter_of(a, b), a, b, compare_less_or_equal);
}
WideMask operator>(const Wide& a, const Wide& b) {
    return b < a;
}
WideMask operator>=(const Wide& a, const Wide& b) {
    return b <= a;
}
WideMask operator==(const Wide& a, const Wide& b) {
    return compare(emitter_of(a, b), a, b, compare_equal);
}
WideMask is_number(const Wide& a) {
    return a == a; // NOLINT(misc-redundant-expression): false for NaN
}
WideMask operator&(const WideMask& a, const WideMask& b) {
    return combined(a, b, Inst::kIdKandq, Inst::kIdVandpd);
}
WideMask operator|(const WideMask& a, const WideMask& b) {
    return combined(a, b, Inst::kIdKorq, Inst::kIdVorpd);
}
WideMask operator!(const WideMask& a) {
    Emitter& e = *a.emitter;
    WideMask result;
    result.emitter = &e;
    if (e.is_avx512) {
        result.k = e.cc.newKq();
        e.cc.emit(Inst::kIdKnotq, result.k, a.k);
    } else {
        result.reg = e.new_vector();
        e.cc.emit(Inst::kIdVxorpd, result.reg, a.reg, e.constant(~std::uint64_t{0}));
    }
    return result;
}

Wide select(const WideMask& when, const Wide& a, const Wide& b) {
    Emitter& e = *when.emitter;
    const asmjit::x86::Vec result = e.new_vector();
    // Loads stand before the instruction that the mask register is for.
    const asmjit::x86::Vec otherwise = b.loaded(e);
    const Operand chosen = a.operand(e);
    if (e.is_avx512)
        e.cc.k(when.k).emit(Inst::kIdVblendmpd, result, otherwise, chosen);
    else
        e.cc.emit(Inst::kIdVblendvpd, result, otherwise, chosen, when.reg);
    return {e, result};
}
WideMask select(const WideMask& when, const WideMask& a, const WideMask& b) {
    return (when & a) | ((!when) & b);
}

Wide power_of_two(const Wide& shifted) {
    return shifted_by(Inst::kIdVpsllq, with_bits(Inst::kIdVpaddq, shifted, 1023), 52);
}

void split(const Wide& x, Wide& mantissa, Wide& exponent) {
    constexpr std::uint64_t sqrt_half = 0x3fe6a09e667f3bcd;
    Emitter& e = *x.emitter;
    const Wide u = with_bits(Inst::kIdVpaddq, x, 0x3ff0000000000000 - sqrt_half);
    const Wide fraction = with_bits(and_id(e), u, 0x000fffffffffffff);
    mantissa = with_bits(Inst::kIdVpaddq, fraction, sqrt_half);
    const Wide biased = with_bits(or_id(e), shifted_by(Inst::kIdVpsrlq, u, 52), 0x4330000000000000);
    exponent = biased - (0x1p52 + 1023);
}

WideMask has_bit(const Wide& shifted, std::uint64_t more, std::uint64_t bit) {
    Emitter& e = *shifted.emitter;
    const Wide sum = more == 0 ? shifted : with_bits(Inst::kIdVpaddq, shifted, more);
    WideMask mask;
    mask.emitter = &e;
    if (e.is_avx512) {
        mask.k = e.cc.newKq();
        e.cc.emit(Inst::kIdVptestmq, mask.k, sum.loaded(e), e.constant(bit));
    } else {
        const Wide masked = with_bits(and_id(e), sum, bit);
        mask.reg = e.new_vector();
        e.cc.emit(Inst::kIdVpcmpeqq, mask.reg, masked.reg, e.constant(bit));
    }
    return mask;
}

Wide number_of(const WideMask& mask) {
    return select(mask, Wide(1.0), Wide(0.0));
}
WideMask is_true(Emitter& e, const Wide& a) {
    return compare(e, a, Wide(0.0), compare_not_equal);
}

} // namespace obscura::models::native
