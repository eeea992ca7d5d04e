// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/ground.hpp"

#include "renderer/planets/surface_tiles.hpp"
#include "renderer/shapes/single_ray.hpp"

namespace obscura::renderer {
namespace {

/// Eye of the finest look: so far above the ground, and the width of the cells over the distance.
constexpr double eye_height_m = 10, cell_rad = 1e-3;
/// From level to level the ground moves by less than the eye's distance, so that few looks settle.
constexpr int looks = 4;

} // namespace

std::optional<double> ground_height_m(const Shape& shape, const scene::HeightLine& line,
                                      GroundDetail detail) {
    const double from_m = 2 * shape.bounding_radius_m();
    const Vec3 outside_m = line.foot_m + from_m * line.up;
    double range_m = distance_along(shape, outside_m, -line.up);
    // Beyond the origin it is the surface of the other side.
    const double deepest_m = from_m + dot(line.foot_m, line.up);
    if (!(range_m <= deepest_m)) return std::nullopt;
    const SurfaceTiles* const tiles = shape.tiles();
    if (tiles == nullptr || detail == GroundDetail::coarse) return from_m - range_m;
    const SurfaceTiles::Pin pin = tiles->pin();
    for (int look = 0; look < looks; ++look) {
        DetailView view;
        view.eye_m = outside_m - (range_m - eye_height_m) * line.up;
        view.cell_rad = cell_rad;
        range_m = distance_along(shape, outside_m, -line.up, &view);
        if (!(range_m <= deepest_m)) return std::nullopt;
    }
    return from_m - range_m;
}

} // namespace obscura::renderer
