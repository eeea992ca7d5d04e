// SPDX-License-Identifier: Apache-2.0
#include "sensors/kernels.hpp"

#include "sensors/poisson_table.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sensors/kernels.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include "sensors/vector_math-inl.hpp"

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace obscura::sensors::HWY_NAMESPACE {
namespace {

using kernels::Chain;
using kernels::Stream;

constexpr float table_below = PoissonTable::means;
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

void mean_row(const float* light, const float* response, float light_scale, const float* dark,
              float dark_scale, std::size_t n, float* out) {
    const F f;
    const VF ls = hn::Set(f, light_scale), ds = hn::Set(f, dark_scale);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        const VF charge = dark != nullptr ? hn::Mul(ds, hn::LoadU(f, dark + i)) : ds;
        VF lit = hn::LoadU(f, light + i);
        if (response != nullptr) lit = hn::Mul(lit, hn::LoadU(f, response + i));
        const VF sum = hn::Add(hn::Mul(lit, ls), charge);
        hn::StoreU(hn::IfThenElseZero(hn::Gt(sum, hn::Zero(f)), sum), f, out + i);
    }
}

/// Inversion: smallest k whose cumulative probability reaches u; mean < 1. A lane whose u exceeds the largest
/// sum that single precision reaches stops when the probability is negligible.
HWY_INLINE VF invert(VF mean, VF u) {
    const F f;
    VF p = exp_of(hn::Neg(mean));
    VF cumulated = p;
    VF k = hn::Zero(f);
    const VF negligible = constant(1e-9F);
    for (int j = 1; j < 16; ++j) {
        const MF go = hn::And(hn::Gt(u, cumulated), hn::Gt(p, negligible));
        if (hn::AllFalse(f, go)) break;
        k = hn::Add(k, hn::IfThenElseZero(go, constant(1)));
        p = hn::Mul(p, hn::Mul(mean, constant(1.0F / static_cast<float>(j))));
        cumulated = hn::Add(cumulated, p);
    }
    return k;
}

/// Poisson draw for means below table_below: the integer part of the mean by table, the fractional part by
/// inversion. The sum of two Poisson variates is a Poisson variate.
HWY_INLINE VF tabled(const PoissonTable& table, VF mean, VU word0, VU word1) {
    const I i32;
    const VF whole = hn::Floor(mean);
    const VF rest = invert(hn::Sub(mean, whole), uniform(word1));
    const VI q = hn::ConvertTo(i32, whole);
    if (hn::AllTrue(i32, hn::Eq(q, hn::Zero(i32)))) return rest;
    const VI cell = hn::BitCast(i32, hn::ShiftRight<24>(word0));
    const VI word = hn::Xor(hn::BitCast(i32, word0), hn::Set(i32, static_cast<std::int32_t>(0x80000000U)));
    VI k = hn::And(hn::GatherOffset(i32, reinterpret_cast<const std::int32_t*>(table.guide.data()),
                                    hn::Add(hn::ShiftLeft<8>(q), cell)),
                   hn::Set(i32, 0xFF));
    const VI row = hn::ShiftLeft<7>(q);
    for (;;) {
        // The last threshold of a row is the largest value; for a word equal to it the bound on k keeps the
        // index inside the row.
        const VI threshold = hn::GatherIndex(i32, table.threshold.data(), hn::Add(row, k));
        const auto go =
            hn::AndNot(hn::Gt(threshold, word), hn::Lt(k, hn::Set(i32, PoissonTable::counts - 1)));
        if (hn::AllFalse(i32, go)) break;
        k = hn::Sub(k, hn::VecFromMask(i32, go));
    }
    return hn::Add(rest, hn::ConvertTo(F(), k));
}

/// Parameters of the PTRS hat function, which depend on the mean alone.
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
    const MF close = hn::Lt(hn::Abs(v), constant(0.25F));
    VF deviance = series;
    if (!hn::AllTrue(F(), close)) {
        const VF direct = hn::Sub(hn::Mul(k1, log_of(hn::Div(k1, mean))), d);
        deviance = hn::IfThenElse(close, series, direct);
    }
    const VF r = hn::Div(constant(1), k1);
    const VF r2 = hn::Mul(r, r);
    const VF stirling = hn::Mul(r, polynomial(r2, 1.0F / 12, -1.0F / 360, 1.0F / 1260));
    const VF half_log = hn::Mul(constant(0.5F), log_of(hn::Mul(constant(6.28318530717958648F), k1)));
    const VF value = hn::Neg(hn::Add(hn::Add(deviance, stirling), half_log));
    return hn::IfThenElse(hn::Lt(k, constant(1)), hn::Neg(mean), value);
}

