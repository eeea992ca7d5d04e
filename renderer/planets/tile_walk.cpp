// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_walk.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "renderer/planets/tile_walk.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include "renderer/planets/tile_patches-inl.hpp"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace obscura::renderer::HWY_NAMESPACE {
namespace {

/// Added to unit heights: far above the rounding of a bilinear height.
constexpr double margin = 1e-12;

HWY_INLINE V load(const Doubles& from, int first) {
    return hn::Load(D(), from.v + first);
}
HWY_INLINE void store(V value, Doubles& to, int first) {
    hn::Store(value, D(), to.v + first);
}
HWY_INLINE V dot(V ax, V ay, V az, V bx, V by, V bz) {
    return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
}

HWY_INLINE V half_chord(double radius, V miss2, V speed2) {
    const V under = hn::Div(hn::Sub(set(radius * radius), miss2), speed2);
    return hn::Sqrt(hn::Max(under, hn::Zero(D())));
}

WalkBegin begin_all(const Vec3s& origin, const Vec3s& direction, const Doubles& t_max, const Lanes& active,
                    double least, double largest, WalkRays& rays) {
    const D d;
    const hn::Rebind<std::int32_t, D> narrow;
    const hn::RebindToSigned<D> wide;
    WalkBegin begin{};
    rays.direction = direction;
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(d))) {
        const V ox = load(origin.x, first), oy = load(origin.y, first), oz = load(origin.z, first);
        const V dx = load(direction.x, first), dy = load(direction.y, first), dz = load(direction.z, first);
        const V speed2 = dot(dx, dy, dz, dx, dy, dz);
        const V along = hn::Div(hn::Neg(dot(ox, oy, oz, dx, dy, dz)), speed2);
        const V nx = hn::Add(ox, hn::Mul(along, dx)), ny = hn::Add(oy, hn::Mul(along, dy)),
                nz = hn::Add(oz, hn::Mul(along, dz));
        const V miss2 = dot(nx, ny, nz, nx, ny, nz);
        const V outer = half_chord(1 + largest + margin, miss2, speed2);
        const V inner = half_chord(1 + least - margin, miss2, speed2);
        const V from = hn::Max(hn::Neg(outer), hn::Neg(along));
        V to = hn::Min(outer, hn::Sub(load(t_max, first), along));
        // Nothing is met within the inner sphere, and what begins outside has met something before it.
        const M through = hn::And(hn::Gt(inner, hn::Zero(d)), hn::Le(from, hn::Neg(inner)));
        to = hn::IfThenElse(through, hn::Min(to, hn::Neg(inner)), to);
        const M on =
            hn::MaskFromVec(hn::BitCast(d, hn::PromoteTo(wide, hn::Load(narrow, active.on + first))));
        store(nx, rays.near.x, first);
        store(ny, rays.near.y, first);
        store(nz, rays.near.z, first);
        store(along, rays.along, first);
        store(miss2, rays.miss2, first);
        store(speed2, rays.speed2, first);
        store(inner, rays.inner, first);
        store(hn::IfThenElse(on, from, set(1)), rays.from, first);
        store(hn::IfThenElse(on, to, set(-1)), rays.to, first);
        const M begun = hn::And(on, hn::Lt(from, to));
        begin.begun |= mask_bits(begun, first);
        begin.beneath |= mask_bits(hn::And(begun, hn::Lt(hn::Abs(from), inner)), first);
        begin.within |= mask_bits(hn::And(begun, hn::Eq(from, hn::Neg(along))), first);
    }
    return begin;
}

/// terrain::cube_face_of() as a number.
HWY_INLINE V faces_at(const WalkRays& rays, V at, int first) {
    const auto place = [&](const Doubles& near, const Doubles& direction) {
        return hn::Add(load(near, first), hn::Mul(at, load(direction, first)));
    };
    const V px = place(rays.near.x, rays.direction.x), py = place(rays.near.y, rays.direction.y),
            pz = place(rays.near.z, rays.direction.z);
    const V x = hn::Abs(px), y = hn::Abs(py), z = hn::Abs(pz);
    const auto sided = [](V p, double face) {
        return hn::IfThenElse(hn::Ge(p, hn::Zero(D())), set(face), set(face + 1));
    };
    return hn::IfThenElse(hn::And(hn::Ge(x, y), hn::Ge(x, z)), sided(px, 0),
                          hn::IfThenElse(hn::Ge(y, z), sided(py, 2), sided(pz, 4)));
}

FaceLanes whole_on_all(const WalkRays& rays, std::uint32_t lanes) {
    FaceLanes whole{};
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(D()))) {
        const V begin = faces_at(rays, load(rays.from, first), first),
                end = faces_at(rays, load(rays.to, first), first);
        const M same = hn::Eq(begin, end);
        for (std::size_t face = 0; face < whole.size(); ++face)
            whole[face] |=
                lanes & mask_bits(hn::And(same, hn::Eq(begin, set(static_cast<double>(face)))), first);
    }
    return whole;
}

