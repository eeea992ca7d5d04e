// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/limb_span.hpp"

#include "renderer/planets/surface_tiles.hpp"
#include "renderer/truth/field_cone.hpp"

#include <numbers>
#include <vector>

namespace obscura::renderer {
namespace {

constexpr double whole_turn = 2 * std::numbers::pi;
/// First parts of the turn, then of each of those that may be in the field: to 4e-4 rad.
constexpr int first_parts = 64, parts_of_part = 16, span_divisions = 2;
/// Larger gaps are left out.
constexpr double min_gap_rad = whole_turn / 8;

struct Part {
    double from_rad, width_rad;
};

/// What of a limb may be in the field, in the order of the azimuth.
class Search {
public:
    Search(const TruthScene& scene, RowStates& states, std::size_t body)
        : scene_(scene),
          body_(body),
          middle_(states.middle_of(0)),
          cone_(scene, states, body),
          rough_(scene.bodies[body].shape->tiles() != nullptr) {}

    [[nodiscard]] bool may_show(const Part& part) const {
        const auto from = point(part.from_rad), to = point(part.from_rad + part.width_rad);
        if (!from || !to) return false;
        // A ball about the chord of a short arc, with reserve, and about the ground.
        double radius_m = 0.6 * length(*to - *from);
        if (rough_) radius_m += scene_.bodies[body_].shape->bounding_radius_m() - length(*from);
        return cone_.may_show((*from + *to) / 2, radius_m);
    }
    [[nodiscard]] std::optional<Vec3> point(double azimuth_rad) const {
        return BodyCurve::about_m(scene_, body_, middle_, azimuth_rad);
    }

private:
    const TruthScene& scene_;
    std::size_t body_;
    const TruthState& middle_;
    FieldCone cone_;
    bool rough_;
};

std::vector<Part> divided(const Search& search, const std::vector<Part>& parts, int count) {
    std::vector<Part> kept;
    for (const Part& part : parts)
        for (int i = 0; i < count; ++i) {
            const double width = part.width_rad / count;
            const Part piece{part.from_rad + i * width, width};
            if (search.may_show(piece)) kept.push_back(piece);
        }
    return kept;
}

} // namespace

std::optional<CurveSpan> limb_span(const TruthScene& scene, RowStates& states, std::size_t body,
                                   std::uint32_t points) {
    CurveSpan whole = CurveSpan::turn(points - 1);
    whole.points = points;
    const Search search(scene, states, body);
    if (!search.point(0)) return whole;
    std::vector<Part> parts = divided(search, {{0, whole_turn}}, first_parts);
    if (parts.size() == first_parts) return whole;
    for (int i = 0; i < span_divisions; ++i)
        parts = divided(search, parts, parts_of_part);
    if (parts.empty()) return std::nullopt;
    // Leave out the largest gap, which may lie across the begin of the turn.
    double gap_rad = 0, from_rad = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const bool last = i + 1 == parts.size();
        const double next_rad = last ? parts.front().from_rad + whole_turn : parts[i + 1].from_rad;
        const double gap = next_rad - parts[i].from_rad - parts[i].width_rad;
        if (gap > gap_rad) gap_rad = gap, from_rad = next_rad;
    }
    if (gap_rad < min_gap_rad) return whole;
    return CurveSpan::part(from_rad, whole_turn - gap_rad, points);
}

} // namespace obscura::renderer
