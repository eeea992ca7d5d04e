// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/features.hpp"

#include "renderer/truth/sight.hpp"
#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::renderer {
namespace {

/// Bits of the place of a point along an edge of a face.
constexpr int place_bits = 24;

/// Larger in the picture, and by kind and identity where that is equal: the same order on any machine.
bool larger(const FeatureInView& a, const FeatureInView& b) {
    if (a.size_px != b.size_px) return a.size_px > b.size_px;
    if (a.layer != b.layer) return a.layer < b.layer;
    return a.feature.id < b.feature.id;
}

double angle_between(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
}

} // namespace

FeatureFinder::FeatureFinder(const TruthScene& scene, RowStates& states, std::size_t body)
    : scene_(scene),
      states_(states),
      body_(body),
      tiles_(*scene.bodies[body].shape->tiles()),
      limits_(tiles_.listed()),
      kept_(&states.memory()) {
    const std::uint32_t middle = states.instants() / 2;
    std::int32_t last = 0;
    for (const FrameWindow& window : states.windows())
        last = std::max(last, window.image_y + window.sensor.height - 1);
    rows_ = {&states.at(0, middle), &states.at(last / 2, middle), &states.at(last, middle)};
    const auto eye_of = [&](const TruthState& s) { return to_local(s.bodies[body], s.camera.position_m); };
    const auto boresight_of = [&](const TruthState& s) {
        return rotate(conjugate(s.bodies[body].orientation),
                      transposed(s.camera_from_inertial) * Vec3{0, 0, 1});
    };
    eye_m_ = eye_of(*rows_[1]);
    boresight_ = boresight_of(*rows_[1]);
    field_rad_ = scene.field_rad;
    for (const TruthState* const row : rows_) {
        moved_m_ = std::max(moved_m_, length(eye_of(*row) - eye_m_));
        field_rad_ = std::max(field_rad_, scene.field_rad + angle_between(boresight_of(*row), boresight_) +
                                              2 * length(row->beta));
    }
}

std::span<const FeatureInView> FeatureFinder::find() {
    if (limits_.most == 0) return {};
    kept_.reserve(limits_.most + 1);
    const auto& layers = tiles_.maker().layers();
    for (layer_ = 0; layer_ < layers.size(); ++layer_)
        layers[layer_]->find_features(*this);
    std::erase_if(kept_, [&](const FeatureInView& found) {
        double spacing_m = std::numeric_limits<double>::infinity();
        for (std::size_t below = 0; below < found.layer; ++below)
            if (const double own = layers[below]->sample_spacing_m(found.feature.position_m); own > 0)
                spacing_m = std::min(spacing_m, own);
        return layers[found.layer]->share_left(found.feature, spacing_m) < least_share;
    });
    std::sort(kept_.begin(), kept_.end(), larger);
    return kept_;
}

FeatureFinder::Heights FeatureFinder::heights_of(std::uint8_t face, std::uint32_t u, std::uint32_t v,
                                                 int levels) const {
    const SurfaceNode* node = tiles_.root(face);
    double largest = tiles_.largest();
    for (int level = 1; level <= std::min(levels, terrain::deepest_level); ++level) {
        const unsigned quarter = (u >> (place_bits - level) & 1) | (v >> (place_bits - level) & 1) << 1;
        largest = node->child_highest[quarter];
        const SurfaceNode* const child = node->child[quarter].load(std::memory_order_acquire);
        if (child == nullptr) break;
        node = child;
    }
    return {node->least, largest};
}

double FeatureFinder::least_px() const {
    return kept_.size() < limits_.most ? limits_.least_px : std::max(limits_.least_px, kept_.front().size_px);
}