template<bool plane>
WalkBox narrow_all(const WalkRays& rays, const WalkLines& lines, const Doubles& best, double highest,
                   double least, WalkParts& parts) {
    const D d;
    const V zero = hn::Zero(d), infinite = set(no_hit);
    const double top = highest + margin, bottom = least - margin;
    V u0 = infinite, v0 = infinite, u1 = hn::Neg(infinite), v1 = u1;
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(d))) {
        const V miss2 = load(rays.miss2, first), speed2 = load(rays.speed2, first);
        V from = load(parts.from, first), to = hn::Min(load(parts.to, first), load(best, first));
        V through; // where a ray is below all
        if constexpr (plane) {
            const M falls = hn::Lt(speed2, zero), rises = hn::Gt(speed2, zero);
            const V x = hn::Div(hn::Sub(set(top), miss2), speed2);
            from = hn::IfThenElse(falls, hn::Max(from, x), from);
            to = hn::IfThenElse(rises, hn::Min(to, x), to);
            through = hn::IfThenElse(falls, hn::Div(hn::Sub(set(bottom), miss2), speed2), to);
        } else {
            const V half = half_chord(1 + top, miss2, speed2), inner = half_chord(1 + bottom, miss2, speed2);
            from = hn::Max(from, hn::Neg(half));
            to = hn::Min(to, half);
            through = hn::IfThenElse(hn::Gt(inner, zero), hn::Neg(inner), to);
        }
        // A ray that comes in below all meets a wall at once.
        to = hn::IfThenElse(hn::Gt(through, from), hn::Min(to, through), to);
        store(from, parts.from, first);
        store(to, parts.to, first);
        const M left = hn::Lt(from, to);
        const V ua = load(lines.ua, first), ub = load(lines.ub, first), va = load(lines.va, first),
                vb = load(lines.vb, first), wa = load(lines.wa, first), wb = load(lines.wb, first);
        for (const V x : {from, to}) {
            const V per_w = plane ? set(1) : hn::Div(set(1), hn::Add(wa, hn::Mul(wb, x)));
            const V u = hn::Mul(hn::Add(ua, hn::Mul(ub, x)), per_w);
            const V v = hn::Mul(hn::Add(va, hn::Mul(vb, x)), per_w);
            u0 = hn::IfThenElse(left, hn::Min(u0, u), u0);
            u1 = hn::IfThenElse(left, hn::Max(u1, u), u1);
            v0 = hn::IfThenElse(left, hn::Min(v0, v), v0);
            v1 = hn::IfThenElse(left, hn::Max(v1, v), v1);
        }
    }
    return {hn::GetLane(hn::MinOfLanes(d, u0)), hn::GetLane(hn::MaxOfLanes(d, u1)),
            hn::GetLane(hn::MinOfLanes(d, v0)), hn::GetLane(hn::MaxOfLanes(d, v1))};
}

WalkBox narrow_any(const WalkRays& rays, const WalkLines& lines, const Doubles& best, double highest,
                   double least, bool plane, WalkParts& parts) {
    return plane ? narrow_all<true>(rays, lines, best, highest, least, parts)
                 : narrow_all<false>(rays, lines, best, highest, least, parts);
}

/// Where a line is not below 0 (`low` false) and not above it (`low` true), in [from, to].
struct Halves {
    V root, slope;
    M high_side; ///< the line does not depend on x: on the high side

    HWY_INLINE Halves(V a, V b)
        : root(hn::Neg(hn::Div(a, b))), slope(b), high_side(hn::Ge(a, hn::Zero(D()))) {}

    HWY_INLINE void narrow(bool low, V& from, V& to) const {
        const V zero = hn::Zero(D());
        const M rises = hn::Gt(slope, zero), falls = hn::Lt(slope, zero);
        const M begins = low ? falls : rises, ends = low ? rises : falls;
        const M flat = hn::AndNot(hn::Or(rises, falls), low ? high_side : hn::Not(high_side));
        from = hn::IfThenElse(begins, hn::Max(from, root), from);
        to = hn::IfThenElse(ends, hn::Min(to, root), to);
        to = hn::IfThenElse(flat, from, to);
    }
};

