// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/sight.hpp"

#include "renderer/planets/surface_tiles.hpp"
#include "renderer/shapes/single_ray.hpp"

#include <algorithm>
#include <array>

namespace obscura::renderer {
namespace {

/// As distance_along(), of a body as the frame shows it.
double range_to(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 origin,
                Vec3 direction) {
    const DetailView detail = detail_of(scene, state, body);
    return distance_along(*scene.bodies[body].shape, origin, direction,
                          detail.cell_rad > 0 ? &detail : nullptr);
}

} // namespace

DetailView detail_of(const TruthScene& scene, const TruthState& state, std::size_t body) {
    DetailView detail;
    const SurfaceTiles* const tiles = scene.bodies[body].shape->tiles();
    if (tiles == nullptr) return detail;
    detail.eye_m = state.eye_m(body);
    detail.cell_rad = tiles->cell_px() * scene.lens.pixel_angle_rad();
    detail.wait = scene.wait_for_tiles;
    detail.version = scene.tile_versions[body];
    return detail;
}

double surface_slack_m(const TruthScene& scene, std::size_t body) {
    return 1e-4 * scene.bodies[body].shape->bounding_radius_m();
}

std::optional<Vec3> surface_point(const TruthScene& scene, const TruthState& state, std::size_t body,
                                  Vec3 towards) {
    std::optional<Vec3> point;
    find_surface_points(scene, state, body, {&towards, 1}, {&point, 1});
    return point;
}

void find_surface_points(const TruthScene& scene, const TruthState& state, std::size_t body,
                         std::span<const Vec3> towards, std::span<std::optional<Vec3>> points) {
    const Shape& shape = *scene.bodies[body].shape;
    const SurfaceTiles* const tiles = shape.tiles();
    const bool plane = tiles != nullptr && tiles->domain().is_plane();
    const double from_m = 1.01 * shape.bounding_radius_m();
    const DetailView detail = detail_of(scene, state, body);
    for (std::size_t first = 0; first < towards.size(); first += packet_size) {
        const std::size_t count = std::min(towards.size() - first, std::size_t{packet_size});
        std::array<Vec3, packet_size> origins, down;
        std::array<double, packet_size> ranges{};
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3 to = towards[first + i];
            down[i] = plane ? Vec3{0, 0, -1} : -normalized(to);
            origins[i] = plane ? Vec3{to.x, to.y, from_m} : -from_m * down[i];
        }
        distances_along(shape, std::span(origins).first(count), std::span(down).first(count),
                        std::span(ranges).first(count), detail.cell_rad > 0 ? &detail : nullptr);
        for (std::size_t i = 0; i < count; ++i) {
            points[first + i].reset();
            // Beyond the centre it is the surface of the other side.
            if (ranges[i] <= (plane ? 2 : 1) * from_m) points[first + i] = origins[i] + ranges[i] * down[i];
        }
    }
}

void face_cameras(const TruthScene& scene, std::span<const TruthState* const> states, std::size_t body,
                  Vec3 point_m, double slack_m, std::span<bool> faces) {
    if (states.empty()) return;
    const DetailView detail = detail_of(scene, *states[states.size() / 2], body);
    for (std::size_t first = 0; first < states.size(); first += packet_size) {
        const std::size_t count = std::min(states.size() - first, std::size_t{packet_size});
        std::array<Vec3, packet_size> cameras, towards;
        std::array<double, packet_size> wanted{}, ranges{};
        for (std::size_t i = 0; i < count; ++i) {
            const TruthState& state = *states[first + i];
            cameras[i] = state.eye_m(body);
            wanted[i] = length(point_m - cameras[i]);
            towards[i] = (point_m - cameras[i]) / wanted[i];
        }
        distances_along(*scene.bodies[body].shape, std::span(cameras).first(count),
                        std::span(towards).first(count), std::span(ranges).first(count),
                        detail.cell_rad > 0 ? &detail : nullptr);
        for (std::size_t i = 0; i < count; ++i)
            faces[first + i] = !(ranges[i] < wanted[i] - slack_m);
    }
}

bool is_hidden(const TruthScene& scene, const TruthState& state, Vec3 direction, double range_m,
               std::size_t but) {
    const Vec3 unit = rotate(state.camera.orientation, normalized(direction));
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (b == but) continue;
        const Shape& shape = *scene.bodies[b].shape;
        const ApparentBody& seen = state.bodies[b];
        const Vec3 eye = state.eye_m(b), towards = seen.direction(unit);
        const double radius = shape.bounding_radius_m();
        // The line passes the bounding sphere.
        const double along = -dot(eye, towards);
        if (length_squared(eye) > radius * radius &&
            (along < 0 || length_squared(cross(eye, towards)) > radius * radius))
            continue;
        if (range_to(scene, state, b, eye, towards) < range_m * seen.stretch(unit)) return true;
    }
    return false;
}

bool faces_camera(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 point_m,
                  double slack_m) {
    bool faces = false;
    const TruthState* const one = &state;
    face_cameras(scene, {&one, 1}, body, point_m, slack_m, {&faces, 1});
    return faces;
}

bool is_lit(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 point_m,
            double slack_m) {
    if (!(scene.scene.sun.irradiance_scale > 0)) return false;
    const ApparentBody& own = state.bodies[body];
    const double path_m = length(own.towards(state.camera.position_m, point_m));
    const Vec3 surface = own.position_at(path_m) + rotate(own.pose.orientation, point_m);
    const Vec3 to_sun = normalized(state.sun_m - surface);
    const Vec3 point = surface + slack_m * to_sun;
    for (std::size_t b = 0; b < scene.scene.bodies.size(); ++b) {
        const ApparentBody& other = state.bodies[b];
        const Vec3 from = rotate(conjugate(other.pose.orientation), point - other.position_at(path_m));
        if (range_to(scene, state, b, from, other.direction(to_sun)) != no_hit) return false;
    }
    return true;
}

} // namespace obscura::renderer
