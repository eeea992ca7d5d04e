// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/features.hpp"

#include "renderer/truth/sight.hpp"

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

} // namespace

FeatureFinder::FeatureFinder(const TruthScene& scene, RowStates& states, std::size_t body)
    : scene_(scene),
      states_(states),
      body_(body),
      tiles_(*scene.bodies[body].shape->tiles()),
      limits_(tiles_.listed()),
      cone_(scene, states, body),
      kept_(&states.memory()) {}

std::span<const FeatureInView> FeatureFinder::find() {
    if (limits_.most == 0) return {};
    kept_.reserve(limits_.most + 1);
    const auto& layers = tiles_.maker().layers();
    for (layer_ = 0; layer_ < layers.size(); ++layer_) {
        layers[layer_]->find_features(*this);
        take_found();
    }
    std::erase_if(kept_, [&](const FeatureInView& found) {
        const double spacing_m = tiles_.maker().sample_spacing_m(found.layer, found.feature.position_m);
        return layers[found.layer]->share_left(found.feature, spacing_m) < min_share;
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

double FeatureFinder::min_px() const {
    return kept_.size() < limits_.most ? limits_.min_px : std::max(limits_.min_px, kept_.front().size_px);
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
    const double nearest_m = length(centre - cone_.eye_m()) - radius_m - cone_.moved_m();
    if (largest_m < min_px() * scene_.lens.pixel_angle_rad() * nearest_m) return false;
    if (nearest_m <= 0) return true;
    return cone_.may_show(centre, radius_m) &&
           (domain.is_plane() || may_rise(domain.radii_m(), cone_.eye_m(), cap.centre_m,
                                          cap.radius_m + cone_.moved_m(), {tiles_.least(), heights.largest}));
}

bool FeatureFinder::wants(terrain::TileKey square, double largest_m) {
    const int up = place_bits - square.level;
    return in_view(cap_of(tiles_.domain(), square),
                   heights_of(square.face, square.i << up, square.j << up, square.level), largest_m);
}

bool FeatureFinder::wants(Vec3 position_m, double diameter_m) {
    const terrain::SurfaceDomain& domain = tiles_.domain();
    const auto [face, u, v] = domain.place_of(position_m);
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
    for (const TruthState* const row : cone_.rows()) {
        ImagePoint shift;
        const auto at = states_.project(*row, towards_point(*row, body_, point_m), shift);
        if (!at) continue;
        left = std::min(left, at->x), right = std::max(right, at->x);
        top = std::min(top, at->y), bottom = std::max(bottom, at->y);
    }
    if (!(left <= right)) return false;
    // It may bend while it moves.
    const double margin =
        0.5 + (cone_.rows().front() == cone_.rows().back() ? 0 : 1 + (right - left) + (bottom - top));
    return std::any_of(states_.windows().begin(), states_.windows().end(), [&](const FrameWindow& window) {
        const Region& r = window.sensor;
        return right >= r.x - margin && left < r.x + r.width - 1 + margin && bottom >= r.y - margin &&
               top < r.y + r.height - 1 + margin;
    });
}

void FeatureFinder::add(const terrain::SurfaceFeature& feature) {
    found_[found_count_++] = feature;
    if (found_count_ == found_.size()) take_found();
}

void FeatureFinder::take_found() {
    std::array<Vec3, packet_size> towards;
    std::array<std::optional<Vec3>, packet_size> points;
    for (std::size_t i = 0; i < found_count_; ++i)
        towards[i] = found_[i].position_m;
    find_surface_points(scene_, *cone_.rows()[1], body_, std::span(towards).first(found_count_), points);
    for (std::size_t i = 0; i < found_count_; ++i)
        if (points[i]) keep(found_[i], *points[i]);
    found_count_ = 0;
}

void FeatureFinder::keep(const terrain::SurfaceFeature& feature, Vec3 point_m) {
    FeatureInView found{feature, layer_, point_m, 0};
    found.size_px = feature.diameter_m / (length(point_m - cone_.eye_m()) * scene_.lens.pixel_angle_rad());
    if (!(found.size_px >= limits_.min_px) || !on_pixels(point_m)) return;
    if (kept_.size() == limits_.most) {
        if (!larger(found, kept_.front())) return;
        std::pop_heap(kept_.begin(), kept_.end(), larger);
        kept_.pop_back();
    }
    kept_.push_back(found);
    std::push_heap(kept_.begin(), kept_.end(), larger);
}

} // namespace obscura::renderer
