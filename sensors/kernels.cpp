#include "sensors/kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sensors/kernels.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include "sensors/vector_math-inl.hpp"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace obscura::sensors::HWY_NAMESPACE {
namespace {

using kernels::Chain;
using kernels::Stream;

constexpr float inversion_below = 10;
constexpr float largest_mean = 4e6F;

void light_row(const float* values, const float* response, float scale, bool add, std::size_t n, float* out) {
    const F f;
    const VF factor = hn::Set(f, scale);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        VF v = hn::LoadU(f, values + i);
        v = hn::Mul(hn::IfThenElseZero(hn::Gt(v, hn::Zero(f)), v), factor);
        if (response != nullptr) v = hn::Mul(v, hn::LoadU(f, response + i));
        if (add) v = hn::Add(v, hn::LoadU(f, out + i));
        hn::StoreU(v, f, out + i);
    }
}

void crosstalk_row(const float* above, const float* here, const float* below, float edge, float corner,
                   std::size_t n, float* out) {
    const F f;
    const VF ve = hn::Set(f, edge), vc = hn::Set(f, corner), centre = hn::Set(f, 1 - 4 * edge - 4 * corner);
    const auto columns = [&](std::size_t i)
                             HWY_ATTR { return hn::Add(hn::LoadU(f, above + i), hn::LoadU(f, below + i)); };
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        const VF sides = hn::Add(hn::LoadU(f, here + i - 1), hn::LoadU(f, here + i + 1));
        const VF corners = hn::Add(columns(i - 1), columns(i + 1));
        const VF edges = hn::Add(sides, columns(i));
        hn::StoreU(hn::Add(hn::Add(hn::Mul(centre, hn::LoadU(f, here + i)), hn::Mul(ve, edges)),
                           hn::Mul(vc, corners)),
                   f, out + i);
    }
}

void mean_row(const float* light, float light_scale, const float* dark, float dark_scale, std::size_t n,
              float* out) {
    const F f;
    const VF ls = hn::Set(f, light_scale), ds = hn::Set(f, dark_scale);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        const VF charge = dark != nullptr ? hn::Mul(ds, hn::LoadU(f, dark + i)) : ds;
        const VF sum = hn::Add(hn::Mul(hn::LoadU(f, light + i), ls), charge);
        hn::StoreU(hn::IfThenElseZero(hn::Gt(sum, hn::Zero(f)), sum), f, out + i);
    }
}

/// Smallest k whose cumulated probability reaches u; mean < 10. A lane whose u lies beyond what single
/// precision can cumulate stops where the probability has become negligible.
HWY_INLINE VF invert(VF mean, VF u) {
    const F f;
    VF p = exp_of(hn::Neg(mean));
    VF cumulated = p;
    VF k = hn::Zero(f);
    const VF negligible = constant(1e-9F);
    for (int j = 1; j < 64; ++j) {
        const MF go = hn::And(hn::Gt(u, cumulated), hn::Gt(p, negligible));
        if (hn::AllFalse(f, go)) break;
        k = hn::Add(k, hn::IfThenElseZero(go, constant(1)));
        p = hn::Mul(p, hn::Mul(mean, constant(1.0F / static_cast<float>(j))));
        cumulated = hn::Add(cumulated, hn::IfThenElseZero(go, p));
    }
    return k;
}

/// The quantities of PTRS that depend on the mean alone.
struct Hat {
    VF a, b;
};
HWY_INLINE Hat hat_of(VF mean) {
    const VF b = hn::Add(constant(0.931F), hn::Mul(constant(2.53F), hn::Sqrt(mean)));
    return {hn::Add(constant(-0.059F), hn::Mul(constant(0.02483F), b)), b};
}

HWY_INLINE VF candidate(const Hat& hat, VF mean, VF half_u, VF us) {
    const VF slope = hn::Add(hn::Div(hn::Add(hat.a, hat.a), us), hat.b);
    return hn::Floor(hn::Add(hn::Add(hn::Mul(slope, half_u), mean), constant(0.43F)));
}

