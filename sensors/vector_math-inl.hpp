// SPDX-License-Identifier: Apache-2.0
// SIMD logarithm, exponential, sine, cosine and Philox; included once per Highway target.
//
// The same operations in the same order on every target: no fused multiply-add (absent before AVX2), no libm,
// no reciprocal estimates. Additions, products, quotients and square roots are correctly rounded everywhere,
// so all targets deliver the same bytes.

#if defined(OBSCURA_SENSORS_VECTOR_MATH_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef OBSCURA_SENSORS_VECTOR_MATH_INL
#undef OBSCURA_SENSORS_VECTOR_MATH_INL
#else
#define OBSCURA_SENSORS_VECTOR_MATH_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace obscura::sensors::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::ScalableTag<float>;
using U = hn::RebindToUnsigned<F>;
using I = hn::RebindToSigned<F>;
using VF = hn::Vec<F>;
using VU = hn::Vec<U>;
using VI = hn::Vec<I>;
using MF = hn::Mask<F>;

HWY_INLINE VF constant(float value) {
    return hn::Set(F(), value);
}

/// a0 + x (a1 + x (a2 + ...)), each step rounded.
template<class... Rest>
HWY_INLINE VF polynomial(VF x, float a0, Rest... rest) {
    if constexpr (sizeof...(rest) == 0)
        return constant(a0);
    else
        return hn::Add(constant(a0), hn::Mul(x, polynomial(x, rest...)));
}

/// Uniform in (0,1), 23 bits, exact in single precision: never 0 and never 1.
HWY_INLINE VF uniform(VU word) {
    const VF top = hn::ConvertTo(F(), hn::BitCast(I(), hn::ShiftRight<9>(word)));
    return hn::Mul(hn::Add(top, constant(0.5F)), constant(0x1p-23F));
}

/// Natural logarithm of positive normal numbers, 1 ulp. Coefficients of the Cephes library's logf (S.
/// Moshier).
HWY_INLINE VF log_of(VF x) {
    const VI bits = hn::BitCast(I(), x);
    // x = 2^e m with m in [sqrt(1/2), sqrt(2)).
    const VI shifted = hn::Sub(bits, hn::Set(I(), 0x3F3504F3));
    const VF e = hn::ConvertTo(F(), hn::ShiftRight<23>(shifted));
    const VI mantissa = hn::Add(hn::And(shifted, hn::Set(I(), 0x007FFFFF)), hn::Set(I(), 0x3F3504F3));
    const VF f = hn::Sub(hn::BitCast(F(), mantissa), constant(1));
    const VF square = hn::Mul(f, f);
    // Estrin's scheme: pairs first, for a shorter chain of dependent operations.
    const VF fourth = hn::Mul(square, square);
    const VF low = hn::Add(polynomial(f, 3.3333331174e-1F, -2.4999993993e-1F),
                           hn::Mul(square, polynomial(f, 2.0000714765e-1F, -1.6668057665e-1F)));
    const VF high = hn::Add(polynomial(f, 1.4249322787e-1F, -1.2420140846e-1F),
                            hn::Mul(square, polynomial(f, 1.1676998740e-1F, -1.1514610310e-1F)));
    VF y = hn::Add(low, hn::Mul(fourth, hn::Add(high, hn::Mul(fourth, constant(7.0376836292e-2F)))));
    y = hn::Mul(hn::Mul(y, f), square);
    y = hn::Add(y, hn::Mul(e, constant(-2.12194440e-4F)));
    y = hn::Sub(y, hn::Mul(square, constant(0.5F)));
    return hn::Add(hn::Add(f, y), hn::Mul(e, constant(0.693359375F)));
}

/// Exponential of numbers in [-80, 80], 1 ulp. Coefficients of Cephes' expf.
HWY_INLINE VF exp_of(VF x) {
    const VF n = hn::Floor(hn::Add(hn::Mul(x, constant(1.44269504088896341F)), constant(0.5F)));
    VF r = hn::Sub(x, hn::Mul(n, constant(0.693359375F)));
    r = hn::Sub(r, hn::Mul(n, constant(-2.12194440e-4F)));
    VF y = polynomial(r, 5.0000001201e-1F, 1.6666665459e-1F, 4.1665795894e-2F, 8.3334519073e-3F,
                      1.3981999507e-3F, 1.9875691500e-4F);
    y = hn::Add(hn::Add(hn::Mul(y, hn::Mul(r, r)), r), constant(1));
    const VI power = hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(I(), n), hn::Set(I(), 127)));
    return hn::Mul(y, hn::BitCast(F(), power));
}

