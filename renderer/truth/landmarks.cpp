// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/landmarks.hpp"

#include "core/error.hpp"
#include "core/text/suggestion.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/surface_place.hpp"
#include "renderer/shapes/ellipsoid.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <optional>

namespace obscura::renderer {
namespace {

Vec3 point_of(const scene::Landmark& landmark, const scene::Scene& scene,
              const std::vector<BuiltBody>& bodies) {
    const std::int32_t index = scene::index_of(scene.bodies, landmark.body);
    if (index < 0)
        throw ConfigError(fmt::format("landmark '{}': no body is named '{}', {}", landmark.name,
                                      landmark.body,
                                      allowed_words(landmark.body, scene::names_of(scene.bodies))));
    return landmark_point(landmark, scene.bodies[static_cast<std::size_t>(index)].shape,
                          *bodies[static_cast<std::size_t>(index)].shape, GroundDetail::coarse);
}

} // namespace

std::optional<Vec3> reference_radii_m(const scene::Shape& shape) {
    if (const auto* ellipsoid = shape.get_if<EllipsoidParameters>()) return ellipsoid->radii_m;
    if (const auto* planet = shape.get_if<PlanetParameters>()) return planet->radii_m;
    return std::nullopt;
}

Vec3 landmark_point(const scene::Landmark& landmark, const scene::Shape& description, const Shape& shape,
                    GroundDetail detail) {
    if (landmark.position_m) return *landmark.position_m;
    const std::optional<Vec3> radii_m = reference_radii_m(description);
    if (landmark.planetographic && !radii_m)
        throw ConfigError(fmt::format("landmark '{}': latitudes: planetographic ones need a reference "
                                      "ellipsoid, which a {} has not; allowed is \"planetocentric\"",
                                      landmark.name, description.kind()));
    const scene::HeightLine line = height_line(
        scene::direction_of(landmark.longitude_rad, landmark.latitude_rad),
        landmark.planetographic ? scene::Latitudes::planetographic : scene::Latitudes::planetocentric,
        landmark.planetographic ? *radii_m : Vec3{});
    const std::optional<double> height_m = ground_height_m(shape, line, detail);
    if (!height_m)
        throw ConfigError(
            fmt::format("landmark '{}': body '{}' has no surface at that longitude and latitude",
                        landmark.name, landmark.body));
    return line.foot_m + *height_m * line.up;
}

std::vector<Vec3> landmark_points(const scene::Scene& scene, const std::vector<BuiltBody>& bodies) {
    std::vector<Vec3> points;
    for (const scene::Landmark& landmark : scene.landmarks)
        scene::at_position(landmark.position, [&] { points.push_back(point_of(landmark, scene, bodies)); });
    return points;
}

} // namespace obscura::renderer
