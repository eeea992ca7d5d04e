// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/rocks.hpp"

#include "terrain/feature_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::renderer {
namespace {

/// HitPacket::primitive has 16 bits for them.
constexpr std::size_t max_rocks = 65536;
/// Samples that are finer than a boulder have the real one: there domes fade out, and rocks become flatter as
/// they do, down to this share of their height.
constexpr double min_rock_share = 1e-3;

struct Ball {
    Vec3 centre_m;
    double radius_m;
};

/// The part of each ray that is in the ball and before its limit, in `from` and `to`; lanes without one go
/// off.
OBSCURA_VECTOR_CLONES
void enter_ball(const RayPacket& rays, const Doubles& limit, const Ball& ball, Doubles& from, Doubles& to,
                Lanes& on) {
    const double cx = ball.centre_m.x, cy = ball.centre_m.y, cz = ball.centre_m.z;
    const double radius2 = ball.radius_m * ball.radius_m;
    for (int i = 0; i < packet_size; ++i) {
        const double dx = rays.direction.x.v[i], dy = rays.direction.y.v[i], dz = rays.direction.z.v[i];
        const double ox = rays.origin.x.v[i] - cx, oy = rays.origin.y.v[i] - cy, oz = rays.origin.z.v[i] - cz;
        const double along = -(ox * dx + oy * dy + oz * dz);
        const double lx = ox + along * dx, ly = oy + along * dy, lz = oz + along * dz;
        const double room = radius2 - (lx * lx + ly * ly + lz * lz);
        const double half = std::sqrt(room > 0 ? room : 0.0);
        const double begin = along - half, end = along + half;
        from.v[i] = begin > 0 ? begin : 0.0;
        to.v[i] = end < limit.v[i] ? end : limit.v[i];
        on.on[i] = ((room > 0) & (from.v[i] < to.v[i])) ? on.on[i] : 0;
    }
}

/// Switches off rays that are above a unit height all the way.
OBSCURA_VECTOR_CLONES
void stay_above(const ScaledRays& rays, const Doubles& from, const Doubles& to, double height, Lanes& on) {
    const double top2 = (1 + height) * (1 + height);
    for (int i = 0; i < packet_size; ++i) {
        const double dx = rays.direction.x.v[i], dy = rays.direction.y.v[i], dz = rays.direction.z.v[i];
        const double ox = rays.origin.x.v[i], oy = rays.origin.y.v[i], oz = rays.origin.z.v[i];
        const double lowest = -(ox * dx + oy * dy + oz * dz) / (dx * dx + dy * dy + dz * dz);
        const double after = lowest > from.v[i] ? lowest : from.v[i];
        const double at = after < to.v[i] ? after : to.v[i];
        const double x = ox + at * dx, y = oy + at * dy, z = oz + at * dz;
        on.on[i] = x * x + y * y + z * z < top2 ? on.on[i] : 0;
    }
}

OBSCURA_VECTOR_CLONES
void stay_above_plane(const ScaledRays& rays, const Doubles& from, const Doubles& to, double height,
                      Lanes& on) {
    for (int i = 0; i < packet_size; ++i) {
        const double dz = rays.direction.z.v[i];
        const double z = rays.origin.z.v[i] + (dz < 0 ? to.v[i] : from.v[i]) * dz;
        on.on[i] = z < height ? on.on[i] : 0;
    }
}

/// Rays in the frame of a rock's form, whose directions are unit vectors again: `scale` is what distances are
/// multiplied by.
void to_form(const Rock& rock, const RayPacket& rays, const Doubles& limit, const Lanes& on, RayPacket& out,
             Doubles& scale) {
    out.active = on;
    out.coherent = rays.coherent;
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 way = rays.origin.lane(i) - rock.centre_m, d = rays.direction.lane(i);
        const auto& a = rock.axes_per_m;
        const Vec3 direction{dot(a[0], d), dot(a[1], d), dot(a[2], d)};
        scale[i] = length(direction);
        out.origin.set(i, {dot(a[0], way), dot(a[1], way), dot(a[2], way)});
        out.direction.set(i, direction / scale[i]);
        out.t_max[i] = limit[i] * scale[i];
        out.level_u[i] = 0;
    }
}