/// log(pmf of k): saddle-point form of C. Loader, Fast and Accurate Computation of Binomial Probabilities
/// (2000), which does not lose digits where k log(mean) and log(k!) are large.
HWY_INLINE VF log_probability(VF k, VF mean) {
    const VF k1 = hn::Max(k, constant(1));
    const VF d = hn::Sub(k1, mean);
    const VF v = hn::Div(d, hn::Add(k1, mean));
    const VF v2 = hn::Mul(v, v);
    // Deviance k log(k / mean) + mean - k: a series near the mean, the formula itself away from it.
    const VF series = hn::Add(
        hn::Mul(d, v), hn::Mul(hn::Mul(hn::Mul(hn::Add(k1, k1), v), v2),
                               polynomial(v2, 1.0F / 3, 1.0F / 5, 1.0F / 7, 1.0F / 9, 1.0F / 11, 1.0F / 13)));
    const VF direct = hn::Sub(hn::Mul(k1, log_of(hn::Div(k1, mean))), d);
    const VF deviance = hn::IfThenElse(hn::Lt(hn::Abs(v), constant(0.25F)), series, direct);
    const VF r = hn::Div(constant(1), k1);
    const VF r2 = hn::Mul(r, r);
    const VF stirling = hn::Mul(r, polynomial(r2, 1.0F / 12, -1.0F / 360, 1.0F / 1260));
    const VF half_log = hn::Mul(constant(0.5F), log_of(hn::Mul(constant(6.28318530717958648F), k1)));
    const VF value = hn::Neg(hn::Add(hn::Add(deviance, stirling), half_log));
    return hn::IfThenElse(hn::Lt(k, constant(1)), hn::Neg(mean), value);
}

/// The whole acceptance test of PTRS.
HWY_INLINE MF accept(VF mean, VF u, VF v, VF& k) {
    const Hat hat = hat_of(mean);
    const VF half_u = hn::Sub(u, constant(0.5F));
    const VF us = hn::Sub(constant(0.5F), hn::Abs(half_u));
    k = candidate(hat, mean, half_u, us);
    const VF squeeze = hn::Sub(constant(0.9277F), hn::Div(constant(3.6224F), hn::Sub(hat.b, constant(2))));
    const MF inside = hn::And(hn::Ge(us, constant(0.07F)), hn::Le(v, squeeze));
    const MF outside = hn::Or(hn::Lt(k, hn::Zero(F())), hn::And(hn::Lt(us, constant(0.013F)), hn::Gt(v, us)));
    const VF inverse_alpha =
        hn::Add(constant(1.1239F), hn::Div(constant(1.1328F), hn::Sub(hat.b, constant(3.4F))));
    const VF density = hn::Add(hn::Div(hat.a, hn::Mul(us, us)), hat.b);
    const VF left = log_of(hn::Div(hn::Mul(v, inverse_alpha), density));
    const MF below = hn::Le(left, log_probability(hn::Max(k, hn::Zero(F())), mean));
    return hn::Or(inside, hn::AndNot(outside, below));
}

