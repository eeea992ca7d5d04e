// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_packets.hpp"

#include "renderer/planets/tile_cones.hpp"
#include "terrain/surface_domain.hpp"

#include <bit>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "renderer/planets/tile_packets.cpp"
#include <hwy/foreach_target.h>
// Must follow foreach_target.h.
#include "renderer/planets/tile_patches-inl.hpp"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace obscura::renderer::HWY_NAMESPACE {
namespace {

/// The lanes of a packet that fit a register. Several groups take their steps in turn, so that one's loads
/// and divisions run while another waits for its own.
template<bool plane>
class Group {
public:
    void begin(const TileLanes& lanes, int first, double per_m_value, bool any) {
        const D d;
        const I i64;
        const auto load = [&](const Doubles& from) { return hn::Load(d, from.v + first); };
        result_ = hn::Load(i64, lanes.state + first);
        passed_ = in_state(TileLanes::passed);
        const M fresh = in_state(TileLanes::running);
        active_ = hn::Or(passed_, fresh);
        crossed_ = hn::MaskFromVec(hn::Zero(d));
        once_ = crossed_;
        jumps_ = crossed_;
        begun_ = running();
        if (!begun_) return;
        const V zero = hn::Zero(d), one = set(1);
        const WalkLines& walk = lanes.lines;
        ua_ = load(walk.ua);
        ub_ = load(walk.ub);
        va_ = load(walk.va);
        vb_ = load(walk.vb);
        wa_ = load(walk.wa);
        wb_ = load(walk.wb);
        miss2_ = load(lanes.miss2);
        speed2_ = load(lanes.speed2);
        per_m_ = set(per_m_value);
        offset_ = load(lanes.offset_m);
        half_cells_ = load(lanes.half_cells);
        per_half_ = reciprocal_of_power(half_cells_);
        first_i_ = load(lanes.first_i);
        first_j_ = load(lanes.first_j);
        vertices_ = hn::Load(i64, lanes.vertices + first);
        maxima_ = hn::Load(i64, lanes.maxima + first);
        x_ = load(lanes.x);
        to_ = load(lanes.to);
        exit_ = load(lanes.exit);
        i_ = load(lanes.i);
        j_ = load(lanes.j);
        width_ = load(lanes.width);
        per_width_ = reciprocal_of_power(width_);
        max_width_ = load(lanes.max_width);
        // u grows along the whole ray, or falls, or does not change but for rounding: as seen from a point of
        // an axis of the body.
        const V u_up = hn::Mul(ub_, wa_), u_down = hn::Mul(ua_, wb_), v_up = hn::Mul(vb_, wa_),
                v_down = hn::Mul(va_, wb_);
        steps_u_ = hn::IfThenElseZero(hn::Ge(hn::Sub(u_up, u_down), zero), one);
        steps_v_ = hn::IfThenElseZero(hn::Ge(hn::Sub(v_up, v_down), zero), one);
        const auto changes = [](V up, V down) {
            return hn::Gt(hn::Abs(hn::Sub(up, down)),
                          hn::Mul(set(1e-14), hn::Add(hn::Abs(up), hn::Abs(down))));
        };
        u_changes_ = changes(u_up, u_down);
        v_changes_ = changes(v_up, v_down);
        if (hn::AllFalse(d, fresh)) return;

        V from = x_, end = to_;
        narrow_to_heights<plane>(miss2_, speed2_, load(lanes.highest), load(lanes.least), from, end);
        finish(hn::AndNot(hn::Lt(from, end), fresh), TileLanes::off);
        const M narrowed = hn::And(fresh, active_);
        const V begin = x_;
        x_ = hn::IfThenElse(narrowed, from, x_);
        to_ = hn::IfThenElse(narrowed, end, to_);
        // Begin at the smallest node that holds both ends.
        const auto cell = [&](V a, V b, V at, V before, V number) {
            const V place = hn::Div(hn::Add(a, hn::Mul(b, at)), hn::Add(wa_, hn::Mul(wb_, at)));
            const V least = hn::Mul(number, width_);
            const V most = hn::Sub(hn::Add(least, width_), one);
            const V in_tile = hn::Floor(hn::Sub(hn::Mul(hn::Add(place, one), half_cells_), before));
            return hn::Min(hn::Max(in_tile, least), most);
        };
        const V i0 = cell(ua_, ub_, x_, first_i_, i_), i1 = cell(ua_, ub_, to_, first_i_, i_);
        const V j0 = cell(va_, vb_, x_, first_j_, j_), j1 = cell(va_, vb_, to_, first_j_, j_);
        const VI apart =
            hn::Or(hn::Xor(to_integers(i0), to_integers(i1)), hn::Xor(to_integers(j0), to_integers(j1)));
        // The power of two above it: the exponent of its double.
        const V number =
            hn::Sub(hn::BitCast(d, hn::Or(apart, hn::Set(i64, 0x4330000000000000))), set(0x1p52));
        const V below_it =
            hn::BitCast(d, hn::And(hn::BitCast(i64, number), hn::Set(i64, 0x7ff0000000000000)));
        const V held = hn::Max(hn::Add(below_it, below_it), one);
        // The ray is not above what is around it at first: begin at a node about as wide as its way in the
        // tile, which goes up to wider ones as the ray leaves their quarters.
        const V way = hn::Max(hn::Max(hn::Abs(hn::Sub(i1, i0)), hn::Abs(hn::Sub(j1, j0))), one);
        const V wide = hn::BitCast(d, hn::And(hn::BitCast(i64, way), hn::Set(i64, 0x7ff0000000000000)));
        V node_width = hn::Min(held, wide);
        if (any) {
            // Shadow rays begin at the ground.
            const M near = look_up_cones(narrowed, i0, j0, held, cell, lanes, first);
            node_width = hn::IfThenElse(hn::Or(near, hn::Eq(from, begin)), one, node_width);
        }
        width_ = hn::IfThenElse(narrowed, node_width, width_);
        per_width_ = hn::IfThenElse(narrowed, reciprocal_of_power(node_width), per_width_);
        i_ = hn::IfThenElse(narrowed, hn::Floor(hn::Mul(i0, per_width_)), i_);
        j_ = hn::IfThenElse(narrowed, hn::Floor(hn::Mul(j0, per_width_)), j_);
        prefetch(narrowed, i0, j0);
        prefetch(hn::AndNot(once_, narrowed), i1, j1);
        max_width_ = hn::IfThenElse(narrowed, held, max_width_);
    }

