// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/packet_tracer.hpp"

#include "renderer/planets/tile_packets.hpp"
#include "renderer/planets/tile_rays.hpp"
#include "renderer/planets/tile_walk.hpp"

#include <algorithm>
#include <bit>

namespace obscura::renderer {
namespace {

using namespace tile_rays;

/// Calls `use` with the number of each lane of a set.
template<typename Use>
void for_lanes(std::uint32_t lanes, const Use& use) {
    for (; lanes != 0; lanes &= lanes - 1)
        use(std::countr_zero(lanes));
}

/// All rays of a packet go down the quadtree of tiles together, front to back as the first of them does;
/// each keeps its own interval, and waits with the tile that it takes until all of them have one or a further
/// one follows: then those are traced at once. A ray's crossing is the nearest in any of its tiles, so that
/// it does not depend on the other rays.
template<typename Ray>
class PacketTracer {
public:
    static constexpr bool plane = std::is_same_v<Ray, PlaneRay>;

    PacketTracer(const SurfaceTiles& tiles, const ScaledRays& rays, bool any, TileCrossings& found)
        : tiles_(tiles), rays_(rays), any_(any), found_(found), per_m_(1 / tiles.domain().unit_m()) {}

    void trace() {
        for (double& t : found_.t.v)
            t = no_hit;
        begin();
        if (begun_ == 0) return;
        for (double& best : best_.v)
            best = no_hit;
        segments_.miss2 = walk_.miss2;
        segments_.speed2 = walk_.speed2;
        min_reach_ = no_hit;
        for_lanes(begun_, [&](int i) { min_reach_ = std::min(min_reach_, rays_.reach[i]); });
        if constexpr (plane)
            trace_face(0, {walk_.from, walk_.to});
        else
            trace_faces();
        report();
    }

private:
    /// Parts of a ray that are in front of others, and where they are: on a face, a node that is made, or one
    /// that is still to be looked up.
    struct Entry {
        SurfaceNode* node;
        int quarter; ///< of the node; -1: the node itself
        WalkParts parts;
    };

    /// Sets up the rays: `begun_` are those that may meet something and have not done so yet.
    void begin() {
        std::uint32_t alone = 0;
        begun_ = 0;
        if constexpr (plane) {
            for (int i = 0; i < packet_size; ++i) {
                walk_.from[i] = 1;
                walk_.to[i] = -1;
                walk_.miss2[i] = walk_.speed2[i] = 0;
                walk_.near.set(i, {});
                walk_.direction.set(i, {});
                if (rays_.active.on[i] == 0) continue;
                const Vec3 origin = rays_.origin.lane(i), direction = rays_.direction.lane(i);
                double from = 0, to = rays_.t_max[i];
                if (!PlaneRay::clip_to_box(origin, direction, tiles_.least(), tiles_.largest(), from, to))
                    continue;
                if (!any_ && from == 0) { // it may begin below the surface
                    alone |= 1u << i;
                    continue;
                }
                const PlaneRay ray{origin + from * direction, direction};
                walk_.near.set(i, ray.begin);
                walk_.direction.set(i, direction);
                walk_.along[i] = from;
                walk_.miss2[i] = ray.begin.z;
                walk_.speed2[i] = direction.z;
                walk_.from[i] = 0;
                walk_.to[i] = to - from;
                begun_ |= 1u << i;
            }
        } else {
            const WalkBegin begin = begin_walk(rays_.origin, rays_.direction, rays_.t_max, rays_.active,
                                               tiles_.least(), tiles_.largest(), walk_);
            alone = begin.beneath;
            // In the shell of heights a ray may begin below the surface.
            if (!any_)
                for_lanes(begin.within & ~alone, [&](int i) {
                    const double from = walk_.from[i];
                    if (TileTracer(tiles_, levels(i)).is_below(ray(i).at(from), ray(i).height(from).value))
                        alone |= 1u << i;
                });
            for_lanes(alone, [&](int i) {
                walk_.from[i] = 1;
                walk_.to[i] = -1;
            });
            begun_ = begin.begun & ~alone;
        }
        for_lanes(alone, [&](int i) {
            found_.set(i, TileTracer(tiles_, levels(i))
                              .first_crossing(rays_.origin.lane(i), rays_.direction.lane(i), rays_.t_max[i]));
        });
    }