void poisson_row(const float* mean, std::size_t n, const Stream& s, float* counts, float* z0, float* z1,
                 float* scratch) {
    const F f;
    const U u32;
    const std::size_t lanes = hn::Lanes(f);
    float* const wait_mean = scratch;
    float* const wait_u = wait_mean + n + kernels::padding;
    float* const wait_v = wait_u + n + kernels::padding;
    auto* const wait_index = reinterpret_cast<std::uint32_t*>(wait_v + n + kernels::padding);
    std::size_t waiting = 0;

    // First pass: whatever the inversion or the squeeze decides, which is most.
    for (std::size_t i = 0; i < n; i += lanes) {
        const VF mu = hn::Min(hn::LoadU(f, mean + i), constant(largest_mean));
        const VU index = hn::Iota(u32, static_cast<std::uint32_t>(i));
        VU w0, w1, w2, w3;
        philox(hn::Add(index, hn::Set(u32, s.first_pixel)), s.frame_low, s.effect, s.frame_high << 16,
               s.key[0], s.key[1], w0, w1, w2, w3);
        VF n0, n1;
        box_muller(w2, w3, n0, n1);
        hn::StoreU(n0, f, z0 + i);
        hn::StoreU(n1, f, z1 + i);

        const VF u = uniform(w0);
        const MF small = hn::Lt(mu, constant(inversion_below));
        VF k = hn::Zero(f);
        if (!hn::AllFalse(f, small)) k = invert(hn::IfThenElseZero(small, mu), u);
        if (!hn::AllTrue(f, small)) {
            const VF large = hn::Max(mu, constant(inversion_below));
            const VF v = uniform(w1);
            const Hat hat = hat_of(large);
            const VF half_u = hn::Sub(u, constant(0.5F));
            const VF us = hn::Sub(constant(0.5F), hn::Abs(half_u));
            const VF squeeze =
                hn::Sub(constant(0.9277F), hn::Div(constant(3.6224F), hn::Sub(hat.b, constant(2))));
            const MF inside = hn::And(hn::Ge(us, constant(0.07F)), hn::Le(v, squeeze));
            k = hn::IfThenElse(small, k, candidate(hat, large, half_u, us));
            const MF pending = hn::Not(hn::Or(small, inside));
            hn::CompressStore(large, pending, f, wait_mean + waiting);
            hn::CompressStore(u, pending, f, wait_u + waiting);
            hn::CompressStore(v, pending, f, wait_v + waiting);
            waiting += hn::CompressStore(index, hn::RebindMask(u32, pending), u32, wait_index + waiting);
        }
        hn::StoreU(k, f, counts + i);
    }
    // The last vector may have queued lanes beyond the row's end; indices rise, so they are the last ones.
    while (waiting > 0 && wait_index[waiting - 1] >= n)
        --waiting;

    // The others: full test, and new numbers for those that fail it, until none is left.
    for (std::uint32_t attempt = 1; waiting > 0; ++attempt) {
        std::size_t failed = 0;
        for (std::size_t j = 0; j < waiting; j += lanes) {
            const VF mu = hn::Max(hn::LoadU(f, wait_mean + j), constant(inversion_below));
            const VU index = hn::LoadU(u32, wait_index + j);
            VF k;
            const MF valid = hn::FirstN(f, waiting - j);
            const MF good = hn::And(valid, accept(mu, hn::LoadU(f, wait_u + j), hn::LoadU(f, wait_v + j), k));
            const MF bad = hn::AndNot(good, valid);
            alignas(128) float accepted[hn::MaxLanes(f)];
            alignas(128) std::uint32_t where[hn::MaxLanes(f)];
            const std::size_t count = hn::CompressStore(k, good, f, accepted);
            hn::CompressStore(index, hn::RebindMask(u32, good), u32, where);
            for (std::size_t c = 0; c < count; ++c)
                counts[where[c]] = accepted[c];
            hn::CompressStore(mu, bad, f, wait_mean + failed);
            failed += hn::CompressStore(index, hn::RebindMask(u32, bad), u32, wait_index + failed);
        }
        waiting = failed;
        for (std::size_t j = 0; j < waiting; j += lanes) {
            VU w0, w1, w2, w3;
            philox(hn::Add(hn::LoadU(u32, wait_index + j), hn::Set(u32, s.first_pixel)), s.frame_low,
                   s.effect, s.frame_high << 16 | attempt, s.key[0], s.key[1], w0, w1, w2, w3);
            hn::StoreU(uniform(w0), f, wait_u + j);
            hn::StoreU(uniform(w1), f, wait_v + j);
        }
    }
}

void normal_row(std::size_t n, const Stream& s, float* z0, float* z1) {
    const F f;
    const U u32;
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        VU w0, w1, w2, w3;
        philox(hn::Iota(u32, static_cast<std::uint32_t>(s.first_pixel + i)), s.frame_low, s.effect,
               s.frame_high << 16, s.key[0], s.key[1], w0, w1, w2, w3);
        VF n0, n1;
        box_muller(w2, w3, n0, n1);
        hn::StoreU(n0, f, z0 + i);
        hn::StoreU(n1, f, z1 + i);
    }
}

void exp_row(const float* x, std::size_t n, float* out) {
    const F f;
    for (std::size_t i = 0; i < n; i += hn::Lanes(f))
        hn::StoreU(exp_of(hn::LoadU(f, x + i)), f, out + i);
}

void collect_row(const Chain& chain, std::size_t n, float* charge) {
    const F f;
    const VF full = hn::Set(f, chain.full_well_e), inverse = hn::Set(f, chain.inverse_full_well);
    const bool bent = chain.nonlinearity != std::array<float, 4>{};
    const auto& c = chain.nonlinearity;
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        VF q = hn::Min(hn::LoadU(f, charge + i), full);
        if (bent) {
            const VF x = hn::Mul(q, inverse);
            q = hn::Sub(q, hn::Mul(hn::Mul(q, x), polynomial(x, c[0], c[1], c[2], c[3])));
        }
        hn::StoreU(q, f, charge + i);
    }
}

void accumulate_row(const float* signal, float weight, std::size_t n, float* sum) {
    const F f;
    const VF w = hn::Set(f, weight);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f))
        hn::StoreU(hn::Add(hn::LoadU(f, sum + i), hn::Mul(w, hn::LoadU(f, signal + i))), f, sum + i);
}