/// Level from which tiles have rocks of a size.
int rock_level(const terrain::SurfaceDomain& domain, double size_m, double cells) {
    int level = 0;
    while (level <= terrain::deepest_level && cells * domain.spacing_m(level) > size_m)
        ++level;
    return level;
}

} // namespace

std::vector<Rock> place_rocks(const terrain::TileMaker& maker, const terrain::SurfaceTile& tile,
                              std::span<const double> sample_spacings_m) {
    const terrain::SurfaceDomain& domain = maker.domain();
    const terrain::TileKey key = tile.key;
    std::vector<Rock> rocks;
    std::vector<terrain::StandingRock> standing;
    for (const auto& made : maker.layers()) {
        const terrain::HeightLayer& layer = *made;
        standing.clear();
        layer.add_rocks(key, standing);
        // The ground at a vertex as tiles of rocks alone have it.
        const auto ground_m = [&](std::int32_t i, std::int32_t j) {
            const Vec3 vertex =
                domain.point(key.face, terrain::SurfaceDomain::coordinate(key.level, key.i, i),
                             terrain::SurfaceDomain::coordinate(key.level, key.j, j));
            const double reduction = domain.is_plane() ? 1 : domain.unit_m() / length(vertex);
            return tile.height_m(i, j) -
                   reduction * layer.above_ground_m(vertex, domain.spacing_m(key.level));
        };
        const auto cells_at = [&](double coordinate, std::uint32_t index) {
            const double cells = (coordinate + 1) / 2 * std::ldexp(double{terrain::tile_cells}, key.level) -
                                 double{terrain::tile_cells} * index;
            return std::clamp(cells, 0.0, terrain::tile_cells - 1e-6);
        };
        for (const terrain::StandingRock& one : standing) {
            if (rocks.size() == max_rocks) break;
            const terrain::SurfaceDomain::Place place = domain.place_of(one.position_m);
            const double x = cells_at(place.u, key.i), y = cells_at(place.v, key.j);
            const auto i = static_cast<std::int32_t>(x), j = static_cast<std::int32_t>(y);
            const double s = x - i, r = y - j;
            const auto between = [&](const auto& at) {
                return (1 - r) * ((1 - s) * at(i, j) + s * at(i + 1, j)) +
                       r * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
            };
            const double share = between([&](std::int32_t column, std::int32_t row) {
                const double spacing_m =
                    sample_spacings_m[static_cast<std::size_t>(row + terrain::tile_margin) *
                                          terrain::tile_edge +
                                      static_cast<std::size_t>(column + terrain::tile_margin)];
                return layer.share_left(
                    {terrain::FeatureKind::boulder, one.id, one.position_m, 2 * one.semi_axes_m.x},
                    spacing_m);
            });
            if (share < min_rock_share) continue;
            const double ground = between(ground_m), top = share * one.height_m;
            const Vec3 half{one.semi_axes_m.x, one.semi_axes_m.y, share * one.semi_axes_m.z};
            const Vec3 up = cross(one.along, one.across);
            const Vec3 foot = domain.is_plane() ? one.position_m + ground * up
                                                : one.position_m * (1 + ground / domain.unit_m());
            rocks.push_back({foot + (top - half.z) * up,
                             std::sqrt(3.0) * std::max({half.x, half.y, half.z}),
                             {one.along / half.x, one.across / half.y, up / half.z},
                             one.form});
        }
    }
    return rocks;
}

/// Walk of a packet down the tiles that may have rocks in its way.
class RockTracer::Walk {
public:
    Walk(const RockTracer& tracer, const RayPacket& rays, const ScaledRays& scaled, const Doubles& limit)
        : tracer_(tracer),
          tiles_(tracer.tiles_),
          domain_(tiles_.domain()),
          rays_(rays),
          scaled_(scaled),
          limit_(limit) {}