    [[nodiscard]] HWY_INLINE bool running() const { return !hn::AllFalse(D(), active_); }

    /// One node further.
    HWY_INLINE void step() {
        const D d;
        const I i64;
        const V zero = hn::Zero(d), one = set(1), half = set(0.5);
        const V side_u = hn::Sub(hn::Add(steps_u_, steps_u_), one),
                side_v = hn::Sub(hn::Add(steps_v_, steps_v_), one);
        const V plane_u =
            hn::Sub(hn::Mul(hn::Add(first_i_, hn::Mul(hn::Add(i_, steps_u_), width_)), per_half_), one);
        const V plane_v =
            hn::Sub(hn::Mul(hn::Add(first_j_, hn::Mul(hn::Add(j_, steps_v_), width_)), per_half_), one);
        const V x_u = hn::IfThenElse(u_changes_, reach(plane_u, ua_, ub_, wa_, wb_, x_), set(no_hit));
        const V x_v = hn::IfThenElse(v_changes_, reach(plane_v, va_, vb_, wa_, wb_, x_), set(no_hit));
        exit_ = hn::IfThenElse(active_, hn::Max(x_, hn::Min(hn::Min(x_u, x_v), to_)), exit_);

        // The highest vertex of the node.
        const M leaf = hn::And(hn::Eq(width_, one), active_);
        const M inner = hn::AndNot(leaf, active_);
        V highest = zero, h00 = zero, h10 = zero, h01 = zero, h11 = zero;
        if (!hn::AllFalse(d, inner)) {
            const V edge = hn::Mul(set(terrain::tile_cells), per_width_);
            const V before = hn::Round(hn::Mul(hn::Sub(hn::Mul(edge, edge), one), set(1.0 / 3)));
            const V number = hn::IfThenElseZero(inner, hn::Add(hn::Add(before, hn::Mul(j_, edge)), i_));
            const VI at = hn::Add(maxima_, hn::ShiftLeft<2>(to_integers(number)));
            highest = hn::Mul(hn::Add(offset_, first_floats(load_pairs(at))), per_m_);
        }
        if (!hn::AllFalse(d, leaf)) {
            const V number = hn::IfThenElseZero(leaf, hn::Add(hn::Mul(j_, set(terrain::tile_edge)), i_));
            const VI at = hn::Add(vertices_, hn::ShiftLeft<2>(to_integers(number)));
            const VI low = load_pairs(at),
                     high = load_pairs(
                         hn::Add(at, hn::Set(i64, terrain::tile_edge * std::int64_t{sizeof(float)})));
            const auto height = [&](V value) { return hn::Mul(hn::Add(offset_, value), per_m_); };
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
            const V at_x = hn::Add(miss2_, hn::Mul(speed2_, x_)),
                    at_exit = hn::Add(miss2_, hn::Mul(speed2_, exit_));
            over = hn::Gt(hn::Min(at_x, at_exit), limit);
        } else {
            const V lowest = hn::Max(x_, hn::Min(exit_, zero));
            const V radius2 = hn::Add(miss2_, hn::Mul(hn::Mul(speed2_, lowest), lowest));
            const V above = hn::Add(one, limit);
            over = hn::Gt(radius2, hn::Mul(above, above));
        }
        over = hn::And(active_, hn::Or(over, passed_));
        passed_ = hn::MaskFromVec(zero);

        // Patches that may be met.
        M through = over;
        const M tested = hn::AndNot(over, leaf);
        if (!hn::AllFalse(d, tested)) {
            const V hs = hn::Sub(h10, h00), hr = hn::Sub(h01, h00);
            const Patches<plane> patches{ua_,
                                         ub_,
                                         va_,
                                         vb_,
                                         wa_,
                                         wb_,
                                         miss2_,
                                         speed2_,
                                         h00,
                                         hs,
                                         hr,
                                         hn::Sub(hn::Sub(h11, h01), hs),
                                         half_cells_,
                                         hn::Sub(half_cells_, hn::Add(first_i_, i_)),
                                         hn::Sub(half_cells_, hn::Add(first_j_, j_))};
            V low, low_slope, high, high_slope;
            patches.at(x_, low, low_slope);
            patches.at(exit_, high, high_slope);
            const M at_once = hn::And(tested, hn::Le(low, zero));
            const M crossed = hn::AndNot(at_once, hn::And(tested, hn::Le(high, zero)));
            const M dips =
                hn::AndNot(hn::Or(at_once, crossed),
                           hn::And(tested, hn::And(hn::Lt(low_slope, zero), hn::Gt(high_slope, zero))));
            if (!hn::AllFalse(d, crossed)) {
                // All at once in the end.
                patches_.take(crossed, patches);
                low_ = hn::IfThenElse(crossed, low, low_);
                high_ = hn::IfThenElse(crossed, high, high_);
                crossed_ = hn::Or(crossed_, crossed);
            }
            finish(hn::Or(at_once, crossed), TileLanes::met);
            finish(dips, TileLanes::grazing);
            through = hn::Or(through, hn::AndNot(hn::Or(hn::Or(at_once, crossed), dips), tested));
        }

        // Down into the quarter that the ray is in.
        const M down = hn::AndNot(hn::Or(through, leaf), active_);
        if (!hn::AllFalse(d, down)) {
            // Not before it is below the highest vertex.
            x_ = hn::IfThenElse(down, begin_below<plane>(miss2_, speed2_, limit, x_), x_);
            const V finer = hn::Mul(width_, half);
            const V i2 = hn::Add(i_, i_), j2 = hn::Add(j_, j_);
            const V u = hn::Sub(hn::Mul(hn::Add(first_i_, hn::Mul(hn::Add(i2, one), finer)), per_half_), one);
            const V v = hn::Sub(hn::Mul(hn::Add(first_j_, hn::Mul(hn::Add(j2, one), finer)), per_half_), one);
            const V in_u = hn::Add(hn::Sub(ua_, hn::Mul(u, wa_)), hn::Mul(hn::Sub(ub_, hn::Mul(u, wb_)), x_));
            const V in_v = hn::Add(hn::Sub(va_, hn::Mul(v, wa_)), hn::Mul(hn::Sub(vb_, hn::Mul(v, wb_)), x_));
            width_ = hn::IfThenElse(down, finer, width_);
            per_width_ = hn::IfThenElse(down, hn::Add(per_width_, per_width_), per_width_);
            i_ = hn::IfThenElse(down, hn::Add(i2, hn::IfThenElseZero(hn::Ge(in_u, zero), one)), i_);
            j_ = hn::IfThenElse(down, hn::Add(j2, hn::IfThenElseZero(hn::Ge(in_v, zero), one)), j_);
        }

        // On to_ the next node, and up if that is in another quarter.
        through = hn::And(through, active_);
        if (!hn::AllFalse(d, through)) {
            const M ends = hn::And(through, hn::Ge(exit_, to_));
            const M in_u = hn::And(through, hn::Le(x_u, x_v)), in_v = hn::AndNot(in_u, through);
            const V next_i = hn::IfThenElse(in_u, hn::Add(i_, side_u), i_);
            const V next_j = hn::IfThenElse(in_v, hn::Add(j_, side_v), j_);
            const V up_i = hn::Floor(hn::Mul(next_i, half)), up_j = hn::Floor(hn::Mul(next_j, half));
            const M leaves = hn::Or(hn::Ne(up_i, hn::Floor(hn::Mul(i_, half))),
                                    hn::Ne(up_j, hn::Floor(hn::Mul(j_, half))));
            const M up = hn::And(hn::And(through, leaves), hn::Lt(width_, max_width_));
            x_ = hn::IfThenElse(through, exit_, x_);
            i_ = hn::IfThenElse(up, up_i, next_i);
            j_ = hn::IfThenElse(up, up_j, next_j);
            width_ = hn::IfThenElse(up, hn::Add(width_, width_), width_);
            per_width_ = hn::IfThenElse(up, hn::Mul(per_width_, half), per_width_);
            const M jumps = hn::And(through, jumps_);
            if (!hn::AllFalse(d, jumps)) {
                jumps_ = hn::AndNot(jumps, jumps_);
                x_ = hn::IfThenElse(jumps, jump_x_, x_);
                i_ = hn::IfThenElse(jumps, jump_i_, i_);
                j_ = hn::IfThenElse(jumps, jump_j_, j_);
                width_ = hn::IfThenElse(jumps, jump_width_, width_);
                per_width_ = hn::IfThenElse(jumps, reciprocal_of_power(jump_width_), per_width_);
            }
            const V last = hn::Sub(hn::Mul(set(terrain::tile_cells), per_width_), one);
            const M outside = hn::Or(hn::Or(hn::Lt(i_, zero), hn::Gt(i_, last)),
                                     hn::Or(hn::Lt(j_, zero), hn::Gt(j_, last)));
            finish(hn::Or(ends, hn::And(through, hn::Or(outside, once_))), TileLanes::off);
        }
    }

