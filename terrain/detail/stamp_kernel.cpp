// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/stamp_kernel.hpp"

#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "terrain/detail/stamp_kernel.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace obscura::terrain::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 8>;

bool add_to_block(const BlockPoints& points, const ProfileStamp& stamp, BlockValues& sums,
                  BlockValues& left) {
    const D d;
    const hn::Rebind<std::int32_t, D> narrow;
    const hn::RebindToSigned<D> wide;
    const auto cx = hn::Set(d, stamp.centre.x), cy = hn::Set(d, stamp.centre.y),
               cz = hn::Set(d, stamp.centre.z);
    const auto per_square = hn::Set(d, stamp.steps_per_square),
               last = hn::Set(d, static_cast<double>(stamp.steps));
    const auto scale = hn::Set(d, stamp.scale), kept = hn::Set(d, stamp.kept);
    const auto zero = hn::Zero(d), one = hn::Set(d, 1), two = hn::Set(d, 2), three = hn::Set(d, 3);
    const auto per_fade = hn::Set(d, 1 / (stamp.kept - stamp.removed)), removal = hn::Set(d, stamp.removal);
    auto nearest = last;
    for (std::size_t n = 0; n < stamp_block_size; n += hn::Lanes(d)) {
        const auto x = hn::Sub(hn::Load(d, points.x.data() + n), cx);
        const auto y = hn::Sub(hn::Load(d, points.y.data() + n), cy);
        const auto z = hn::Sub(hn::Load(d, points.z.data() + n), cz);
        const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
        const auto place = hn::Min(hn::Mul(square, per_square), last);
        if (hn::AllFalse(d, hn::Lt(place, last))) {
            hn::Store(one, d, left.data() + n);
            continue;
        }
        nearest = hn::Min(nearest, place);
        const auto whole = hn::Floor(place);
        const auto step = hn::PromoteTo(wide, hn::DemoteTo(narrow, whole));
        const auto low = hn::GatherIndex(d, stamp.profile, step),
                   high = hn::GatherIndex(d, stamp.profile + 1, step);
        const auto height = hn::Add(low, hn::Mul(hn::Sub(place, whole), hn::Sub(high, low)));
        hn::Store(hn::Add(hn::Load(d, sums.data() + n), hn::Mul(scale, height)), d, sums.data() + n);
        const auto fade = hn::Min(hn::Max(hn::Mul(hn::Sub(kept, place), per_fade), zero), one);
        const auto smooth = hn::Mul(hn::Mul(fade, fade), hn::Sub(three, hn::Mul(two, fade)));
        hn::Store(hn::Sub(one, hn::Mul(removal, smooth)), d, left.data() + n);
    }
    return !hn::AllFalse(d, hn::Lt(nearest, kept));
}

void scale_in_block(BlockValues& values, const BlockValues& left) {
    const D d;
    for (std::size_t n = 0; n < stamp_block_size; n += hn::Lanes(d))
        hn::Store(hn::Mul(hn::Load(d, values.data() + n), hn::Load(d, left.data() + n)), d,
                  values.data() + n);
}

void add_clamped_in_block(BlockValues& total, const BlockValues& values, double least, double largest) {
    const D d;
    const auto low = hn::Set(d, least), high = hn::Set(d, largest);
    for (std::size_t n = 0; n < stamp_block_size; n += hn::Lanes(d)) {
        const auto value = hn::Min(hn::Max(hn::Load(d, values.data() + n), low), high);
        hn::Store(hn::Add(hn::Load(d, total.data() + n), value), d, total.data() + n);
    }
}

} // namespace
} // namespace obscura::terrain::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::terrain {
namespace {

HWY_EXPORT(add_to_block);
HWY_EXPORT(scale_in_block);
HWY_EXPORT(add_clamped_in_block);

} // namespace

bool add_profile(const BlockPoints& points, const ProfileStamp& stamp, BlockValues& sums, BlockValues& left) {
    return HWY_DYNAMIC_DISPATCH(add_to_block)(points, stamp, sums, left);
}

void scale_block(BlockValues& values, const BlockValues& left) {
    HWY_DYNAMIC_DISPATCH(scale_in_block)(values, left);
}

void add_clamped(BlockValues& total, const BlockValues& values, double least, double largest) {
    HWY_DYNAMIC_DISPATCH(add_clamped_in_block)(total, values, least, largest);
}

} // namespace obscura::terrain
#endif