/// Full acceptance test of PTRS.
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

/// Calls `visit(lane)` for every lane that is set.
template<class Visit>
HWY_INLINE void each_lane(MF mask, Visit visit) {
    const F f;
    // Not by Compress: GCC 12 copies its table of permutations to the stack at each use.
    alignas(8) std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(f, mask, bytes);
    std::uint64_t bits = 0;
    std::memcpy(&bits, bytes, 8);
    for (; bits != 0; bits &= bits - 1)
        visit(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

constexpr std::size_t block = 256;

void draw_words(const Philox& philox, std::uint32_t first_pixel, std::size_t n,
                std::uint32_t (&words)[4][block]) {
    const U u32;
    for (std::size_t i = 0; i < n; i += hn::Lanes(u32)) {
        VU w0, w1, w2, w3;
        philox(hn::Iota(u32, first_pixel + static_cast<std::uint32_t>(i)), w0, w1, w2, w3);
        hn::Store(w0, u32, words[0] + i);
        hn::Store(w1, u32, words[1] + i);
        hn::Store(w2, u32, words[2] + i);
        hn::Store(w3, u32, words[3] + i);
    }
}

void normals_of(const std::uint32_t (&words)[4][block], std::size_t n, float* z0, float* z1) {
    const F f;
    const U u32;
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        VF n0, n1;
        box_muller(hn::Load(u32, words[2] + i), hn::Load(u32, words[3] + i), n0, n1);
        hn::StoreU(n0, f, z0 + i);
        hn::StoreU(n1, f, z1 + i);
    }
}

void poisson_row(const float* mean, std::size_t n, const Stream& s, float* counts, float* z0, float* z1,
                 float* scratch) {
    const F f;
    const U u32;
    const I i32;
    const std::size_t lanes = hn::Lanes(f);
    float* const row_u = scratch;
    float* const row_v = row_u + n + kernels::padding;
    auto* const waiting_for = reinterpret_cast<std::uint32_t*>(row_v + n + kernels::padding);
    std::size_t waiting = 0;
    const Philox philox(s.frame_low, s.effect, s.frame_high << 16, s.key[0], s.key[1]);
    const PoissonTable& table = PoissonTable::get();

    // First pass: decide most lanes by table or squeeze. Work in blocks and short loops, so that the CPU
    // overlaps several vectors: the body of each loop is one long chain of dependent operations.
    alignas(128) std::uint32_t words[4][block];
    for (std::size_t start = 0; start < n; start += block) {
        const std::size_t end = std::min(n, start + block);
        draw_words(philox, s.first_pixel + static_cast<std::uint32_t>(start), end - start, words);
        normals_of(words, end - start, z0 + start, z1 + start);
        for (std::size_t i = start; i < end; i += lanes) {
            const VF mu = hn::Min(hn::LoadU(f, mean + i), constant(largest_mean));
            const VU w0 = hn::Load(u32, words[0] + (i - start));
            const VU w1 = hn::Load(u32, words[1] + (i - start));
            const MF small = hn::Lt(mu, constant(table_below));
            VF k = hn::Zero(f);
            if (!hn::AllFalse(f, small)) k = tabled(table, hn::IfThenElseZero(small, mu), w0, w1);
            if (!hn::AllTrue(f, small)) {
                const VF large = hn::Max(mu, constant(table_below));
                const VF u = uniform(w0), v = uniform(w1);
                const Hat hat = hat_of(large);
                const VF half_u = hn::Sub(u, constant(0.5F));
                const VF us = hn::Sub(constant(0.5F), hn::Abs(half_u));
                const VF squeeze =
                    hn::Sub(constant(0.9277F), hn::Div(constant(3.6224F), hn::Sub(hat.b, constant(2))));
                const MF inside = hn::And(hn::Ge(us, constant(0.07F)), hn::Le(v, squeeze));
                k = hn::IfThenElse(small, k, candidate(hat, large, half_u, us));
                hn::StoreU(u, f, row_u + i);
                hn::StoreU(v, f, row_v + i);
                each_lane(hn::Not(hn::Or(small, inside)), [&](std::uint32_t lane) {
                    waiting_for[waiting++] = static_cast<std::uint32_t>(i) + lane;
                });
            }
            hn::StoreU(k, f, counts + i);
        }
    }
    // Drop lanes beyond the row's end, which the last vector may have queued; indices rise, so they are last.
    while (waiting > 0 && waiting_for[waiting - 1] >= n)
        --waiting;

    // Second pass: apply the full test to the remaining lanes and redraw those that fail, until none is left.
    alignas(128) float first[hn::MaxLanes(f)], second[hn::MaxLanes(f)];
    for (std::uint32_t attempt = 1; waiting > 0; ++attempt) {
        // Lanes beyond the end of the list must point into the row.
        std::fill_n(waiting_for + waiting, lanes, 0U);
        std::size_t failed = 0;
        for (std::size_t j = 0; j < waiting; j += lanes) {
            const VU index = hn::LoadU(u32, waiting_for + j);
            const VI signed_index = hn::BitCast(i32, index);
            const VF mu = hn::Min(hn::Max(hn::GatherIndex(f, mean, signed_index), constant(table_below)),
                                  constant(largest_mean));
            VF k;
            const MF good = accept(mu, hn::GatherIndex(f, row_u, signed_index),
                                   hn::GatherIndex(f, row_v, signed_index), k);
            hn::Store(k, f, first);
            const std::uint32_t* const queued = waiting_for + j;
            const MF valid = hn::FirstN(f, waiting - j);
            each_lane(hn::And(valid, good), [&](std::uint32_t lane) { counts[queued[lane]] = first[lane]; });
            // Compact in place: `failed` <= j, so no unread lane is overwritten.
            each_lane(hn::AndNot(good, valid),
                      [&](std::uint32_t lane) { waiting_for[failed++] = queued[lane]; });
        }
        waiting = failed;
        if (waiting == 0) break;
        const Philox again(s.frame_low, s.effect, s.frame_high << 16 | attempt, s.key[0], s.key[1]);
        for (std::size_t j = 0; j < waiting; j += lanes) {
            VU w0, w1, w2, w3;
            again(hn::Add(hn::LoadU(u32, waiting_for + j), hn::Set(u32, s.first_pixel)), w0, w1, w2, w3);
            hn::Store(uniform(w0), f, first);
            hn::Store(uniform(w1), f, second);
            for (std::size_t lane = 0; lane < std::min(lanes, waiting - j); ++lane) {
                row_u[waiting_for[j + lane]] = first[lane];
                row_v[waiting_for[j + lane]] = second[lane];
            }
        }
    }
}

void normal_row(std::size_t n, const Stream& s, float* z0, float* z1) {
    const Philox philox(s.frame_low, s.effect, s.frame_high << 16, s.key[0], s.key[1]);
    alignas(128) std::uint32_t words[4][block];
    for (std::size_t start = 0; start < n; start += block) {
        const std::size_t count = std::min(n - start, block);
        draw_words(philox, s.first_pixel + static_cast<std::uint32_t>(start), count, words);
        normals_of(words, count, z0 + start, z1 + start);
    }
}

/// One standard normal per pixel: four pixels, whose indices differ in the last two bits, share a counter.
void quartet_normals(std::size_t n, const Stream& s, float* z) {
    const F f;
    const U u32;
    const Philox philox(s.frame_low, s.effect, s.frame_high << 16, s.key[0], s.key[1]);
    const std::size_t before = s.first_pixel % 4;
    const std::uint32_t first_block = s.first_pixel / 4;
    const std::size_t blocks = (before + n + 3) / 4;
    float* const begin = z - before;
    for (std::size_t b = 0; b < blocks; b += hn::Lanes(u32)) {
        VU w0, w1, w2, w3;
        philox(hn::Iota(u32, first_block + static_cast<std::uint32_t>(b)), w0, w1, w2, w3);
        VF n0, n1, n2, n3;
        box_muller(w0, w1, n0, n1);
        box_muller(w2, w3, n2, n3);
        hn::StoreInterleaved4(n0, n1, n2, n3, f, begin + 4 * b);
    }
}

void merged_row(const float* mean, float variance, std::size_t n, const Stream& s, float* out, float* z) {
    const F f;
    quartet_normals(n, s, z);
    const VF gauss = hn::Set(f, variance);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        const VF mu = hn::LoadU(f, mean + i), normal = hn::LoadU(f, z + i);
        const VF total = hn::Add(mu, gauss);
        // Choose a so that the third central moment 6 a var = mu; subtract the term's own variance 2 a^2 from
        // the linear term.
        const VF a = hn::Div(hn::Mul(mu, constant(1.0F / 6)), total);
        const VF sigma = hn::Sqrt(hn::Sub(total, hn::Mul(hn::Mul(constant(2), a), a)));
        const VF skew = hn::Mul(a, hn::Sub(hn::Mul(normal, normal), constant(1)));
        hn::StoreU(hn::Add(hn::Add(mu, hn::Mul(sigma, normal)), skew), f, out + i);
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

bool any_above(const float* values, float limit, std::size_t n) {
    const F f;
    const VF bound = hn::Set(f, limit);
    VF most = bound;
    std::size_t i = 0;
    for (; i + hn::Lanes(f) <= n; i += hn::Lanes(f))
        most = hn::Max(most, hn::LoadU(f, values + i));
    for (; i < n; ++i)
        most = hn::Max(most, hn::Set(f, values[i]));
    return !hn::AllFalse(f, hn::Gt(most, bound));
}

void lag_row(float lag, float full_well_e, std::size_t n, float* charge, float* memory) {
    const F f;
    const VF share = hn::Set(f, lag), full = hn::Set(f, full_well_e);
    for (std::size_t i = 0; i < n; i += hn::Lanes(f)) {
        const VF q = hn::Add(hn::LoadU(f, charge + i), hn::Mul(share, hn::LoadU(f, memory + i)));
        hn::StoreU(q, f, charge + i);
        hn::StoreU(hn::Min(q, full), f, memory + i);
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
            // Gather at byte offsets of 16-bit entries; the upper half of each gathered word is the next
            // entry.
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
HWY_EXPORT(merged_row);
HWY_EXPORT(exp_row);
HWY_EXPORT(collect_row);
HWY_EXPORT(any_above);
HWY_EXPORT(lag_row);
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
void mean_row(const float* light, const float* response, float light_scale, const float* dark,
              float dark_scale, std::size_t n, float* out) {
    HWY_DYNAMIC_DISPATCH(mean_row)(light, response, light_scale, dark, dark_scale, n, out);
}
void poisson_row(const float* mean, std::size_t n, const Stream& stream, float* counts, float* z0, float* z1,
                 float* scratch) {
    HWY_DYNAMIC_DISPATCH(poisson_row)(mean, n, stream, counts, z0, z1, scratch);
}
void normal_row(std::size_t n, const Stream& stream, float* z0, float* z1) {
    HWY_DYNAMIC_DISPATCH(normal_row)(n, stream, z0, z1);
}
void merged_row(const float* mean, float variance, std::size_t n, const Stream& stream, float* out,
                float* z) {
    HWY_DYNAMIC_DISPATCH(merged_row)(mean, variance, n, stream, out, z);
}
void exp_row(const float* x, std::size_t n, float* out) {
    HWY_DYNAMIC_DISPATCH(exp_row)(x, n, out);
}
void collect_row(const Chain& chain, std::size_t n, float* charge) {
    HWY_DYNAMIC_DISPATCH(collect_row)(chain, n, charge);
}
bool any_above(const float* values, float limit, std::size_t n) {
    return HWY_DYNAMIC_DISPATCH(any_above)(values, limit, n);
}
void lag_row(float lag, float full_well_e, std::size_t n, float* charge, float* memory) {
    HWY_DYNAMIC_DISPATCH(lag_row)(lag, full_well_e, n, charge, memory);
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