/// Sine and cosine of 2 pi turns for turns in (0,1). Coefficients of Cephes' sinf and cosf.
HWY_INLINE void sincos_of_turns(VF turns, VF& sine, VF& cosine) {
    const VF quarters = hn::Mul(turns, constant(4));
    const VF nearest = hn::Floor(hn::Add(quarters, constant(0.5F)));
    const VF r = hn::Mul(hn::Sub(quarters, nearest), constant(1.57079632679489662F)); // [-pi/4, pi/4]
    const VF z = hn::Mul(r, r);
    const VF s = hn::Add(
        r, hn::Mul(hn::Mul(r, z), polynomial(z, -1.6666654611e-1F, 8.3321608736e-3F, -1.9515295891e-4F)));
    const VF c = hn::Add(hn::Sub(constant(1), hn::Mul(z, constant(0.5F))),
                         hn::Mul(hn::Mul(z, z), polynomial(z, 4.166664568298827e-2F, -1.388731625493765e-3F,
                                                           2.443315711809948e-5F)));
    const VI quadrant = hn::ConvertTo(I(), nearest); // 0 to 4
    const VI one = hn::Set(I(), 1);
    const MF odd = hn::RebindMask(F(), hn::Eq(hn::And(quadrant, one), one));
    // The second bit of the quadrant (for the cosine: of quadrant + 1) is the sign.
    const VF sine_sign = hn::BitCast(F(), hn::ShiftLeft<30>(hn::And(quadrant, hn::Set(I(), 2))));
    const VF cosine_sign =
        hn::BitCast(F(), hn::ShiftLeft<30>(hn::And(hn::Add(quadrant, one), hn::Set(I(), 2))));
    sine = hn::Xor(hn::IfThenElse(odd, c, s), sine_sign);
    cosine = hn::Xor(hn::IfThenElse(odd, s, c), cosine_sign);
}

/// Two independent standard normals per lane. G. Box, M. Muller, Ann. Math. Statist. 29 (1958).
HWY_INLINE void box_muller(VU first, VU second, VF& z0, VF& z1) {
    const VF radius = hn::Sqrt(hn::Mul(constant(-2), log_of(uniform(first))));
    VF sine, cosine;
    sincos_of_turns(uniform(second), sine, cosine);
    z0 = hn::Mul(radius, cosine);
    z1 = hn::Mul(radius, sine);
}

/// Philox 4x32-10 of (pixel, c1, c2, c3) under one key, as philox4x32() of core gives it, for many pixels.
///
/// Even and odd lanes are kept apart in the low halves of 64-bit lanes, where the round's multiplication is
/// one instruction and the upper halves are ignored. Half of the first two rounds does not depend on the
/// pixel and is precomputed.
class Philox {
public:
    HWY_INLINE Philox(std::uint32_t c1, std::uint32_t c2, std::uint32_t c3, std::uint32_t k0,
                      std::uint32_t k1) {
        const hn::RepartitionToWide<U> wide;
        const std::uint64_t first = std::uint64_t{multiplier1} * c2;
        // Words 0 and 1 after the first round, then the product of word 0 in the second one.
        const std::uint32_t word0 = static_cast<std::uint32_t>(first >> 32) ^ c1 ^ k0;
        const std::uint64_t second = std::uint64_t{multiplier0} * word0;
        const std::uint64_t constants[constant_count] = {
            c3 ^ k1,                                                 // round 1, word 2
            static_cast<std::uint32_t>(first) ^ (k0 + weyl0),        // round 2, word 0
            static_cast<std::uint32_t>(second >> 32) ^ (k1 + weyl1), // round 2, word 2
            static_cast<std::uint32_t>(second)};
        for (std::size_t i = 0; i < constant_count; ++i)
            hn::Store(hn::Set(wide, constants[i]), wide, constants_ + i * max_lanes);
        for (std::uint32_t round = 2; round < 10; ++round) {
            hn::Store(hn::Set(wide, std::uint64_t{k0 + round * weyl0}), wide, keys_ + 2 * round * max_lanes);
            hn::Store(hn::Set(wide, std::uint64_t{k1 + round * weyl1}), wide,
                      keys_ + (2 * round + 1) * max_lanes);
        }
    }

