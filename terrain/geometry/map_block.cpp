// SPDX-License-Identifier: Apache-2.0
#include "terrain/geometry/map_block.hpp"

#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "terrain/geometry/map_block.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace obscura::terrain::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 8>;
using I = hn::RebindToSigned<D>;
using V = hn::Vec<D>;

HWY_INLINE V set(double value) {
    return hn::Set(D(), value);
}
HWY_INLINE V add(V a, V b) {
    return hn::Add(a, b);
}
HWY_INLINE V sub(V a, V b) {
    return hn::Sub(a, b);
}
HWY_INLINE V mul(V a, V b) {
    return hn::Mul(a, b);
}

/// Polynomial by Horner's rule, the highest power first.
template<std::size_t n>
HWY_INLINE V polynomial(V x, const double (&coefficients)[n]) {
    V sum = set(coefficients[0]);
    for (std::size_t k = 1; k < n; ++k)
        sum = add(mul(sum, x), set(coefficients[k]));
    return sum;
}

/// Angle of (x, y), -pi to pi, good to 3e-16; 0 at the origin. After the atan of Moshier's Cephes library
/// (Methods and Programs for Mathematical Functions, 1989).
HWY_INLINE V angle(V y, V x) {
    const D d;
    const V ax = hn::Abs(x), ay = hn::Abs(y);
    const V longer = hn::Max(ax, ay), shorter = hn::Min(ax, ay);
    // Angles above pi / 8 by their difference from pi / 4.
    const auto large = hn::Gt(shorter, mul(longer, set(std::numbers::sqrt2 - 1)));
    const V above = hn::IfThenElse(large, sub(shorter, longer), shorter);
    const V below = hn::IfThenElse(large, add(shorter, longer), longer);
    const V q = hn::IfThenElseZero(hn::Gt(below, hn::Zero(d)), hn::Div(above, below));
    const V z = mul(q, q);
    constexpr double p[] = {-8.750608600031904122785e-1, -1.615753718733365076637e1,
                            -7.500855792314704667340e1, -1.228866684490136173410e2,
                            -6.485021904942025371773e1};
    constexpr double r[] = {1,
                            2.485846490142306297962e1,
                            1.650270098316988542046e2,
                            4.328810604912902668951e2,
                            4.853903996359136964868e2,
                            1.945506571482613964425e2};
    V a = add(q, mul(q, mul(z, hn::Div(polynomial(z, p), polynomial(z, r)))));
    a = hn::IfThenElse(large, add(a, set(std::numbers::pi / 4)), a);
    a = hn::IfThenElse(hn::Gt(ay, ax), sub(set(std::numbers::pi / 2), a), a);
    a = hn::IfThenElse(hn::Lt(x, hn::Zero(d)), sub(set(std::numbers::pi), a), a);
    return hn::CopySign(a, y);
}

void locate_block(const MapFormula& f, MapBlock& block) {
    const D d;
    for (std::size_t n = 0; n < block.count; n += hn::Lanes(d)) {
        const V x = hn::Load(d, block.x.data() + n), y = hn::Load(d, block.y.data() + n),
                z = hn::Load(d, block.z.data() + n);
        const V across2 = add(mul(x, x), mul(y, y));
        const V distance = hn::Sqrt(add(across2, mul(z, z)));
        hn::Store(distance, d, block.distance.data() + n);
        V x_m = x, y_m = y;
        V density_x = set(f.density_x), density_y = set(f.density_y);
        switch (f.kind) {
        case MapFormula::Kind::none:
            continue;
        case MapFormula::Kind::planar:
            break;
        case MapFormula::Kind::cylindrical: {
            const V across = hn::Sqrt(across2);
            const V from_middle =
                sub(sub(mul(angle(y, x), set(f.scale_x)), set(f.centre_x)), set(f.middle_x));
            const V turns = hn::Round(mul(from_middle, set(1 / f.turn)));
            x_m = add(sub(from_middle, mul(turns, set(f.turn))), set(f.middle_x));
            y_m = mul(angle(mul(z, set(f.latitude_z)), across), set(f.scale_y));
            // Infinite at the poles.
            density_x = mul(density_x, hn::Div(mul(distance, set(f.scale_x)), across));
            density_y = mul(density_y, set(f.scale_y));
            break;
        }
        case MapFormula::Kind::polar: {
            // tan(colatitude / 2) = across / (distance + z).
            const V scale = hn::Div(set(f.scale_x), add(distance, mul(z, set(f.sine_sign))));
            x_m = mul(sub(mul(y, set(f.cosine)), mul(x, set(f.sine))), scale);
            y_m = mul(add(mul(x, set(f.cosine)), mul(y, set(f.sine))), mul(scale, set(-f.sine_sign)));
            const V per_radian = mul(scale, distance);
            density_x = mul(density_x, per_radian);
            density_y = mul(density_y, per_radian);
            break;
        }
        }
        const V place_x = add(add(mul(x_m, set(f.xx)), mul(y_m, set(f.xy))), set(f.x0));
        const V place_y = add(add(mul(x_m, set(f.yx)), mul(y_m, set(f.yy))), set(f.y0));
        hn::Store(place_x, d, block.place_x.data() + n);
        hn::Store(place_y, d, block.place_y.data() + n);
        hn::Store(density_x, d, block.density_x.data() + n);
        hn::Store(density_y, d, block.density_y.data() + n);
    }
}

