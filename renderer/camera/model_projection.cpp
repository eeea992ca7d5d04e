// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/model_projection.hpp"

#include "core/error.hpp"
#include "models/kinds/projection_checks.hpp"
#include "renderer/packets/vector_math.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

using std::numbers::pi;

Doubles all_lanes(double value) {
    Doubles d;
    std::fill_n(d.v, packet_size, value);
    return d;
}

models::DirectionRows rows_of(const Vec3s& d) {
    return {d.x.v, d.y.v, d.z.v};
}

double angle_to_boresight(Vec3 d) {
    return std::atan2(std::hypot(d.x, d.y), d.z);
}

} // namespace

models::SensorPlane sensor_plane(const scene::Camera& camera) {
    const double cosine = std::cos(camera.sensor_rotation_rad), sine = std::sin(camera.sensor_rotation_rad);
    const double across = camera.pixel_pitch_m, down = camera.row_pitch_m();
    models::SensorPlane plane;
    plane.focal_length_m = camera.focal_length_m;
    plane.width = camera.width;
    plane.height = camera.height;
    plane.margin_px = projected_margin_px(camera);
    plane.column_m = {cosine * across, sine * across};
    plane.row_m = {-sine * down, cosine * down};
    const std::array<double, 2> centre = camera.intrinsics().principal_point_px;
    for (std::size_t k = 0; k < 2; ++k)
        plane.first_m[k] = -(centre[0] * plane.column_m[k] + centre[1] * plane.row_m[k]);
    return plane;
}

models::ProjectionProgram projection_program(const scene::Camera& camera) {
    const models::ModelValues& own = camera.own_projection;
    if (own.loaded == nullptr)
        throw ConfigError("camera: the model's file is missing: write projection = { model = \"FILE.prj\" }");
    return {own.loaded->model, models::program_parameters(own), sensor_plane(camera)};
}

ModelProjection::ModelProjection(const scene::Camera& camera)
    : program_(projection_program(camera)),
      pupil_cosine_(camera.pupil_cosine),
      finer_rad_(std::min(camera.pixel_pitch_m, camera.row_pitch_m()) / camera.focal_length_m) {
    if (const std::string why = models::refusal_by(models::report_on(program_)); !why.empty())
        throw ConfigError(fmt::format("camera: {}: {}", program_.model().name(), why));
    set_pixel_angle();
}

void ModelProjection::set_pixel_angle() {
    // Largest angle of a pixel, at the points of a grid and one pixel on.
    const models::SensorPlane& plane = program_.plane();
    for (int i = 0; i <= 32; ++i)
        for (int j = 0; j <= 32; ++j) {
            Doubles x = all_lanes(-0.5 + plane.width * i / 32.0),
                    y = all_lanes(-0.5 + plane.height * j / 32.0);
            x[1] += 1;
            y[2] += 1;
            Vec3s d;
            Doubles solid_angle;
            program_.rays(x.v, y.v, {d.x.v, d.y.v, d.z.v}, solid_angle.v, packet_size);
            for (const int next : {1, 2})
                if (solid_angle[0] != 0 && solid_angle[next] != 0)
                    pixel_angle_rad_ = std::max(pixel_angle_rad_, length(d.lane(next) - d.lane(0)));
        }
    // A margin for what lies between the points of the grid.
    pixel_angle_rad_ = (pixel_angle_rad_ > 0 ? pixel_angle_rad_ : finer_rad_) * 1.2;
}

void ModelProjection::rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const {
    program_.rays(x.v, y.v, {direction.x.v, direction.y.v, direction.z.v}, weight_sr.v, packet_size);
    Doubles fraction;
    program_.transmission(rows_of(direction), fraction.v, packet_size);
    for (int i = 0; i < packet_size; ++i) {
        const double pupil = pupil_cosine_ ? std::max(0.0, direction.z[i]) : 1;
        const bool passes = fraction[i] >= 0 && fraction[i] <= 1;
        weight_sr[i] = passes ? std::fabs(weight_sr[i]) * pupil * fraction[i] : 0;
    }
}

