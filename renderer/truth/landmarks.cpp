// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/landmarks.hpp"

#include "core/error.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/shapes/single_ray.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>

namespace obscura::renderer {
namespace {

Vec3 point_of(const scene::Landmark& landmark, const scene::Scene& scene,
              const std::vector<BuiltBody>& bodies) {
    const std::int32_t index = scene::index_of(scene.bodies, landmark.body);
    if (index < 0)
        throw ConfigError(fmt::format("landmark '{}': no body is named '{}'", landmark.name, landmark.body));
    if (landmark.position_m) return *landmark.position_m;
    const double c = std::cos(landmark.latitude_rad);
    const Vec3 up{c * std::cos(landmark.longitude_rad), c * std::sin(landmark.longitude_rad),
                  std::sin(landmark.latitude_rad)};
    const Shape& shape = *bodies[static_cast<std::size_t>(index)].shape;
    const double from_m = 2 * shape.bounding_radius_m();
    const double range_m = distance_along(shape, from_m * up, -up);
    // Beyond the origin it is the surface of the other side.
    if (!(range_m <= from_m))
        throw ConfigError(
            fmt::format("landmark '{}': body '{}' has no surface at that longitude and latitude",
                        landmark.name, landmark.body));
    return (from_m - range_m) * up;
}

} // namespace

std::vector<Vec3> landmark_points(const scene::Scene& scene, const std::vector<BuiltBody>& bodies) {
    std::vector<Vec3> points;
    for (const scene::Landmark& landmark : scene.landmarks)
        scene::at_position(landmark.position, [&] { points.push_back(point_of(landmark, scene, bodies)); });
    return points;
}

} // namespace obscura::renderer
