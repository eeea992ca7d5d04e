// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/packet_tracer.hpp"

#include "renderer/planets/tile_packets.hpp"
#include "renderer/planets/tile_rays.hpp"

#include <algorithm>

namespace obscura::renderer {
namespace {

using namespace tile_rays;

/// One lane on its way through faces and tiles.
template<typename Ray>
struct Lane {
    Ray ray;
    double along = 0; ///< t where the ray's parameter is 0
    FaceCuts cuts;
    std::size_t next_cut = 0;
    FaceLines lines;
    TileWalk<Ray> walk;
    SurfaceNode* tile = nullptr;
};

template<typename Ray>
class PacketTracer {
public:
    static constexpr bool plane = std::is_same_v<Ray, PlaneRay>;

    PacketTracer(const SurfaceTiles& tiles, const ScaledRays& rays, bool any,
                 std::array<TileCrossing, packet_size>& found)
        : tiles_(tiles), rays_(rays), any_(any), found_(found), per_m_(1 / tiles.domain().unit_m()) {}

    void trace() {
        bool more = false;
        for (int i = 0; i < packet_size; ++i) {
            // Lanes that are off read a tile all the same.
            point_to(i, *tiles_.root(0));
            segments_.state[i] = TileLanes::off;
            if (rays_.active.on[i] == 0 || !begin(i)) continue;
            more = next_tile(i) || more;
        }
        while (more) {
            trace_tile_lanes(segments_, per_m_, plane);
            more = false;
            for (int i = 0; i < packet_size; ++i)
                if (walking_.on[i] != 0) more = go_on(i) || more;
        }
    }

private:
    /// Sets up a ray; false: it meets nothing, or has met something already.
    bool begin(int i) {
        Lane<Ray>& lane = lanes_[static_cast<std::size_t>(i)];
        const Vec3 origin = rays_.origin.lane(i), direction = rays_.direction.lane(i);
        double from = 0, to = 0;
        const auto scalar = [&] {
            found_[static_cast<std::size_t>(i)] =
                TileTracer(tiles_, levels(i)).first_crossing(origin, direction, rays_.t_max[i]);
            return false;
        };
        if constexpr (plane) {
            double begin = 0, end = rays_.t_max[i];
            if (!PlaneRay::clip_to_box(origin, direction, tiles_.least(), tiles_.largest(), begin, end))
                return false;
            if (!any_ && begin == 0) return scalar(); // it may begin below the surface
            lane.ray = {origin + begin * direction, direction};
            lane.along = begin;
            to = end - begin;
            lane.cuts.count = 1;
            lane.cuts.at[0] = 0;
            lane.cuts.at[1] = to;
        } else {
            lane.ray = {{}, direction, 0, length_squared(direction)};
            lane.along = -dot(origin, direction) / lane.ray.speed2;
            lane.ray.closest = origin + lane.along * direction;
            lane.ray.miss2 = length_squared(lane.ray.closest);
            const double outer = lane.ray.half_chord(1 + tiles_.largest() + margin),
                         inner = lane.ray.half_chord(1 + tiles_.least() - margin);
            from = std::max(-outer, -lane.along);
            to = std::min(outer, rays_.t_max[i] - lane.along);
            if (!(from < to)) return false;
            if (std::abs(from) < inner || (!any_ && from > -outer)) {
                if (std::abs(from) < inner) return scalar();
                const LevelChoice choice = levels(i);
                if (lane.ray.height(from).value < TileTracer(tiles_, choice).below(lane.ray.at(from)).t)
                    return scalar();
            }
            // Nothing is met within the inner sphere, and what begins outside has met something before it.
            if (inner > 0 && from < inner) to = std::min(to, -inner);
            if (!(from < to)) return false;
            lane.cuts = FaceCuts(lane.ray, from, to);
        }
        lane.next_cut = 0;
        walking_.on[i] = -1;
        segments_.miss2[i] = ray_constant(lane.ray);
        segments_.speed2[i] = ray_slope(lane.ray);
        return true;
    }

    static double ray_constant(const SphereRay& ray) { return ray.miss2; }
    static double ray_slope(const SphereRay& ray) { return ray.speed2; }
    static double ray_constant(const PlaneRay& ray) { return ray.begin.z; }
    static double ray_slope(const PlaneRay& ray) { return ray.direction.z; }

    [[nodiscard]] const LevelChoice& levels(int i) const { return rays_.levels[static_cast<std::size_t>(i)]; }

