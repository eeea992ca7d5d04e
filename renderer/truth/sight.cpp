// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/sight.hpp"

#include "renderer/shapes/single_ray.hpp"

namespace obscura::renderer {

bool is_hidden(const TruthScene& scene, const TruthState& state, Vec3 direction, double range_m,
               std::size_t but) {
    const Vec3 unit = rotate(state.camera.orientation, normalized(direction));
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (b == but) continue;
        const Shape& shape = *scene.bodies[b].shape;
        const Vec3 to_body = state.bodies[b].position_m - state.camera.position_m;
        const double radius = shape.bounding_radius_m();
        // The line passes the bounding sphere.
        const double along = dot(to_body, unit);
        if (length_squared(to_body) > radius * radius &&
            (along < 0 || length_squared(cross(to_body, unit)) > radius * radius))
            continue;
        const Quat own = conjugate(state.bodies[b].orientation);
        if (distance_along(shape, rotate(own, -to_body), rotate(own, unit)) < range_m) return true;
    }
    return false;
}

bool faces_camera(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 point_m) {
    const Shape& shape = *scene.bodies[body].shape;
    const Vec3 camera = to_local(state.bodies[body], state.camera.position_m);
    const double range = length(point_m - camera);
    return !(distance_along(shape, camera, (point_m - camera) / range) <
             range - surface_slack * shape.bounding_radius_m());
}

bool is_lit(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 point_m) {
    if (!(scene.scene.sun.irradiance_scale > 0)) return false;
    const Vec3 surface = to_parent(state.bodies[body], point_m);
    const Vec3 to_sun = normalized(state.sun_m - surface);
    const Vec3 point = surface + surface_slack * scene.bodies[body].shape->bounding_radius_m() * to_sun;
    for (std::size_t b = 0; b < scene.scene.bodies.size(); ++b) {
        const Shape& shape = *scene.bodies[b].shape;
        if (distance_along(shape, to_local(state.bodies[b], point),
                           rotate(conjugate(state.bodies[b].orientation), to_sun)) != no_hit)
            return false;
    }
    return true;
}

} // namespace obscura::renderer