    /// Calls `test(node, number, lanes)` for the rocks whose balls rays meet before their limits.
    template<typename Test>
    void go(const Lanes& lanes, const Test& test) {
        const DetailView* const view = scaled_.view;
        if (tracer_.first_level_ > terrain::deepest_level) return;
        if (view == nullptr) {
            if (scaled_.fixed_level < tracer_.first_level_) return;
        } else {
            // Tiles that split into the first ones with rocks, and all of those, are as near to the eye.
            const double spacing_m = 2 * domain_.spacing_m(tracer_.first_level_);
            reach_m_ = spacing_m * (2 / view->cell_rad + 2 * terrain::tile_cells);
            const double up_m = domain_.is_plane() ? view->eye_m.z : length(view->eye_m);
            if (up_m > domain_.unit_m() * (domain_.is_plane() ? 0 : 1) + reach_m_) return;
        }
        for (std::size_t face = 0; face < domain_.faces(); ++face)
            visit(*tiles_.root(face), lanes, test);
    }

private:
    template<typename Test>
    void visit(SurfaceNode& node, const Lanes& lanes, const Test& test) {
        const int level = node.tile.key.level;
        Doubles from, to;
        for (std::size_t number = 0; number < node.rocks.size(); ++number) {
            const Rock& rock = node.rocks[number];
            Lanes on = lanes;
            enter_ball(rays_, limit_, {rock.centre_m, rock.radius_m}, from, to, on);
            if (on.any()) test(node, number, on);
        }
        if (level >= tracer_.last_level_) return;
        Lanes finer = lanes;
        const DetailView* const view = scaled_.view;
        if (view == nullptr) {
            if (!scaled_.levels(0).splits(node)) return;
        } else {
            // LevelChoice::splits().
            const double square_m2 = length_squared(node.centre_m - view->eye_m);
            for (int i = 0; i < packet_size; ++i) {
                const double near_m = node.radius_m + node.spacing_m * scaled_.reach.v[i];
                finer.on[i] = square_m2 < near_m * near_m ? finer.on[i] : 0;
            }
        }
        if (!finer.any()) return;
        for (unsigned quarter = 0; quarter < 4; ++quarter) {
            Lanes on = finer;
            if (!look_at(node, quarter, on)) continue;
            SurfaceNode* const next = view == nullptr
                                          ? tiles_.child(node, quarter, true, 0)
                                          : tiles_.child(node, quarter, view->wait, view->version);
            if (next != nullptr) visit(*next, on, test);
        }
    }

    /// Leaves on the rays that may meet rocks of a child or of those below it.
    [[nodiscard]] bool look_at(const SurfaceNode& node, unsigned quarter, Lanes& on) const {
        const terrain::Cap& cap = node.child_cap[quarter];
        if (scaled_.view != nullptr && length(cap.centre_m - scaled_.view->eye_m) > cap.radius_m + reach_m_)
            return false;
        // A ball about all of its surface, and rocks that lean over its edge.
        const double high = node.child_highest[quarter], low = std::min(node.least, high);
        const double unit_m = domain_.unit_m(), half_m = (high - low) / 2 * unit_m;
        const double size_m = std::min(tracer_.settings_.largest_m, tracer_.settings_.cells * node.spacing_m);
        Ball ball{cap.centre_m, cap.radius_m + half_m + size_m};
        if (domain_.is_plane())
            ball.centre_m.z += (high + low) / 2 * unit_m;
        else
            ball = {cap.centre_m * (1 + (high + low) / 2),
                    cap.radius_m * (1 + std::max(0.0, high)) + half_m + size_m};
        Doubles from, to;
        enter_ball(rays_, limit_, ball, from, to, on);
        if (!on.any()) return false;
        if (domain_.is_plane())
            stay_above_plane(scaled_, from, to, high, on);
        else
            stay_above(scaled_, from, to, high, on);
        return on.any();
    }

    const RockTracer& tracer_;
    const SurfaceTiles& tiles_;
    const terrain::SurfaceDomain& domain_;
    const RayPacket& rays_;
    const ScaledRays& scaled_;
    const Doubles& limit_;
    double reach_m_ = 0; ///< distance from the eye within which there may be rocks
};

RockTracer::RockTracer(const SurfaceTiles& tiles, RockSettings settings)
    : tiles_(tiles),
      settings_(std::move(settings)),
      first_level_(rock_level(tiles.domain(), settings_.largest_m, settings_.cells)),
      last_level_(
          std::min(rock_level(tiles.domain(), settings_.min_m, settings_.cells), terrain::deepest_level)) {}