    [[nodiscard]] Ray ray(int i) const {
        if constexpr (plane)
            return {walk_.near.lane(i), walk_.direction.lane(i)};
        else
            return {walk_.near.lane(i), walk_.direction.lane(i), walk_.miss2[i], walk_.speed2[i]};
    }
    [[nodiscard]] LevelChoice levels(int i) const { return rays_.levels(i); }

    void trace_faces() {
        // Where the ends of a ray's part are on one face, all of it is: faces are convex.
        const FaceLanes whole = whole_on_faces(walk_, begun_);
        for (std::size_t face = 0; face < whole.size(); ++face)
            if (whole[face] == begun_) return trace_face(face, {walk_.from, walk_.to});
        std::array<WalkParts, terrain::cube_face_count> faces;
        std::array<std::size_t, terrain::cube_face_count> order{};
        std::array<bool, terrain::cube_face_count> met{};
        std::size_t count = 0;
        const auto add = [&](int i, std::size_t face, double from, double to) {
            if (!met[face]) {
                met[face] = true;
                order[count++] = face;
                for (int k = 0; k < packet_size; ++k) {
                    faces[face].from[k] = 1;
                    faces[face].to[k] = -1;
                }
            }
            // Parts of one face follow on each other.
            if (!(faces[face].from[i] < faces[face].to[i])) faces[face].from[i] = from;
            faces[face].to[i] = to;
        };
        for_lanes(begun_, [&](int i) {
            const Ray one = ray(i);
            const double from = walk_.from[i], to = walk_.to[i];
            for (std::size_t face = 0; face < whole.size(); ++face)
                if ((whole[face] >> i & 1u) != 0) return add(i, face, from, to);
            const FaceCuts cuts(one, from, to);
            for (std::size_t k = 0; k < cuts.count; ++k)
                add(i, terrain::cube_face_of(one.at((cuts.at[k] + cuts.at[k + 1]) / 2)), cuts.at[k],
                    cuts.at[k + 1]);
        });
        for (std::size_t k = 0; k < count; ++k)
            trace_face(order[k], faces[order[k]]);
    }

    void trace_face(std::size_t face, const WalkParts& parts) {
        std::uint32_t left = lanes_left(parts, best_);
        if (left == 0) return;
        set_lines(face);
        // Front to back for rays along which u and v change as along the first.
        const WalkLines& lines = segments_.lines;
        const int lead = std::countr_zero(left);
        const std::uint32_t first =
            (lines.ub[lead] * lines.wa[lead] < lines.ua[lead] * lines.wb[lead] ? 1u : 0u) |
            (lines.vb[lead] * lines.wa[lead] < lines.va[lead] * lines.wb[lead] ? 2u : 0u);
        std::size_t waiting = 1;
        Entry& all = stack_[0];
        all.quarter = -1;
        all.parts = parts;
        all.node = deepest_of_all(tiles_.root(face), all.parts);
        WalkSplit split;
        while (waiting > 0) {
            Entry& entry = stack_[--waiting];
            left = lanes_left(entry.parts, best_);
            if ((left & pending_) != 0) {
                flush();
                left = lanes_left(entry.parts, best_);
            }
            if (left == 0) continue;
            SurfaceNode* node = entry.node;
            if (entry.quarter >= 0) {
                const auto quarter = static_cast<unsigned>(entry.quarter);
                node = TileTracer::child(tiles_, levels(std::countr_zero(left)), *node, quarter);
                if (node == nullptr) {
                    add(left, *entry.node, entry.parts, 1, quarter);
                    continue;
                }
            }
            WalkParts here = entry.parts;
            split_walk(walk_, lines, rays_.reach, best_, walk_tile(*node), plane, here, split);
            if (split.here != 0) add(split.here, *node, here, 0, 0);
            for (std::uint32_t k = 4; k-- > 0;) { // the first one last, to be next
                const std::uint32_t quarter = first ^ k;
                if (split.lanes[quarter] != 0)
                    stack_[waiting++] = {node, static_cast<int>(quarter), split.quarter[quarter]};
            }
        }
        flush();
    }

