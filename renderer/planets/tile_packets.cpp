// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_packets.hpp"

#include "terrain/surface_domain.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "renderer/planets/tile_packets.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

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

/// Bilinear patches under rays: height above the patch and its derivative along the ray.
template<bool plane>
struct Patches {
    V ua, ub, va, vb, wa, wb, miss2, speed2;
    V h, hs, hr, hsr, half, first_i, first_j; ///< first: half_cells less the cell's number on the face

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
        M left = lanes;
        for (int step = 0; step < 100 && !hn::AllFalse(D(), left); ++step) {
            V height, slope;
            at(x, height, slope);
            const M over = hn::Gt(height, hn::Zero(D()));
            from = hn::IfThenElse(over, x, from);
            to = hn::IfThenElse(over, to, x);
            V next = hn::Sub(x, hn::Div(height, slope));
            const M within = hn::And(hn::Gt(next, from), hn::Lt(next, to));
            next = hn::IfThenElse(within, next, hn::Mul(hn::Add(from, to), set(0.5)));
            const V closeness = hn::Mul(set(1e-15), hn::Add(hn::Abs(x), hn::Abs(next)));
            const M done = hn::Or(hn::Le(hn::Abs(hn::Sub(next, x)), closeness),
                                  hn::Or(hn::Eq(next, from), hn::Eq(next, to)));
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

template<bool plane>
void trace_lanes(TileLanes& lanes, int first, double per_m_value) {
    const D d;
    const I i64;
    const auto load = [&](const Doubles& from) { return hn::Load(d, from.v + first); };
    const VI state = hn::Load(i64, lanes.state + first);
    M passed =
        hn::MaskFromVec(hn::BitCast(d, hn::VecFromMask(i64, hn::Eq(state, hn::Set(i64, TileLanes::passed)))));
    M active = hn::Or(passed, hn::MaskFromVec(hn::BitCast(
                                  d, hn::VecFromMask(i64, hn::Eq(state, hn::Set(i64, TileLanes::running))))));
    if (hn::AllFalse(d, active)) return;

    const V zero = hn::Zero(d), one = set(1), half = set(0.5), per_m = set(per_m_value);
    const V ua = load(lanes.ua), ub = load(lanes.ub), va = load(lanes.va), vb = load(lanes.vb),
            wa = load(lanes.wa), wb = load(lanes.wb), miss2 = load(lanes.miss2), speed2 = load(lanes.speed2),
            to = load(lanes.to), offset = load(lanes.offset_m), half_cells = load(lanes.half_cells),
            first_i = load(lanes.first_i), first_j = load(lanes.first_j), most_width = load(lanes.most_width);
    const V per_half = hn::Div(one, half_cells); // exact: a power of two
    const VI vertices = hn::Load(i64, lanes.vertices + first), maxima = hn::Load(i64, lanes.maxima + first);
    V x = load(lanes.x), exit = load(lanes.exit), i = load(lanes.i), j = load(lanes.j),
      width = load(lanes.width);
    // u grows along the whole ray, or falls, or does not change but for rounding: as seen from a point of an
    // axis of the body.
    const V u_up = hn::Mul(ub, wa), u_down = hn::Mul(ua, wb), v_up = hn::Mul(vb, wa),
            v_down = hn::Mul(va, wb);
    const V steps_u = hn::IfThenElseZero(hn::Ge(hn::Sub(u_up, u_down), zero), one);
    const V steps_v = hn::IfThenElseZero(hn::Ge(hn::Sub(v_up, v_down), zero), one);
    const auto changes = [](V up, V down) {
        return hn::Gt(hn::Abs(hn::Sub(up, down)), hn::Mul(set(1e-14), hn::Add(hn::Abs(up), hn::Abs(down))));
    };
    const M u_changes = changes(u_up, u_down), v_changes = changes(v_up, v_down);
    const V side_u = hn::Sub(hn::Add(steps_u, steps_u), one),
            side_v = hn::Sub(hn::Add(steps_v, steps_v), one);
    VI result = state;
    const auto finish = [&](M which, std::int64_t with) {
        result = hn::IfThenElse(hn::MaskFromVec(hn::BitCast(i64, hn::VecFromMask(d, which))),
                                hn::Set(i64, with), result);
        active = hn::AndNot(which, active);
    };

    while (!hn::AllFalse(d, active)) {
        const V plane_u =
            hn::Sub(hn::Mul(hn::Add(first_i, hn::Mul(hn::Add(i, steps_u), width)), per_half), one);
        const V plane_v =
            hn::Sub(hn::Mul(hn::Add(first_j, hn::Mul(hn::Add(j, steps_v), width)), per_half), one);
        const V x_u = hn::IfThenElse(u_changes, reach(plane_u, ua, ub, wa, wb, x), set(no_hit));
        const V x_v = hn::IfThenElse(v_changes, reach(plane_v, va, vb, wa, wb, x), set(no_hit));
        exit = hn::Max(x, hn::Min(hn::Min(x_u, x_v), to));

        // The highest vertex of the node.
        const M leaf = hn::And(hn::Eq(width, one), active);
        const M inner = hn::AndNot(leaf, active);
        V highest = zero, h00 = zero, h10 = zero, h01 = zero, h11 = zero;
        if (!hn::AllFalse(d, inner)) {
            const V edge = hn::Div(set(terrain::tile_cells), width);
            const V before = hn::Round(hn::Mul(hn::Sub(hn::Mul(edge, edge), one), set(1.0 / 3)));
            const V number = hn::IfThenElseZero(inner, hn::Add(hn::Add(before, hn::Mul(j, edge)), i));
            const VI at = hn::Add(maxima, hn::ShiftLeft<2>(to_integers(number)));
            highest = hn::Mul(hn::Add(offset, first_floats(load_pairs(at))), per_m);
        }
        if (!hn::AllFalse(d, leaf)) {
            const V number = hn::IfThenElseZero(leaf, hn::Add(hn::Mul(j, set(terrain::tile_edge)), i));
            const VI at = hn::Add(vertices, hn::ShiftLeft<2>(to_integers(number)));
            const VI low = load_pairs(at),
                     high = load_pairs(
                         hn::Add(at, hn::Set(i64, terrain::tile_edge * std::int64_t{sizeof(float)})));
            const auto height = [&](V value) { return hn::Mul(hn::Add(offset, value), per_m); };
            h00 = height(first_floats(low));
            h10 = height(second_floats(low));
            h01 = height(first_floats(high));
            h11 = height(second_floats(high));
            highest = hn::IfThenElse(leaf, hn::Max(hn::Max(h00, h10), hn::Max(h01, h11)), highest);
        }

        // Rays that are above it all the way.
        M over;
        const V limit = hn::Add(highest, set(1e-12));
        if constexpr (plane) {
            const V at_x = hn::Add(miss2, hn::Mul(speed2, x)),
                    at_exit = hn::Add(miss2, hn::Mul(speed2, exit));
            over = hn::Gt(hn::Min(at_x, at_exit), limit);
        } else {
            const V lowest = hn::Max(x, hn::Min(exit, zero));
            const V radius2 = hn::Add(miss2, hn::Mul(hn::Mul(speed2, lowest), lowest));
            const V above = hn::Add(one, limit);
            over = hn::Gt(radius2, hn::Mul(above, above));
        }
        over = hn::And(active, hn::Or(over, passed));
        passed = hn::MaskFromVec(zero);

        // Patches that may be met.
        M through = over;
        const M tested = hn::AndNot(over, leaf);
        if (!hn::AllFalse(d, tested)) {
            const V hs = hn::Sub(h10, h00), hr = hn::Sub(h01, h00);
            const Patches<plane> patches{ua,
                                         ub,
                                         va,
                                         vb,
                                         wa,
                                         wb,
                                         miss2,
                                         speed2,
                                         h00,
                                         hs,
                                         hr,
                                         hn::Sub(hn::Sub(h11, h01), hs),
                                         half_cells,
                                         hn::Sub(half_cells, hn::Add(first_i, i)),
                                         hn::Sub(half_cells, hn::Add(first_j, j))};
            V low, low_slope, high, high_slope;
            patches.at(x, low, low_slope);
            patches.at(exit, high, high_slope);
            const M at_once = hn::And(tested, hn::Le(low, zero));
            const M crossed = hn::AndNot(at_once, hn::And(tested, hn::Le(high, zero)));
            const M dips =
                hn::AndNot(hn::Or(at_once, crossed),
                           hn::And(tested, hn::And(hn::Lt(low_slope, zero), hn::Gt(high_slope, zero))));
            if (!hn::AllFalse(d, crossed))
                x = hn::IfThenElse(crossed, patches.root(x, exit, low, high, crossed), x);
            finish(hn::Or(at_once, crossed), TileLanes::met);
            finish(dips, TileLanes::grazing);
            through = hn::Or(through, hn::AndNot(hn::Or(hn::Or(at_once, crossed), dips), tested));
        }

        // Down into the quarter that the ray is in.
        const M down = hn::AndNot(hn::Or(through, leaf), active);
        if (!hn::AllFalse(d, down)) {
            const V finer = hn::Mul(width, half);
            const V i2 = hn::Add(i, i), j2 = hn::Add(j, j);
            const V u = hn::Sub(hn::Mul(hn::Add(first_i, hn::Mul(hn::Add(i2, one), finer)), per_half), one);
            const V v = hn::Sub(hn::Mul(hn::Add(first_j, hn::Mul(hn::Add(j2, one), finer)), per_half), one);
            const V in_u = hn::Add(hn::Sub(ua, hn::Mul(u, wa)), hn::Mul(hn::Sub(ub, hn::Mul(u, wb)), x));
            const V in_v = hn::Add(hn::Sub(va, hn::Mul(v, wa)), hn::Mul(hn::Sub(vb, hn::Mul(v, wb)), x));
            width = hn::IfThenElse(down, finer, width);
            i = hn::IfThenElse(down, hn::Add(i2, hn::IfThenElseZero(hn::Ge(in_u, zero), one)), i);
            j = hn::IfThenElse(down, hn::Add(j2, hn::IfThenElseZero(hn::Ge(in_v, zero), one)), j);
        }

        // On to the next node, and up if that is in another quarter.
        through = hn::And(through, active);
        if (!hn::AllFalse(d, through)) {
            const M ends = hn::And(through, hn::Ge(exit, to));
            const M in_u = hn::And(through, hn::Le(x_u, x_v)), in_v = hn::AndNot(in_u, through);
            const V next_i = hn::IfThenElse(in_u, hn::Add(i, side_u), i);
            const V next_j = hn::IfThenElse(in_v, hn::Add(j, side_v), j);
            const V up_i = hn::Floor(hn::Mul(next_i, half)), up_j = hn::Floor(hn::Mul(next_j, half));
            const M leaves =
                hn::Or(hn::Ne(up_i, hn::Floor(hn::Mul(i, half))), hn::Ne(up_j, hn::Floor(hn::Mul(j, half))));
            const M up = hn::And(hn::And(through, leaves), hn::Lt(width, most_width));
            x = hn::IfThenElse(through, exit, x);
            i = hn::IfThenElse(up, up_i, next_i);
            j = hn::IfThenElse(up, up_j, next_j);
            width = hn::IfThenElse(up, hn::Add(width, width), width);
            const V last = hn::Sub(hn::Div(set(terrain::tile_cells), width), one);
            const M outside =
                hn::Or(hn::Or(hn::Lt(i, zero), hn::Gt(i, last)), hn::Or(hn::Lt(j, zero), hn::Gt(j, last)));
            finish(hn::Or(ends, hn::And(through, outside)), TileLanes::off);
        }
    }
    hn::Store(x, d, lanes.x.v + first);
    hn::Store(exit, d, lanes.exit.v + first);
    hn::Store(i, d, lanes.i.v + first);
    hn::Store(j, d, lanes.j.v + first);
    hn::Store(width, d, lanes.width.v + first);
    hn::Store(result, i64, lanes.state + first);
}

void trace_all(TileLanes& lanes, double per_m, bool plane) {
    const D d;
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(d)))
        if (plane)
            trace_lanes<true>(lanes, first, per_m);
        else
            trace_lanes<false>(lanes, first, per_m);
}

} // namespace
} // namespace obscura::renderer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::renderer {

HWY_EXPORT(trace_all);

void trace_tile_lanes(TileLanes& lanes, double per_m, bool plane) {
    HWY_DYNAMIC_DISPATCH(trace_all)(lanes, per_m, plane);
}

} // namespace obscura::renderer
#endif