/// Weights of four samples at -1, 0, 1, 2 for the place t, 0 to 1.
struct Weights {
    V w[4];

    HWY_INLINE explicit Weights(V t) {
        const V t2 = mul(t, t), t3 = mul(t2, t);
        w[0] = sub(add(mul(set(-0.5), t3), t2), mul(set(0.5), t));
        w[1] = add(sub(mul(set(1.5), t3), mul(set(2.5), t2)), set(1));
        w[2] = add(add(mul(set(-1.5), t3), mul(set(2), t2)), mul(set(0.5), t));
        w[3] = sub(mul(set(0.5), t3), mul(set(0.5), t2));
    }
};

/// Two neighbouring floats at addresses.
struct Pair {
    V first, second;
};
HWY_INLINE Pair load_pair(hn::Vec<I> addresses) {
    const hn::Rebind<std::uint32_t, D> narrow;
    const hn::Rebind<float, D> floats;
    const hn::RebindToUnsigned<D> wide;
    // Offsets from a null base are addresses.
    const auto pairs =
        hn::BitCast(wide, hn::GatherOffset(I(), static_cast<const std::int64_t*>(nullptr), addresses));
    const auto promoted = [&](auto bits) {
        return hn::PromoteTo(D(), hn::BitCast(floats, hn::TruncateTo(narrow, bits)));
    };
    return {promoted(pairs), promoted(hn::ShiftRight<32>(pairs))};
}

void sample_block(const StencilBlock& stencils, std::size_t count, std::size_t row, double* values) {
    const D d;
    const I i64;
    const auto pair_step = hn::Set(i64, 2 * std::int64_t{sizeof(float)});
    const auto row_step = hn::Set(i64, static_cast<std::int64_t>(row * sizeof(float)));
    for (std::size_t n = 0; n < count; n += hn::Lanes(d)) {
        const Weights across(hn::Load(d, stencils.t.data() + n)), down(hn::Load(d, stencils.u.data() + n));
        auto at = hn::Load(i64, stencils.first.data() + n);
        V sum = hn::Zero(d);
        for (const V weight : down.w) {
            const Pair left = load_pair(at), right = load_pair(hn::Add(at, pair_step));
            const V line = add(add(add(mul(across.w[0], left.first), mul(across.w[1], left.second)),
                                   mul(across.w[2], right.first)),
                               mul(across.w[3], right.second));
            sum = add(sum, mul(weight, line));
            at = hn::Add(at, row_step);
        }
        hn::Store(sum, d, values + n);
    }
}

} // namespace
} // namespace obscura::terrain::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::terrain {

HWY_EXPORT(locate_block);
HWY_EXPORT(sample_block);

void MapBlock::load(std::span<const Vec3> positions) {
    count = positions.size();
    for (std::size_t n = 0; n < map_block_size; ++n) {
        const Vec3 p = positions[n < count ? n : count - 1];
        x[n] = p.x;
        y[n] = p.y;
        z[n] = p.z;
    }
}

void locate(const MapFormula& formula, MapBlock& block) {
    HWY_DYNAMIC_DISPATCH(locate_block)(formula, block);
}

void sample_stencils(const StencilBlock& stencils, std::size_t count, std::size_t row,
                     std::span<double, map_block_size> values) {
    HWY_DYNAMIC_DISPATCH(sample_block)(stencils, count, row, values.data());
}

} // namespace obscura::terrain
#endif