    /// `roots`: crossings are to be found within their cells; else they are anywhere in them.
    void end(TileLanes& lanes, int first, bool roots, TileOutcome& outcome) {
        if (!begun_) return;
        const D d;
        const auto store = [&](V value, Doubles& to) { hn::Store(value, d, to.v + first); };
        const M met = in_state(TileLanes::met);
        if (roots && !hn::AllFalse(d, met)) {
            if (!hn::AllFalse(d, crossed_))
                x_ = hn::IfThenElse(crossed_, patches_.root(x_, exit_, low_, high_, crossed_), x_);
            const auto place = [&](V a, V b, V before, V number) {
                const V at = hn::Div(hn::Add(a, hn::Mul(b, x_)), hn::Add(wa_, hn::Mul(wb_, x_)));
                const V in_cell =
                    hn::Add(hn::Mul(at, half_cells_), hn::Sub(half_cells_, hn::Add(before, number)));
                return hn::Min(hn::Max(in_cell, hn::Zero(d)), set(1));
            };
            store(place(ua_, ub_, first_i_, i_), lanes.s);
            store(place(va_, vb_, first_j_, j_), lanes.r);
        }
        store(x_, lanes.x);
        store(exit_, lanes.exit);
        store(i_, lanes.i);
        store(j_, lanes.j);
        store(width_, lanes.width);
        store(max_width_, lanes.max_width);
        store(to_, lanes.to);
        hn::Store(result_, I(), lanes.state + first);
        outcome.met |= mask_bits(met, first);
        outcome.grazing |= mask_bits(in_state(TileLanes::grazing), first);
    }

private:
    /// The cells at which rays begin, and what is above them: none of it is near where the ones before were.
    HWY_INLINE void prefetch(M lanes, V i, V j) const {
        const D d;
        alignas(64) std::int64_t at[packet_size];
        std::uint8_t on[8] = {};
        hn::StoreMaskBits(d, lanes, on);
        const auto number = [&](V row, double edge, V column) {
            return to_integers(hn::Add(hn::Mul(row, set(edge)), column));
        };
        const auto fetch = [&](VI addresses, std::int64_t next) {
            hn::Store(addresses, I(), at);
            for (std::uint32_t left = on[0]; left != 0; left &= left - 1) {
                const auto* const line = reinterpret_cast<const char*>(at[std::countr_zero(left)]);
                __builtin_prefetch(line);
                if (next != 0) __builtin_prefetch(line + next);
            }
        };
        const VI cell =
            number(hn::IfThenElseZero(lanes, j), terrain::tile_edge, hn::IfThenElseZero(lanes, i));
        fetch(hn::Add(vertices_, hn::ShiftLeft<2>(cell)), terrain::tile_edge * std::int64_t{sizeof(float)});
        const auto level = [&](double edge, double per_width, std::size_t before) {
            const V ni = hn::Floor(hn::Mul(i, set(per_width))), nj = hn::Floor(hn::Mul(j, set(per_width)));
            const VI node = number(hn::IfThenElseZero(lanes, nj), edge, hn::IfThenElseZero(lanes, ni));
            const VI first = hn::Set(I(), static_cast<std::int64_t>(before * sizeof(float)));
            fetch(hn::Add(hn::Add(maxima_, first), hn::ShiftLeft<2>(node)), 0);
        };
        level(terrain::tile_cells / 2, 0.5, 5461);
        level(terrain::tile_cells / 4, 0.25, 1365);
        level(terrain::tile_cells / 8, 0.125, 341);
    }
    /// Returns the rays that climb faster than the ground does around the cell in which they begin: they meet
    /// that cell, or nothing up to where the ground may rise faster. `cell`: for a place of the ray, from its
    /// line, the number of the tile's first cell and that of the node that the ray is in.
    template<typename Cell>
    HWY_INLINE M look_up_cones(M narrowed, V i0, V j0, V held, const Cell& cell, const TileLanes& lanes,
                               int first) {
        const D d;
        const I i64;
        const V zero = hn::Zero(d), one = set(1);
        const V at_i = hn::Floor(hn::Mul(i0, set(1.0 / cone_cells))),
                at_j = hn::Floor(hn::Mul(j0, set(1.0 / cone_cells)));
        const V node = hn::IfThenElseZero(narrowed, hn::Add(hn::Mul(at_j, set(cone_edge)), at_i));
        const V quadrant = hn::Add(steps_u_, hn::Add(steps_v_, steps_v_));
        const VI rings =
            load_pairs(hn::Add(hn::Load(i64, lanes.cones + first),
                               hn::ShiftLeft<2>(to_integers(hn::Add(hn::Mul(node, set(4)), quadrant)))));
        V climb; // as the tangent of the elevation
        if constexpr (plane)
            climb = hn::Div(speed2_, hn::Sqrt(hn::Add(hn::Mul(ub_, ub_), hn::Mul(vb_, vb_))));
        else
            climb = hn::Mul(hn::Mul(x_, hn::Sqrt(hn::Div(speed2_, miss2_))),
                            hn::Add(one, hn::Min(hn::Load(d, lanes.least.v + first), zero)));
        const VI code =
            hn::Min(hn::Sub(hn::ShiftRight<rise_shift>(hn::BitCast(i64, climb)), hn::Set(i64, rise_base)),
                    hn::Set(i64, steepest_rise - 1));
        const auto clears = [&](VI ring) {
            const auto lower = hn::Gt(hn::And(ring, hn::Set(i64, 0xff)), code);
            return hn::Not(hn::RebindMask(d, lower));
        };
        const M near = hn::And(narrowed, clears(rings)),
                beside = hn::And(near, clears(hn::ShiftRight<8>(rings))),
                around = hn::And(beside, clears(hn::ShiftRight<16>(rings))),
                all = hn::And(around, clears(hn::ShiftRight<24>(rings)));
        once_ = all;
        if (hn::AllFalse(d, hn::AndNot(all, near))) return near;
        const auto by_ring = [&](double first_ring, double second, double third) {
            return hn::IfThenElse(around, set(third), hn::IfThenElse(beside, set(second), set(first_ring)));
        };
        const V wide_of_ring = by_ring(1u << cone_rings[0], 1u << cone_rings[1], 1u << cone_rings[2]),
                per_wide = reciprocal_of_power(wide_of_ring);
        // The border of the nodes beside that of the ring in which the ray begins.
        const auto border = [&](V at, V steps, V before, V a, V b, M changing) {
            const V beyond = hn::Add(hn::Floor(hn::Mul(at, per_wide)), hn::Sub(hn::Mul(steps, set(3)), one));
            const V face = hn::Sub(hn::Mul(hn::Add(before, hn::Mul(beyond, wide_of_ring)), per_half_), one);
            return hn::IfThenElse(changing, reach(face, a, b, wa_, wb_, x_), set(no_hit));
        };
        const V clear = hn::Min(border(i0, steps_u_, first_i_, ua_, ub_, u_changes_),
                                border(j0, steps_v_, first_j_, va_, vb_, v_changes_));
        once_ = hn::Or(all, hn::And(near, hn::Ge(clear, to_)));
        jumps_ = hn::AndNot(once_, near);
        jump_x_ = clear;
        const V landing = hn::IfThenElse(jumps_, clear, to_);
        jump_width_ = hn::Min(wide_of_ring, held);
        const V per_width = reciprocal_of_power(jump_width_);
        jump_i_ = hn::Floor(hn::Mul(cell(ua_, ub_, landing, first_i_, i_), per_width));
        jump_j_ = hn::Floor(hn::Mul(cell(va_, vb_, landing, first_j_, j_), per_width));
        return near;
    }
    [[nodiscard]] HWY_INLINE M in_state(TileLanes::State state) const {
        const I i64;
        return hn::MaskFromVec(hn::BitCast(D(), hn::VecFromMask(i64, hn::Eq(result_, hn::Set(i64, state)))));
    }
    HWY_INLINE void finish(M which, std::int64_t with) {
        const D d;
        const I i64;
        result_ = hn::IfThenElse(hn::MaskFromVec(hn::BitCast(i64, hn::VecFromMask(d, which))),
                                 hn::Set(i64, with), result_);
        active_ = hn::AndNot(which, active_);
    }