template<bool plane>
void split_all(const WalkRays& rays, const WalkLines& lines, const Doubles& reaches, const Doubles& best,
               const WalkTile& tile, WalkParts& parts, WalkSplit& split) {
    const D d;
    const V zero = hn::Zero(d);
    split.here = 0;
    for (std::uint32_t& lanes : split.lanes)
        lanes = 0;
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(d))) {
        const V from = load(parts.from, first);
        const V to = hn::Min(load(parts.to, first), load(best, first));
        store(to, parts.to, first);
        const M active = hn::Lt(from, to);
        M splits = active;
        if (!tile.can_split) {
            splits = hn::MaskFromVec(zero);
        } else if (tile.fixed_reach < 0) {
            const V near_m = hn::Add(set(tile.radius_m), hn::Mul(set(tile.spacing_m), load(reaches, first)));
            splits = hn::And(active, hn::Lt(set(tile.distance2_m2), hn::Mul(near_m, near_m)));
        }
        const V miss2 = load(rays.miss2, first), speed2 = load(rays.speed2, first);
        // Rays that are not above everything all the way.
        const auto may_meet = [&](V begin, V end, double highest) {
            if constexpr (plane) {
                const V lowest = hn::Min(hn::Mul(speed2, begin), hn::Mul(speed2, end));
                return hn::Le(hn::Add(miss2, lowest), set(highest));
            } else {
                const V lowest = hn::Max(begin, hn::Min(end, zero));
                const V radius2 = hn::Add(miss2, hn::Mul(hn::Mul(speed2, lowest), lowest));
                return hn::Le(radius2, set((1 + highest) * (1 + highest)));
            }
        };
        split.here |=
            mask_bits(hn::And(hn::AndNot(splits, active), may_meet(from, to, tile.highest + margin)), first);
        if (hn::AllFalse(d, splits)) {
            for (WalkParts& quarter : split.quarter) {
                store(zero, quarter.from, first);
                store(zero, quarter.to, first);
            }
            continue;
        }
        const V wa = load(lines.wa, first), wb = load(lines.wb, first);
        const V mu = set(tile.u_middle), mv = set(tile.v_middle);
        const Halves u(hn::Sub(load(lines.ua, first), hn::Mul(mu, wa)),
                       hn::Sub(load(lines.ub, first), hn::Mul(mu, wb)));
        const Halves v(hn::Sub(load(lines.va, first), hn::Mul(mv, wa)),
                       hn::Sub(load(lines.vb, first), hn::Mul(mv, wb)));
        for (std::size_t q = 0; q < 4; ++q) {
            V begin = from, end = to;
            u.narrow((q & 1) == 0, begin, end);
            v.narrow((q & 2) == 0, begin, end);
            const M in = hn::And(hn::And(splits, hn::Lt(begin, end)),
                                 may_meet(begin, end, tile.child_highest[q] + margin));
            store(begin, split.quarter[q].from, first);
            store(hn::IfThenElse(in, end, begin), split.quarter[q].to, first);
            split.lanes[q] |= mask_bits(in, first);
        }
    }
}

void split_any(const WalkRays& rays, const WalkLines& lines, const Doubles& reach, const Doubles& best,
               const WalkTile& tile, bool plane, WalkParts& parts, WalkSplit& split) {
    if (plane)
        split_all<true>(rays, lines, reach, best, tile, parts, split);
    else
        split_all<false>(rays, lines, reach, best, tile, parts, split);
}

std::uint32_t left_all(const WalkParts& parts, const Doubles& best) {
    const D d;
    std::uint32_t lanes = 0;
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(d)))
        lanes |= mask_bits(hn::Lt(load(parts.from, first), hn::Min(load(parts.to, first), load(best, first))),
                           first);
    return lanes;
}

} // namespace
} // namespace obscura::renderer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::renderer {

HWY_EXPORT(begin_all);
HWY_EXPORT(whole_on_all);
HWY_EXPORT(narrow_any);
HWY_EXPORT(split_any);
HWY_EXPORT(left_all);

WalkBegin begin_walk(const Vec3s& origin, const Vec3s& direction, const Doubles& t_max, const Lanes& active,
                     double least, double largest, WalkRays& rays) {
    return HWY_DYNAMIC_DISPATCH(begin_all)(origin, direction, t_max, active, least, largest, rays);
}

FaceLanes whole_on_faces(const WalkRays& rays, std::uint32_t lanes) {
    return HWY_DYNAMIC_DISPATCH(whole_on_all)(rays, lanes);
}

WalkBox narrow_walk(const WalkRays& rays, const WalkLines& lines, const Doubles& best, double highest,
                    double least, bool plane, WalkParts& parts) {
    return HWY_DYNAMIC_DISPATCH(narrow_any)(rays, lines, best, highest, least, plane, parts);
}

void split_walk(const WalkRays& rays, const WalkLines& lines, const Doubles& reach, const Doubles& best,
                const WalkTile& tile, bool plane, WalkParts& parts, WalkSplit& split) {
    HWY_DYNAMIC_DISPATCH(split_any)(rays, lines, reach, best, tile, plane, parts, split);
}

std::uint32_t lanes_left(const WalkParts& parts, const Doubles& best) {
    return HWY_DYNAMIC_DISPATCH(left_all)(parts, best);
}

} // namespace obscura::renderer
#endif