void convert_row(const Chain& chain, const float* signal, const float* offset, const float* z0,
                 const float* z1, std::size_t n, std::uint16_t* dn) {
    const F f;
    const I i32;
    const hn::Rebind<std::uint16_t, I> u16;
    const VF row = hn::Set(f, chain.row_e), gain = hn::Set(f, chain.gain_dn_per_e);
    const VF black = hn::Set(f, chain.black_dn), top = hn::Set(f, chain.top_dn);
    const VF steps = hn::Set(f, chain.adc_steps), scale = hn::Set(f, chain.offset_scale);
    const VF s0 = hn::Set(f, chain.sigma0_e), s1 = hn::Set(f, chain.sigma1_e);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        VF v = hn::Add(hn::LoadU(f, signal + i), row);
        if (offset != nullptr) v = hn::Add(v, hn::Mul(scale, hn::LoadU(f, offset + i)));
        if (z0 != nullptr) v = hn::Add(v, hn::Mul(s0, hn::LoadU(f, z0 + i)));
        if (z1 != nullptr) v = hn::Add(v, hn::Mul(s1, hn::LoadU(f, z1 + i)));
        v = hn::Add(hn::Mul(v, gain), black);
        v = hn::Min(hn::Max(v, hn::Zero(f)), top);
        VI code;
        if (chain.adc != nullptr) {
            // Byte offsets into 16-bit entries; the upper half of what is gathered belongs to the next entry.
            const VI entry = hn::ConvertTo(i32, hn::Mul(v, steps));
            const VI gathered = hn::GatherOffset(i32, reinterpret_cast<const std::int32_t*>(chain.adc),
                                                 hn::ShiftLeft<1>(entry));
            code = hn::And(gathered, hn::Set(i32, 0xFFFF));
        } else {
            code = hn::NearestInt(v);
        }
        hn::StoreU(hn::DemoteTo(u16, code), u16, dn + i);
    }
}

} // namespace
} // namespace obscura::sensors::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::sensors {

HWY_EXPORT(light_row);
HWY_EXPORT(crosstalk_row);
HWY_EXPORT(mean_row);
HWY_EXPORT(poisson_row);
HWY_EXPORT(normal_row);
HWY_EXPORT(exp_row);
HWY_EXPORT(collect_row);
HWY_EXPORT(accumulate_row);
HWY_EXPORT(convert_row);

namespace kernels {

void light_row(const float* values, const float* response, float scale, bool add, std::size_t n, float* out) {
    HWY_DYNAMIC_DISPATCH(light_row)(values, response, scale, add, n, out);
}
void crosstalk_row(const float* above, const float* here, const float* below, float edge, float corner,
                   std::size_t n, float* out) {
    HWY_DYNAMIC_DISPATCH(crosstalk_row)(above, here, below, edge, corner, n, out);
}
void mean_row(const float* light, float light_scale, const float* dark, float dark_scale, std::size_t n,
              float* out) {
    HWY_DYNAMIC_DISPATCH(mean_row)(light, light_scale, dark, dark_scale, n, out);
}
void poisson_row(const float* mean, std::size_t n, const Stream& stream, float* counts, float* z0, float* z1,
                 float* scratch) {
    HWY_DYNAMIC_DISPATCH(poisson_row)(mean, n, stream, counts, z0, z1, scratch);
}
void normal_row(std::size_t n, const Stream& stream, float* z0, float* z1) {
    HWY_DYNAMIC_DISPATCH(normal_row)(n, stream, z0, z1);
}
void exp_row(const float* x, std::size_t n, float* out) {
    HWY_DYNAMIC_DISPATCH(exp_row)(x, n, out);
}
void collect_row(const Chain& chain, std::size_t n, float* charge) {
    HWY_DYNAMIC_DISPATCH(collect_row)(chain, n, charge);
}
void accumulate_row(const float* signal, float weight, std::size_t n, float* sum) {
    HWY_DYNAMIC_DISPATCH(accumulate_row)(signal, weight, n, sum);
}
void convert_row(const Chain& chain, const float* signal, const float* offset, const float* z0,
                 const float* z1, std::size_t n, std::uint16_t* dn) {
    HWY_DYNAMIC_DISPATCH(convert_row)(chain, signal, offset, z0, z1, n, dn);
}

} // namespace kernels
} // namespace obscura::sensors
#endif
