// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/view.hpp"

#include "renderer/camera/projection.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/planets/ground.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "renderer/world/row_state.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

double view_angle(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
}

/// Unit direction of an image point, camera frame.
Vec3 direction_at(const Projection& lens, double x, double y) {
    Doubles xs, ys, weights;
    for (int i = 0; i < packet_size; ++i)
        xs[i] = x, ys[i] = y;
    Vec3s directions;
    lens.rays(xs, ys, directions, weights);
    return directions.lane(0);
}

/// Directions of points along the edge of the sensor and on a grid over it.
std::vector<Vec3> field_directions(const Projection& lens, const scene::Camera& camera) {
    constexpr int edge_points = 64, grid_points = 8;
    std::vector<Vec3> out;
    const auto add = [&](double u, double v) {
        out.push_back(direction_at(lens, u * camera.width - 0.5, v * camera.height - 0.5));
    };
    for (int i = 0; i <= edge_points; ++i) {
        const double u = static_cast<double>(i) / edge_points;
        add(u, 0), add(u, 1), add(0, u), add(1, u);
    }
    for (int j = 1; j < grid_points; ++j)
        for (int i = 1; i < grid_points; ++i)
            add(static_cast<double>(i) / grid_points, static_cast<double>(j) / grid_points);
    return out;
}

bool point_on_sensor(const scene::Camera& camera, const std::optional<ImagePoint>& at) {
    return at && at->x >= -0.5 && at->y >= -0.5 && at->x < camera.width - 0.5 && at->y < camera.height - 0.5;
}

/// Whether `point`, body frame, is inside a closed surface: nearly all rays from it cross the surface an odd
/// number of times. (A ray through an edge of a mesh may be counted wrong.)
bool is_inside(const Shape& shape, Vec3 point) {
    if (const SurfaceTiles* const tiles = shape.tiles();
        tiles != nullptr && !tiles->domain().is_plane() && length(point) > 0) {
        // The ground that queries meet is coarser than what a camera stands on.
        const auto ground_m = ground_height_m(shape, {{}, normalized(point)}, GroundDetail::finest);
        return ground_m && length(point) < *ground_m;
    }
    constexpr int max_crossings = 64;
    const double step_m = 1e-6 * shape.bounding_radius_m();
    int odd = 0;
    for (int i = 0; i < packet_size; ++i) {
        // Fibonacci lattice on the sphere.
        const double z = 1 - (2 * i + 1.0) / packet_size;
        const double longitude = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const double rho = std::sqrt(1 - z * z);
        const Vec3 direction{rho * std::cos(longitude), rho * std::sin(longitude), z};
        Vec3 origin = point;
        int crossings = 0;
        for (; crossings < max_crossings; ++crossings) {
            const double t = distance_along(shape, origin, direction);
            if (t == no_hit) break;
            origin = origin + direction * (t + step_m);
        }
        odd += crossings % 2;
    }
    return odd >= packet_size - 2;
}

SeenBody view_of_body(const BodyState& s, const Projection& lens, const scene::Camera& camera, Vec3 towards,
                      const std::vector<Vec3>& field) {
    SeenBody out;
    const double radius = s.shape->bounding_radius_m();
    out.extent_m = 2 * radius;
    out.distance_m = out.surface_m = s.seen.moves() ? s.seen.range_m : length(s.camera_m);
    out.boresight_rad = view_angle(towards, {0, 0, 1});
    if (out.distance_m <= radius) {
        out.extent_px = std::numeric_limits<double>::infinity();
        out.in_field = true;
        out.around_camera = is_inside(*s.shape, s.camera_m);
    } else {
        const double half_rad = std::asin(radius / out.distance_m);
        out.extent_px = 2 * half_rad / lens.local_pixel_angle_rad(towards);
        out.in_field = point_on_sensor(camera, lens.project(towards)) ||
                       std::any_of(field.begin(), field.end(),
                                   [&](Vec3 edge) { return view_angle(edge, towards) <= half_rad; });
    }
    out.sun_distance_m = length(s.sun_m);
    if (!out.around_camera) {
        const Vec3 up = normalized(s.shape->up(s.camera_m));
        if (const double t = distance_along(*s.shape, s.camera_m, -up, s.detail_view()); t != no_hit) {
            out.altitude_m = t;
            const Vec3 ground = s.camera_m - up * t;
            const double sine = dot(normalized(s.shape->up(ground)), normalized(s.sun_m - ground));
            out.sun_elevation_rad = std::asin(std::clamp(sine, -1.0, 1.0));
        }
    }
    if (out.distance_m > 0)
        if (const double far = length(s.camera_m),
            t = distance_along(*s.shape, s.camera_m, s.camera_m / -far) * (out.distance_m / far);
            t < out.distance_m)
            out.surface_m = t;
    return out;
}

} // namespace

View view_of(const scene::Scene& scene, const RowState& row, const Projection& lens, const FieldStars& stars,
             const StarObserver& observer) {
    const scene::Camera& camera = scene.camera;
    const double middle_x = (camera.width - 1) / 2.0, middle_y = (camera.height - 1) / 2.0;
    const Vec3 middle = direction_at(lens, middle_x, middle_y);
    // From edge to middle to edge: fields of more than 180 degrees too.
    const auto across = [&](double x0, double y0, double x1, double y1) {
        return view_angle(direction_at(lens, x0, y0), middle) +
               view_angle(middle, direction_at(lens, x1, y1));
    };
    View out;
    out.field_x_rad = across(-0.5, middle_y, camera.width - 0.5, middle_y);
    out.field_y_rad = across(middle_x, -0.5, middle_x, camera.height - 0.5);
    out.pixel_rad = across(middle_x - 0.5, middle_y, middle_x + 0.5, middle_y);

    out.sun_distance_m = length(row.sun_m - row.camera.position_m);
    const std::vector<Vec3> field = field_directions(lens, camera);
    for (std::size_t i = 0; i < row.bodies.size(); ++i) {
        const BodyState& s = row.bodies[i];
        const Vec3 towards = row.camera_from_inertial * (s.seen.pose.position_m - row.camera.position_m);
        SeenBody body = view_of_body(s, lens, camera, towards, field);
        if (i >= scene.bodies.size()) { // the Sun
            out.sun_in_field = body.in_field;
            continue;
        }
        body.name = scene.bodies[i].name;
        body.notes = s.shape->notes();
        body.warnings = s.shape->warnings();
        if (s.built->textures) {
            const std::vector<std::string> more = s.built->textures->notes();
            body.notes.insert(body.notes.end(), more.begin(), more.end());
        }
        if (scene.sun.irradiance_scale > 0)
            body.phase_rad = view_angle(s.sun_m, s.camera_m);
        else
            body.sun_elevation_rad.reset();
        out.bodies.push_back(std::move(body));
    }
    for (std::size_t i = 0; i < stars.numbers.size(); ++i) {
        if (stars.numbers[i] == no_star) break; // the last ones
        const Vec3 towards = row.camera_from_inertial * stars.places[i].from(observer);
        if (!point_on_sensor(camera, lens.project(towards))) continue;
        ++out.stars;
        const double magnitude_v = scene::star_of(scene, stars.numbers[i]).magnitude_v;
        out.faintest_v = std::max(magnitude_v, out.faintest_v.value_or(magnitude_v));
    }
    return out;
}

} // namespace obscura::renderer