    /// The deepest made tile below `node` that holds all that is left of the rays' parts, where all take
    /// finer ones than those above it; narrows the parts to its heights.
    [[nodiscard]] SurfaceNode* deepest_of_all(SurfaceNode* node, WalkParts& parts) const {
        // Nearer to the middle plane of a tile, rounding may put a ray on either side.
        constexpr double clear = 1e-12;
        double highest = tiles_.largest();
        for (;;) {
            const WalkBox box =
                narrow_walk(walk_, segments_.lines, best_, highest, node->least, plane, parts);
            if (!(box.u0 <= box.u1)) return node; // nothing is left
            const SurfaceNode* const before = node;
            for (;;) {
                const WalkTile tile = walk_tile(*node);
                const double near_m = tile.radius_m + tile.spacing_m * min_reach_;
                if (!tile.can_split || (tile.fixed_reach < 0 && tile.distance2_m2 >= near_m * near_m)) break;
                const bool right = box.u0 > tile.u_middle + clear, up = box.v0 > tile.v_middle + clear;
                if ((!right && box.u1 >= tile.u_middle - clear) || (!up && box.v1 >= tile.v_middle - clear))
                    break;
                const unsigned quarter = (right ? 1u : 0u) | (up ? 2u : 0u);
                SurfaceNode* const next = tiles_.made(*node, quarter);
                const DetailView* const view = rays_.view;
                if (next == nullptr || !(view == nullptr || view->wait || next->born <= view->version)) break;
                highest = node->child_highest[quarter];
                node = next;
            }
            if (node == before) return node;
        }
    }

    [[nodiscard]] WalkTile walk_tile(const SurfaceNode& node) const {
        const terrain::TileKey key = node.tile.key;
        const double half = tile_cells / 2.0;
        WalkTile tile{(static_cast<double>(key.i) * tile_cells + half) / node.half_cells - 1,
                      (static_cast<double>(key.j) * tile_cells + half) / node.half_cells - 1,
                      0,
                      node.radius_m,
                      node.spacing_m,
                      node.own_highest,
                      node.child_highest,
                      false,
                      -1};
        if (rays_.view == nullptr) {
            tile.fixed_reach = 0;
            tile.can_split = levels(std::countr_zero(begun_)).splits(node);
        } else {
            tile.distance2_m2 = length_squared(node.centre_m - rays_.view->eye_m);
            tile.can_split = key.level < terrain::deepest_level;
        }
        return tile;
    }

    void set_lines(std::size_t face) {
        WalkLines& lines = segments_.lines;
        if constexpr (plane) {
            lines.ua = walk_.near.x;
            lines.ub = walk_.direction.x;
            lines.va = walk_.near.y;
            lines.vb = walk_.direction.y;
            for (int i = 0; i < packet_size; ++i) {
                lines.wa[i] = 1;
                lines.wb[i] = 0;
            }
        } else {
            const terrain::CubeFace& f = terrain::cube_faces[face];
            const auto along = [](const Vec3s& p, int axis) -> const Doubles& {
                return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
            };
            lines.ua = along(walk_.near, f.u_axis);
            lines.ub = along(walk_.direction, f.u_axis);
            lines.va = along(walk_.near, f.v_axis);
            lines.vb = along(walk_.direction, f.v_axis);
            const Doubles &near = along(walk_.near, f.axis), &direction = along(walk_.direction, f.axis);
            for (int i = 0; i < packet_size; ++i) {
                lines.wa[i] = f.sign * near[i];
                lines.wb[i] = f.sign * direction[i];
            }
        }
    }

    /// The rays are to be traced in a tile, or in a quarter of it (`depth` 1).
    void add(std::uint32_t lanes, const SurfaceNode& node, const WalkParts& parts, int depth,
             unsigned quarter) {
        const terrain::SurfaceTile& tile = node.tile;
        const TileSource source{tile.offset_m,
                                node.half_cells,
                                static_cast<double>(tile.key.i) * tile_cells,
                                static_cast<double>(tile.key.j) * tile_cells,
                                node.own_highest,
                                node.own_least,
                                reinterpret_cast<std::int64_t>(tile.vertex(0, 0)),
                                reinterpret_cast<std::int64_t>(tile.maxima.data()),
                                reinterpret_cast<std::int64_t>(node.cones.rise.data()),
                                reinterpret_cast<std::int64_t>(&node)};
        // Lanes that are off read a tile all the same.
        enter_tile(lanes, !entered_, source, parts, best_, static_cast<double>(tile_cells >> depth),
                   quarter & 1u, quarter >> 1, segments_);
        entered_ = true;
        pending_ |= lanes;
    }

