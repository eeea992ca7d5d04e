// SPDX-License-Identifier: Apache-2.0
// Lanes of packets in vector registers, and bilinear patches of tiles under them; included once per Highway
// target.

#if defined(OBSCURA_RENDERER_TILE_PATCHES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef OBSCURA_RENDERER_TILE_PATCHES_INL
#undef OBSCURA_RENDERER_TILE_PATCHES_INL
#else
#define OBSCURA_RENDERER_TILE_PATCHES_INL
#endif

#include "renderer/packets/packet.hpp"

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace obscura::renderer::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, packet_size>;
using I = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<I>;
using M = hn::Mask<D>;

HWY_INLINE V set(double value) {
    return hn::Set(D(), value);
}

HWY_INLINE std::uint32_t mask_bits(M mask, int first) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(D(), mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) << first;
}

/// Pairs of neighbouring floats at addresses.
HWY_INLINE VI load_pairs(VI addresses) {
    // Offsets from a null base are addresses.
    return hn::GatherOffset(I(), static_cast<const std::int64_t*>(nullptr), addresses);
}
HWY_INLINE V first_floats(VI pairs) {
    const hn::Rebind<std::uint32_t, D> narrow;
    const hn::Rebind<float, D> floats;
    const hn::RebindToUnsigned<D> wide;
    return hn::PromoteTo(D(), hn::BitCast(floats, hn::TruncateTo(narrow, hn::BitCast(wide, pairs))));
}
HWY_INLINE V second_floats(VI pairs) {
    return first_floats(hn::ShiftRight<32>(pairs));
}
/// Whole numbers from 0 to 2^32 - 1.
HWY_INLINE VI to_integers(V numbers) {
    const VI bits = hn::BitCast(I(), hn::Add(numbers, set(0x1p52)));
    return hn::And(bits, hn::Set(I(), 0xffffffff));
}

/// 1 / x of powers of two.
HWY_INLINE V reciprocal_of_power(V x) {
    const I i64;
    return hn::BitCast(D(), hn::Sub(hn::Set(i64, 0x7fe0000000000000), hn::BitCast(i64, x)));
}

/// Bilinear patches under rays: height above the patch and its derivative along the ray.
template<bool plane>
struct Patches {
    V ua, ub, va, vb, wa, wb, miss2, speed2;
    V h, hs, hr, hsr, half, first_i, first_j; ///< first: half_cells less the cell's number on the face

    /// Takes over the patches of some lanes, with their rays.
    HWY_INLINE void take(M lanes, const Patches& other) {
        const auto pick = [&](V& mine, V theirs) { mine = hn::IfThenElse(lanes, theirs, mine); };
        ua = other.ua;
        ub = other.ub;
        va = other.va;
        vb = other.vb;
        wa = other.wa;
        wb = other.wb;
        miss2 = other.miss2;
        speed2 = other.speed2;
        half = other.half;
        pick(h, other.h);
        pick(hs, other.hs);
        pick(hr, other.hr);
        pick(hsr, other.hsr);
        pick(first_i, other.first_i);
        pick(first_j, other.first_j);
    }

    HWY_INLINE void at(V x, V& height, V& slope) const {
        V inverse, u, v;
        if constexpr (plane) {
            inverse = set(1);
            u = hn::Add(ua, hn::Mul(ub, x));
            v = hn::Add(va, hn::Mul(vb, x));
        } else {
            inverse = hn::Div(set(1), hn::Add(wa, hn::Mul(wb, x)));
            u = hn::Mul(hn::Add(ua, hn::Mul(ub, x)), inverse);
            v = hn::Mul(hn::Add(va, hn::Mul(vb, x)), inverse);
        }
        const V s = hn::Add(hn::Mul(u, half), first_i), r = hn::Add(hn::Mul(v, half), first_j);
        const V scale = hn::Mul(inverse, half);
        const V s_slope = hn::Mul(hn::Sub(ub, hn::Mul(u, wb)), scale);
        const V r_slope = hn::Mul(hn::Sub(vb, hn::Mul(v, wb)), scale);
        V above, rises;
        if constexpr (plane) {
            above = hn::Add(miss2, hn::Mul(speed2, x));
            rises = speed2;
        } else {
            const V along = hn::Mul(speed2, x);
            const V radius = hn::Sqrt(hn::Add(miss2, hn::Mul(along, x)));
            above = hn::Sub(radius, set(1));
            rises = hn::Div(along, radius);
        }
        const V patch_s = hn::Add(hs, hn::Mul(r, hsr)), patch_r = hn::Add(hr, hn::Mul(s, hsr));
        height = hn::Sub(above, hn::Add(hn::Add(h, hn::Mul(s, hs)), hn::Mul(r, patch_r)));
        slope = hn::Sub(hn::Sub(rises, hn::Mul(s_slope, patch_s)), hn::Mul(r_slope, patch_r));
    }