void RockTracer::intersect(const RayPacket& rays, const ScaledRays& scaled, std::int32_t body,
                           HitPacket& hits) const {
    Doubles limit;
    for (int i = 0; i < packet_size; ++i)
        limit[i] = std::min(rays.t_max[i], hits.t[i]);
    Walk walk(*this, rays, scaled, limit);
    walk.go(scaled.active, [&](const SurfaceNode& node, std::size_t number, const Lanes& on) {
        const Rock& rock = node.rocks[number];
        RayPacket own;
        Doubles scale;
        HitPacket found;
        found.clear();
        to_form(rock, rays, limit, on, own, scale);
        settings_.forms[rock.form % settings_.forms.size()]->intersect(own, 0, found);
        for (int i = 0; i < packet_size; ++i) {
            if (found.body[i] != 0 || on.on[i] == 0) continue;
            const double t = found.t[i] / scale[i];
            if (!(t < limit[i])) continue;
            limit[i] = hits.t[i] = t;
            hits.body[i] = body;
            hits.primitive[i] = node.slot << 16 | static_cast<std::uint32_t>(number);
            hits.u[i] = rock_place;
            hits.v[i] = 0;
        }
    });
}

void RockTracer::occlude(RayPacket& rays, const ScaledRays& scaled) const {
    Doubles limit = rays.t_max;
    const Lanes active = rays.active;
    Walk walk(*this, rays, scaled, limit);
    walk.go(active, [&](const SurfaceNode& node, std::size_t number, const Lanes& on) {
        const Rock& rock = node.rocks[number];
        RayPacket own;
        Doubles scale;
        to_form(rock, rays, limit, on, own, scale);
        settings_.forms[rock.form % settings_.forms.size()]->occlude(own);
        for (int i = 0; i < packet_size; ++i) {
            if (on.on[i] == 0 || own.active.on[i] != 0) continue;
            rays.active.on[i] = 0;
            limit[i] = 0; // nothing else needs to be looked at
        }
    });
}

void RockTracer::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                         SurfacePacket& out) const {
    Lanes left;
    for (int i = 0; i < packet_size; ++i)
        left.on[i] = hits.body[i] == body && is_hit(hits, i) ? -1 : 0;
    for (int first = 0; first < packet_size; ++first) {
        if (left.on[first] == 0) continue;
        const std::uint32_t primitive = hits.primitive[first];
        Lanes on;
        for (int i = 0; i < packet_size; ++i) {
            on.on[i] = left.on[i] != 0 && hits.primitive[i] == primitive ? -1 : 0;
            if (on.on[i] != 0) left.on[i] = 0;
        }
        // The hit has no room for the facet: find it again.
        const Rock& rock = tiles_.in_slot(primitive >> 16).rocks[primitive & 0xffffu];
        const Shape& form = *settings_.forms[rock.form % settings_.forms.size()];
        RayPacket own;
        Doubles scale, limit;
        std::fill_n(limit.v, packet_size, no_hit);
        HitPacket found;
        found.clear();
        to_form(rock, rays, limit, on, own, scale);
        form.intersect(own, 0, found);
        SurfacePacket of_form;
        form.surface(own, found, 0, of_form);
        const auto& a = rock.axes_per_m;
        const auto point = [&](Vec3 p) {
            return rock.centre_m + (p.x / length_squared(a[0])) * a[0] + (p.y / length_squared(a[1])) * a[1] +
                   (p.z / length_squared(a[2])) * a[2];
        };
        const auto normal = [&](Vec3 n) { return normalized(n.x * a[0] + n.y * a[1] + n.z * a[2]); };
        for (int i = 0; i < packet_size; ++i) {
            if (on.on[i] == 0) continue;
            if (found.body[i] != 0) { // grazes an edge: the other lanes' part in a packet decides
                const Vec3 at = rays.origin.lane(i) + hits.t[i] * rays.direction.lane(i);
                out.position.set(i, at);
                out.shadow_origin.set(i, at - 1e-6 * rock.radius_m * rays.direction.lane(i));
                out.normal.set(i, -rays.direction.lane(i));
                out.facet_normal.set(i, -rays.direction.lane(i));
                out.outside.on[i] = -1;
                continue;
            }
            out.position.set(i, point(of_form.position.lane(i)));
            out.shadow_origin.set(i, point(of_form.shadow_origin.lane(i)));
            out.normal.set(i, normal(of_form.normal.lane(i)));
            out.facet_normal.set(i, normal(of_form.facet_normal.lane(i)));
            out.outside.on[i] = of_form.outside.on[i];
        }
    }
}

} // namespace obscura::renderer