bool FeatureFinder::in_view(const terrain::Cap& cap, Heights heights, double largest_m) const {
    const terrain::SurfaceDomain& domain = tiles_.domain();
    // A ball about all of the surface above the cap.
    const double middle = (heights.least + heights.largest) / 2;
    const double half_m = (heights.largest - heights.least) / 2 * domain.unit_m();
    Vec3 centre = cap.centre_m;
    double radius_m = cap.radius_m + half_m;
    if (domain.is_plane()) {
        centre.z += middle * domain.unit_m();
    } else {
        centre = centre * (1 + middle);
        radius_m = cap.radius_m * (1 + std::max(0.0, heights.largest)) + half_m;
    }
    const Vec3 to_ball = centre - eye_m_;
    const double distance_m = length(to_ball), slack_m = radius_m + moved_m_;
    if (largest_m < least_px() * scene_.lens.pixel_angle_rad() * (distance_m - slack_m)) return false;
    if (distance_m <= slack_m) return true;
    if (angle_between(to_ball, boresight_) > field_rad_ + std::asin(slack_m / distance_m)) return false;
    if (domain.is_plane()) return true;
    // Beyond the tangent from the eye to the least sphere, in scaled space, raised by what is highest here.
    const Vec3 radii = domain.radii_m();
    const auto scaled = [&](Vec3 p) { return Vec3{p.x / radii.x, p.y / radii.y, p.z / radii.z}; };
    const Vec3 eye = scaled(eye_m_), place = scaled(cap.centre_m);
    const double low = 1 + tiles_.least(), high = 1 + heights.largest;
    const double horizon = std::acos(std::min(1.0, low / length(eye))) + std::acos(std::min(1.0, low / high));
    const double least_radius = std::min({radii.x, radii.y, radii.z});
    return angle_between(eye, place) < horizon + 1.1 * (cap.radius_m + moved_m_) / least_radius;
}

bool FeatureFinder::wants(terrain::TileKey square, double largest_m) {
    const int up = place_bits - square.level;
    return in_view(cap_of(tiles_.domain(), square),
                   heights_of(square.face, square.i << up, square.j << up, square.level), largest_m);
}

bool FeatureFinder::wants(Vec3 position_m, double diameter_m) {
    const terrain::SurfaceDomain& domain = tiles_.domain();
    std::uint8_t face = 0;
    double u = position_m.x / domain.unit_m(), v = position_m.y / domain.unit_m();
    if (!domain.is_plane()) {
        const Vec3 radii = domain.radii_m();
        const Vec3 p{position_m.x / radii.x, position_m.y / radii.y, position_m.z / radii.z};
        face = static_cast<std::uint8_t>(terrain::cube_face_of(p));
        const terrain::CubeFace& side = terrain::cube_faces[face];
        const double w = side.sign * terrain::component(p, side.axis);
        u = terrain::component(p, side.u_axis) / w;
        v = terrain::component(p, side.v_axis) / w;
    }
    const auto place = [](double x) {
        const double cells = std::ldexp(1.0, place_bits);
        return static_cast<std::uint32_t>(std::clamp((x + 1) / 2 * cells, 0.0, cells - 1));
    };
    return in_view({position_m, 1e-9 * domain.unit_m()}, heights_of(face, place(u), place(v), place_bits),
                   diameter_m);
}

bool FeatureFinder::on_pixels(Vec3 point_m) {
    // The box of where it is while the rows are exposed.
    double left = std::numeric_limits<double>::infinity(), top = left, right = -left, bottom = -left;
    for (const TruthState* const row : rows_) {
        ImagePoint shift;
        const auto at = states_.project(*row, towards_point(*row, body_, point_m), shift);
        if (!at) continue;
        left = std::min(left, at->x), right = std::max(right, at->x);
        top = std::min(top, at->y), bottom = std::max(bottom, at->y);
    }
    if (!(left <= right)) return false;
    // It may bend while it moves.
    const double margin = 0.5 + (rows_[0] == rows_[2] ? 0 : 1 + (right - left) + (bottom - top));
    return std::any_of(states_.windows().begin(), states_.windows().end(), [&](const FrameWindow& window) {
        const Region& r = window.sensor;
        return right >= r.x - margin && left < r.x + r.width - 1 + margin && bottom >= r.y - margin &&
               top < r.y + r.height - 1 + margin;
    });
}

void FeatureFinder::add(const terrain::SurfaceFeature& feature) {
    const std::optional<Vec3> point = surface_point(scene_, *rows_[1], body_, feature.position_m);
    if (!point) return;
    FeatureInView found{feature, layer_, *point, 0};
    found.size_px = feature.diameter_m / (length(*point - eye_m_) * scene_.lens.pixel_angle_rad());
    if (!(found.size_px >= limits_.least_px) || !on_pixels(*point)) return;
    if (kept_.size() == limits_.most) {
        if (!larger(found, kept_.front())) return;
        std::pop_heap(kept_.begin(), kept_.end(), larger);
        kept_.pop_back();
    }
    kept_.push_back(found);
    std::push_heap(kept_.begin(), kept_.end(), larger);
}

} // namespace obscura::renderer