    /// Newton's method, kept within the interval by bisection; the height is above 0 at `from` and not above
    /// 0 at `to`.
    HWY_INLINE V root(V from, V to, V low, V high, M lanes) const {
        V x = hn::Add(from, hn::Mul(hn::Sub(to, from), hn::Div(low, hn::Sub(low, high))));
        // Each step squares the error, which is a share of the cell: after one so short nothing is left of
        // it.
        const V last_step = hn::Mul(hn::Sub(to, from), set(0x1p-27));
        M left = lanes;
        for (int step = 0; step < 100 && !hn::AllFalse(D(), left); ++step) {
            V height, slope;
            at(x, height, slope);
            const M over = hn::Gt(height, hn::Zero(D()));
            from = hn::IfThenElse(over, x, from);
            to = hn::IfThenElse(over, to, x);
            const V newton = hn::Sub(x, hn::Div(height, slope));
            const V closeness = hn::Max(hn::Mul(set(1e-15), hn::Add(hn::Abs(x), hn::Abs(newton))), last_step);
            const M close = hn::Le(hn::Abs(hn::Sub(newton, x)), closeness);
            const M within = hn::And(hn::Gt(newton, from), hn::Lt(newton, to));
            V next = hn::IfThenElse(within, newton, hn::Mul(hn::Add(from, to), set(0.5)));
            next = hn::IfThenElse(close, hn::Min(hn::Max(newton, from), to), next);
            const M done = hn::Or(close, hn::Or(hn::Eq(next, from), hn::Eq(next, to)));
            x = hn::IfThenElse(left, next, x);
            left = hn::AndNot(done, left);
        }
        return x;
    }
};

/// Where the ray reaches the plane u = `at` (u: ua + ub x over wa + wb x) that it moves towards, at `x` or
/// later; infinite: never.
HWY_INLINE V reach(V at, V ua, V ub, V wa, V wb, V x) {
    const V a = hn::Sub(ua, hn::Mul(at, wa)), b = hn::Sub(ub, hn::Mul(at, wb));
    const V root = hn::Neg(hn::Div(a, b));
    // Roots on the other side of the centre, and no numbers.
    const M real =
        hn::And(hn::Gt(hn::Add(wa, hn::Mul(wb, root)), hn::Zero(D())), hn::Lt(hn::Abs(root), set(1e300)));
    return hn::IfThenElse(real, hn::Max(root, x), set(no_hit));
}

/// Where a ray comes below a height, at `x` or later; `x` if it climbs.
template<bool plane>
HWY_INLINE V begin_below(V miss2, V speed2, V height, V x) {
    const V zero = hn::Zero(D());
    if constexpr (plane) {
        const V at = hn::Div(hn::Sub(height, miss2), speed2);
        return hn::IfThenElse(hn::Lt(speed2, zero), hn::Max(x, at), x);
    }
    const V radius = hn::Add(set(1), height);
    const V under = hn::Div(hn::Sub(hn::Mul(radius, radius), miss2), speed2);
    return hn::Max(x, hn::Neg(hn::Sqrt(hn::Max(under, zero))));
}

/// Narrows an interval to where rays are between two heights, or come from above into what is between them.
template<bool plane>
HWY_INLINE void narrow_to_heights(V miss2, V speed2, V highest, V least, V& from, V& to) {
    const D d;
    const V zero = hn::Zero(d);
    const V top = hn::Add(highest, set(1e-12)), bottom = hn::Sub(least, set(1e-12));
    V through; // where a ray is below all
    if constexpr (plane) {
        const V x = hn::Div(hn::Sub(top, miss2), speed2);
        from = hn::IfThenElse(hn::Lt(speed2, zero), hn::Max(from, x), from);
        to = hn::IfThenElse(hn::Gt(speed2, zero), hn::Min(to, x), to);
        through = hn::IfThenElse(hn::Lt(speed2, zero), hn::Div(hn::Sub(bottom, miss2), speed2), to);
    } else {
        const auto half_chord = [&](V height) {
            const V radius = hn::Add(set(1), height);
            return hn::Sqrt(hn::Max(hn::Div(hn::Sub(hn::Mul(radius, radius), miss2), speed2), zero));
        };
        const V half = half_chord(top);
        from = hn::Max(from, hn::Neg(half));
        to = hn::Min(to, half);
        const V inner = half_chord(bottom);
        through = hn::IfThenElse(hn::Gt(inner, zero), hn::Neg(inner), to);
    }
    // A ray that comes in below all meets a wall at once.
    to = hn::IfThenElse(hn::Gt(through, from), hn::Min(to, through), to);
}

} // namespace
} // namespace obscura::renderer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