    void point_to(int i, const SurfaceNode& node) {
        const terrain::SurfaceTile& tile = node.tile;
        segments_.offset_m[i] = tile.offset_m;
        segments_.half_cells[i] = node.half_cells;
        segments_.first_i[i] = static_cast<double>(tile.key.i) * tile_cells;
        segments_.first_j[i] = static_cast<double>(tile.key.j) * tile_cells;
        segments_.vertices[i] = reinterpret_cast<std::int64_t>(tile.vertex(0, 0));
        segments_.maxima[i] = reinterpret_cast<std::int64_t>(tile.maxima.data());
    }

    /// Takes the ray to the next tile that it may meet; false: there is none.
    bool next_tile(int i) {
        Lane<Ray>& lane = lanes_[static_cast<std::size_t>(i)];
        const LevelChoice& choice = levels(i);
        const auto child_of = [&](SurfaceNode& node, unsigned quarter) {
            return TileTracer::child(tiles_, choice, node, quarter);
        };
        for (;;) {
            Part part;
            if (lane.next_cut > 0 &&
                lane.walk.next(lane.ray, lane.lines, false, per_m_, choice, child_of, part)) {
                if (lane.tile != part.tile) point_to(i, *part.tile);
                lane.tile = part.tile;
                segments_.x[i] = part.from;
                segments_.to[i] = part.to;
                segments_.width[i] = segments_.most_width[i] = static_cast<double>(1u << part.level);
                segments_.i[i] = part.i;
                segments_.j[i] = part.j;
                segments_.state[i] = TileLanes::running;
                return true;
            }
            if (lane.next_cut == lane.cuts.count) {
                walking_.on[i] = 0;
                return false;
            }
            const double from = lane.cuts.at[lane.next_cut], to = lane.cuts.at[lane.next_cut + 1];
            ++lane.next_cut;
            const std::size_t face = plane ? 0 : terrain::cube_face_of(lane.ray.at((from + to) / 2));
            lane.lines = lane.ray.lines(face);
            segments_.ua[i] = lane.lines.u.a;
            segments_.ub[i] = lane.lines.u.b;
            segments_.va[i] = lane.lines.v.a;
            segments_.vb[i] = lane.lines.v.b;
            segments_.wa[i] = lane.lines.w.a;
            segments_.wb[i] = lane.lines.w.b;
            lane.walk.start(lane.ray, lane.lines, tiles_.root(face), from, to, false, choice, child_of);
        }
    }

    /// After a trace of the tile; false: the lane is done.
    bool go_on(int i) {
        const std::int64_t state = segments_.state[i];
        if (state == TileLanes::off) return next_tile(i);
        Lane<Ray>& lane = lanes_[static_cast<std::size_t>(i)];
        const SurfaceNode& node = *lane.tile;
        const auto ci = static_cast<std::uint32_t>(segments_.i[i]),
                   cj = static_cast<std::uint32_t>(segments_.j[i]);
        const Patch patch = patch_of(node, ci, cj, per_m_);
        const Clearance<Ray> clearance(lane.ray, patch, lane.lines, node.half_cells,
                                       segments_.first_i[i] + ci, segments_.first_j[i] + cj);
        double x = segments_.x[i];
        if (state == TileLanes::grazing) {
            x = clearance.first_root(x, segments_.exit[i], 1);
            if (x == no_hit) {
                segments_.state[i] = TileLanes::passed;
                return true;
            }
        }
        walking_.on[i] = 0;
        segments_.state[i] = TileLanes::off;
        const double t = x + lane.along;
        if ((t > 0 || any_) && t < rays_.t_max[i])
            found_[static_cast<std::size_t>(i)] = {t, &node, cj * tile_cells + ci,
                                                   std::clamp(clearance.s(x), 0.0, 1.0),
                                                   std::clamp(clearance.r(x), 0.0, 1.0)};
        return false;
    }

    const SurfaceTiles& tiles_;
    const ScaledRays& rays_;
    bool any_;
    std::array<TileCrossing, packet_size>& found_;
    double per_m_;
    Lanes walking_{};
    TileLanes segments_;
    std::array<Lane<Ray>, packet_size> lanes_;
};

} // namespace

void first_crossings(const SurfaceTiles& tiles, const ScaledRays& rays, bool any,
                     std::array<TileCrossing, packet_size>& found) {
    if (tiles.domain().is_plane())
        PacketTracer<PlaneRay>(tiles, rays, any, found).trace();
    else
        PacketTracer<SphereRay>(tiles, rays, any, found).trace();
}

} // namespace obscura::renderer