    HWY_INLINE void operator()(VU pixel, VU& w0, VU& w1, VU& w2, VU& w3) const {
        const U u;
        const Wide wide;
        const VU m0 = hn::Set(u, multiplier0);
        const VU m1 = hn::Set(u, multiplier1);
        VW a0 = hn::BitCast(wide, pixel), a1, a2, a3;
        VW b0 = hn::ShiftRight<32>(a0), b1, b2, b3;
        const auto known = [&](std::size_t i) HWY_ATTR { return hn::Load(wide, constants_ + i * max_lanes); };
        // Rounds 1 and 2.
        const VW pa = hn::MulEven(m0, hn::BitCast(u, a0)), pb = hn::MulEven(m0, hn::BitCast(u, b0));
        a2 = hn::Xor(hn::ShiftRight<32>(pa), known(0));
        b2 = hn::Xor(hn::ShiftRight<32>(pb), known(0));
        const VW qa = hn::MulEven(m1, hn::BitCast(u, a2)), qb = hn::MulEven(m1, hn::BitCast(u, b2));
        a0 = hn::Xor(hn::ShiftRight<32>(qa), known(1));
        b0 = hn::Xor(hn::ShiftRight<32>(qb), known(1));
        a2 = hn::Xor(pa, known(2));
        b2 = hn::Xor(pb, known(2));
        a1 = qa, b1 = qb, a3 = b3 = known(3);
        const auto round = [&](std::size_t r) HWY_ATTR {
            const VW key0 = hn::Load(wide, keys_ + 2 * r * max_lanes);
            const VW key1 = hn::Load(wide, keys_ + (2 * r + 1) * max_lanes);
            const VW pa0 = hn::MulEven(m0, hn::BitCast(u, a0)), pa1 = hn::MulEven(m1, hn::BitCast(u, a2));
            const VW pb0 = hn::MulEven(m0, hn::BitCast(u, b0)), pb1 = hn::MulEven(m1, hn::BitCast(u, b2));
            a0 = hn::Xor(hn::Xor(hn::ShiftRight<32>(pa1), a1), key0);
            b0 = hn::Xor(hn::Xor(hn::ShiftRight<32>(pb1), b1), key0);
            a2 = hn::Xor(hn::Xor(hn::ShiftRight<32>(pa0), a3), key1);
            b2 = hn::Xor(hn::Xor(hn::ShiftRight<32>(pb0), b3), key1);
            a1 = pa1, b1 = pb1, a3 = pa0, b3 = pb0;
        };
        round(2), round(3), round(4), round(5), round(6), round(7), round(8), round(9);
        const auto merge = [&](VW even, VW odd) HWY_ATTR {
            return hn::OddEven(hn::BitCast(u, hn::ShiftLeft<32>(odd)), hn::BitCast(u, even));
        };
        w0 = merge(a0, b0);
        w1 = merge(a1, b1);
        w2 = merge(a2, b2);
        w3 = merge(a3, b3);
    }

private:
    using Wide = hn::RepartitionToWide<U>;
    using VW = hn::Vec<Wide>;
    static constexpr std::uint32_t multiplier0 = 0xD2511F53U, multiplier1 = 0xCD9E8D57U;
    static constexpr std::uint32_t weyl0 = 0x9E3779B9U, weyl1 = 0xBB67AE85U;
    static constexpr std::size_t constant_count = 4;
    static constexpr std::size_t max_lanes = hn::MaxLanes(Wide());

    alignas(128) std::uint64_t constants_[constant_count * max_lanes];
    alignas(128) std::uint64_t keys_[20 * max_lanes];
};

} // namespace obscura::sensors::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