    /// Traces the rays that wait with a tile.
    void flush() {
        while (pending_ != 0) {
            const TileOutcome outcome = trace_tile_lanes(segments_, per_m_, plane, !any_);
            const std::uint32_t waited = pending_;
            pending_ = 0;
            for_lanes(outcome.met & waited, [&](int i) { finish(i); });
            for_lanes(outcome.grazing & waited, [&](int i) {
                if (meets(i))
                    finish(i);
                else
                    pending_ |= 1u << i;
            });
        }
    }

    /// Whether a grazing ray meets its cell, and where; it is to be traced on if not.
    [[nodiscard]] bool meets(int i) {
        const double x =
            clearance(i, [&](const auto& c) { return c.first_root(segments_.x[i], segments_.exit[i], 1); });
        if (x == no_hit) {
            segments_.state[i] = TileLanes::passed;
            return false;
        }
        segments_.x[i] = x;
        if (any_) return true;
        clearance(i, [&](const auto& c) {
            segments_.s[i] = std::clamp(c.s(x), 0.0, 1.0);
            segments_.r[i] = std::clamp(c.r(x), 0.0, 1.0);
            return 0;
        });
        return true;
    }

    /// Takes over where a ray meets its tile.
    void finish(int i) {
        segments_.state[i] = TileLanes::off;
        best_[i] = any_ ? -no_hit : segments_.x[i];
        found_.t[i] = segments_.x[i];
        if (any_) return;
        found_.s[i] = segments_.s[i];
        found_.r[i] = segments_.r[i];
        found_.node[static_cast<std::size_t>(i)] = &node_of(i);
        found_.cell[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(segments_.j[i]) * tile_cells +
                                                   static_cast<std::uint32_t>(segments_.i[i]);
    }

    [[nodiscard]] const SurfaceNode& node_of(int i) const {
        return *reinterpret_cast<const SurfaceNode*>(segments_.node[i]);
    }

    /// Calls `use` with the height of a ray above the patch of its cell.
    template<typename Use>
    auto clearance(int i, const Use& use) const {
        const SurfaceNode& node = node_of(i);
        const WalkLines& at = segments_.lines;
        const auto ci = static_cast<std::uint32_t>(segments_.i[i]),
                   cj = static_cast<std::uint32_t>(segments_.j[i]);
        const Patch patch = patch_of(node, ci, cj, per_m_);
        const FaceLines lines{{at.ua[i], at.ub[i]}, {at.va[i], at.vb[i]}, {at.wa[i], at.wb[i]}};
        const Ray one = ray(i);
        return use(Clearance<Ray>(one, patch, lines, node.half_cells, segments_.first_i[i] + ci,
                                  segments_.first_j[i] + cj));
    }

    /// From the walks' parameter to the rays' own.
    void report() {
        for_lanes(begun_, [&](int i) {
            const double t = found_.t[i] + walk_.along[i];
            found_.t[i] = (t > 0 || any_) && t < rays_.t_max[i] ? t : no_hit;
        });
    }

    const SurfaceTiles& tiles_;
    const ScaledRays& rays_;
    bool any_;
    TileCrossings& found_;
    double per_m_;
    std::uint32_t begun_ = 0, pending_ = 0;
    bool entered_ = false; ///< the lanes of `segments_` have a tile
    WalkRays walk_;
    Doubles best_;
    double min_reach_ = 0;
    TileLanes segments_;
    /// Each step down leaves at most three more.
    std::array<Entry, 3 * terrain::deepest_level + 8> stack_;
};

} // namespace

void first_crossings(const SurfaceTiles& tiles, const ScaledRays& rays, bool any, TileCrossings& found) {
    if (tiles.domain().is_plane())
        PacketTracer<PlaneRay>(tiles, rays, any, found).trace();
    else
        PacketTracer<SphereRay>(tiles, rays, any, found).trace();
}

} // namespace obscura::renderer