double ModelProjection::solid_angle_sr(double x, double y) const {
    Vec3s direction;
    Doubles solid_angle;
    program_.rays(all_lanes(x).v, all_lanes(y).v, {direction.x.v, direction.y.v, direction.z.v},
                  solid_angle.v, packet_size);
    return std::fabs(solid_angle[0]);
}

std::optional<ImagePoint> ModelProjection::project(Vec3 direction) const {
    const Vec3s d{all_lanes(direction.x), all_lanes(direction.y), all_lanes(direction.z)};
    Doubles x, y;
    program_.project(rows_of(d), x.v, y.v, packet_size);
    if (!std::isfinite(x[0])) return std::nullopt;
    return ImagePoint{x[0], y[0]};
}

double ModelProjection::transmission(Vec3 direction) const {
    const Vec3 d = normalized(direction);
    const double pupil = pupil_cosine_ ? std::max(0.0, d.z) : 1;
    if (!program_.has_transmission()) return pupil;
    const Vec3s all{all_lanes(d.x), all_lanes(d.y), all_lanes(d.z)};
    Doubles fraction;
    program_.transmission(rows_of(all), fraction.v, packet_size);
    return fraction[0] >= 0 && fraction[0] <= 1 ? pupil * fraction[0] : 0;
}

double ModelProjection::local_pixel_angle_rad(Vec3 direction) const {
    const double h = std::min(1e-4, finer_rad_);
    const Vec3 d = normalized(direction);
    const std::array<Vec3, 5> around = directions_around(d, h);
    Vec3s all{all_lanes(d.x), all_lanes(d.y), all_lanes(d.z)};
    for (std::size_t i = 0; i < around.size(); ++i)
        all.set(static_cast<int>(i), around[i]);
    Doubles x, y;
    program_.project(rows_of(all), x.v, y.v, packet_size);
    double most = 0; // pixels per radian; not those that are not seen
    for (int i = 1; i < static_cast<int>(around.size()); ++i) {
        const double pixels = std::hypot(x[i] - x[0], y[i] - y[0]) / h;
        if (std::isfinite(pixels)) most = std::max(most, pixels);
    }
    return most > 0 ? 1 / most : finer_rad_;
}

double ModelProjection::field_angle_rad(double margin_px) const {
    // The largest angle may lie anywhere: a mirror shows what is behind the camera in the middle.
    const models::SensorPlane& plane = program_.plane();
    constexpr int steps = 63; // 64 points: whole packets
    double largest = 0, cell = 0;
    bool all = true;
    for (int row = 0; row <= steps; ++row)
        for (int first = 0; first <= steps; first += packet_size) {
            Doubles x, y = all_lanes(-0.5 - margin_px + (plane.height + 2 * margin_px) * row / steps);
            for (int i = 0; i < packet_size; ++i)
                x[i] = -0.5 - margin_px + (plane.width + 2 * margin_px) * (first + i) / steps;
            Vec3s d;
            Doubles solid_angle;
            program_.rays(x.v, y.v, {d.x.v, d.y.v, d.z.v}, solid_angle.v, packet_size);
            for (int i = 0; i < packet_size; ++i) {
                all = all && solid_angle[i] != 0;
                if (solid_angle[i] == 0) continue;
                largest = std::max(largest, angle_to_boresight(d.lane(i)));
                if (i > 0 && solid_angle[i - 1] != 0)
                    cell = std::max(cell, length(d.lane(i) - d.lane(i - 1)));
            }
        }
    // The rim of what is seen may be a cell farther out.
    const double between =
        pixel_angle_rad_ * (std::max(plane.width, plane.height) + 2 * margin_px) / steps / 8;
    return std::min(largest + std::max(between, all ? 0.0 : 2 * cell), pi);
}

std::vector<std::string> model_projection_warnings(const scene::Camera& camera) {
    if (camera.projection != scene::Projection::model || camera.own_projection.loaded == nullptr) return {};
    const models::ProjectionProgram program = projection_program(camera);
    std::vector<std::string> lines;
    for (const std::string& line : models::warnings_by(models::report_on(program)))
        lines.push_back(fmt::format("{}: {}", program.model().name(), line));
    if (const std::string& text = program.model().warnings(); !text.empty()) lines.push_back(text);
    return lines;
}

} // namespace obscura::renderer