    V ua_, ub_, va_, vb_, wa_, wb_, miss2_, speed2_, per_m_, offset_, half_cells_, per_half_, first_i_,
        first_j_;
    bool begun_ = false;
    VI vertices_, maxima_, result_;
    V x_, to_, exit_, i_, j_, width_, per_width_, max_width_, steps_u_, steps_v_;
    M active_, passed_, u_changes_, v_changes_;
    M once_;  ///< rays that meet the cell in which they begin, or nothing in the tile
    M jumps_; ///< rays that meet the cell in which they begin, or nothing up to `jump_x_`
    V jump_x_, jump_i_, jump_j_, jump_width_; ///< the node there
    M crossed_; ///< rays that cross `patches_` between x and exit, where their heights are `low_` and `high_`
    Patches<plane> patches_;
    V low_, high_;
};

template<bool plane>
TileOutcome trace_groups(TileLanes& lanes, double per_m, bool roots) {
    constexpr int size = static_cast<int>(hn::MaxLanes(D())), count = packet_size / size;
    Group<plane> groups[count];
    for (int k = 0; k < count; ++k)
        groups[k].begin(lanes, k * size, per_m, !roots);
    for (bool more = true; more;) {
        more = false;
        for (Group<plane>& group : groups)
            if (group.running()) {
                group.step();
                more = true;
            }
    }
    TileOutcome outcome{};
    for (int k = 0; k < count; ++k)
        groups[k].end(lanes, k * size, roots, outcome);
    return outcome;
}

TileOutcome trace_all(TileLanes& lanes, double per_m, bool plane, bool roots) {
    return plane ? trace_groups<true>(lanes, per_m, roots) : trace_groups<false>(lanes, per_m, roots);
}

void enter_all(std::uint32_t lanes, bool all, const TileSource& tile, const WalkParts& parts,
               const Doubles& best, double width, double i, double j, TileLanes& to) {
    const D d;
    const I i64;
    for (int first = 0; first < packet_size; first += static_cast<int>(hn::Lanes(d))) {
        const std::uint8_t entering[8] = {static_cast<std::uint8_t>(lanes >> first)};
        const M in = hn::LoadMaskBits(d, entering);
        const M takes = all ? hn::Eq(hn::Zero(d), hn::Zero(d)) : in;
        const auto number = [&](M where, V value, Doubles& out) {
            hn::BlendedStore(value, where, d, out.v + first);
        };
        const auto address = [&](M where, std::int64_t value, std::int64_t* out) {
            const V bits = hn::BitCast(d, hn::Set(i64, value));
            hn::BlendedStore(bits, where, d, reinterpret_cast<double*>(out) + first);
        };
        number(takes, set(tile.offset_m), to.offset_m);
        number(takes, set(tile.half_cells), to.half_cells);
        number(takes, set(tile.first_i), to.first_i);
        number(takes, set(tile.first_j), to.first_j);
        number(takes, set(tile.highest), to.highest);
        number(takes, set(tile.least), to.least);
        address(takes, tile.vertices, to.vertices);
        address(takes, tile.maxima, to.maxima);
        address(takes, tile.cones, to.cones);
        address(takes, tile.node, to.node);
        number(takes, set(width), to.width);
        number(takes, set(width), to.max_width);
        number(takes, set(i), to.i);
        number(takes, set(j), to.j);
        if (all) address(takes, TileLanes::off, to.state);
        address(in, TileLanes::running, to.state);
        const V from = hn::Load(d, parts.from.v + first);
        const V end = hn::Min(hn::Load(d, parts.to.v + first), hn::Load(d, best.v + first));
        number(takes, from, to.x);
        number(takes, end, to.to);
    }
}

} // namespace
} // namespace obscura::renderer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace obscura::renderer {

HWY_EXPORT(enter_all);
HWY_EXPORT(trace_all);

void enter_tile(std::uint32_t lanes, bool all, const TileSource& tile, const WalkParts& parts,
                const Doubles& best, double width, double i, double j, TileLanes& to) {
    HWY_DYNAMIC_DISPATCH(enter_all)(lanes, all, tile, parts, best, width, i, j, to);
}

TileOutcome trace_tile_lanes(TileLanes& lanes, double per_m, bool plane, bool roots) {
    return HWY_DYNAMIC_DISPATCH(trace_all)(lanes, per_m, plane, roots);
}

} // namespace obscura::renderer
#endif
