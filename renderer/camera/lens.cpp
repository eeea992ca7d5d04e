// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/lens.hpp"

#include "core/error.hpp"
#include "renderer/packets/vector_math.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

using std::numbers::pi;

} // namespace

Lens::Lens(const scene::Camera& camera)
    : projection_(camera.projection),
      distortion_(camera.distortion, camera.focal_length_m),
      width_(camera.width),
      height_(camera.height),
      scale_x_(camera.pixel_pitch_m / camera.focal_length_m),
      scale_y_(camera.row_pitch_m() / camera.focal_length_m),
      centre_x_((camera.width - 1) / 2.0 + camera.principal_offset_px[0]),
      centre_y_((camera.height - 1) / 2.0 + camera.principal_offset_px[1]),
      cosine_(std::cos(camera.sensor_rotation_rad)),
      sine_(std::sin(camera.sensor_rotation_rad)),
      pupil_cosine_(camera.pupil_cosine) {
    switch (projection_) {
    case scene::Projection::model: // not a lens
    case scene::Projection::pinhole:
        max_angle_rad_ = pi / 2 - 1e-6;
        break;
    case scene::Projection::orthographic:
        max_angle_rad_ = pi / 2;
        break;
    case scene::Projection::stereographic:
        max_angle_rad_ = pi - 1e-6;
        break;
    case scene::Projection::equidistant:
    case scene::Projection::equisolid:
        max_angle_rad_ = pi;
        break;
    }
    max_radius_ = radius(max_angle_rad_);
    limit_rad_ = max_angle_rad_;

    // Check that the distortion is invertible over the sensor, and find the largest angle of a pixel.
    for (int i = 0; i <= 32; ++i)
        for (int j = 0; j <= 32; ++j) {
            const double x = -0.5 + camera.width * i / 32.0;
            const double y = -0.5 + camera.height * j / 32.0;
            double ratio = 1;
            if (camera.distortion.model != scene::Distortion::Model::table &&
                !distortion_.ideal(on_plane(x, y), ratio))
                throw ConfigError(fmt::format(
                    "camera: distortion: has no inverse at pixel ({:.0f}, {:.0f}): allowed are models that are one to one over the sensor",
                    x, y));
            double inside = 0;
            double beside = 0;
            const Vec3 d = direction_at(x, y, inside);
            for (const auto& [dx, dy] : {std::pair{1.0, 0.0}, {0.0, 1.0}}) {
                const Vec3 next = direction_at(x + dx, y + dy, beside);
                if (inside > 0 && beside > 0) pixel_angle_rad_ = std::max(pixel_angle_rad_, length(next - d));
            }
        }
    // At the rim of its image circle the orthographic projection has an infinite slope.
    bool rim = false;
    for (const double x : {-0.5, camera.width - 0.5})
        for (const double y : {-0.5, camera.height - 0.5}) {
            double inside = 0;
            (void)direction_at(x, y, inside);
            rim = rim || inside == 0;
        }
    if (projection_ == scene::Projection::orthographic && rim)
        pixel_angle_rad_ = std::max(pixel_angle_rad_, std::sqrt(2 * std::max(scale_x_, scale_y_)));
    // Add a margin for what lies between the points of the grid.
    pixel_angle_rad_ = (pixel_angle_rad_ > 0 ? pixel_angle_rad_ : std::max(scale_x_, scale_y_)) * 1.2;
    limit_rad_ = std::min(max_angle_rad_, field_angle_rad(projected_margin_px(camera)) + 1e-9);
}

double Lens::radius(double t) const {
    switch (projection_) {
    case scene::Projection::model:
    case scene::Projection::pinhole:
        return std::tan(t);
    case scene::Projection::equidistant:
        return t;
    case scene::Projection::equisolid:
        return 2 * std::sin(t / 2);
    case scene::Projection::stereographic:
        return 2 * std::tan(t / 2);
    case scene::Projection::orthographic:
        return std::sin(t);
    }
    return t;
}

double Lens::angle(double r) const {
    switch (projection_) {
    case scene::Projection::model:
    case scene::Projection::pinhole:
        return std::atan(r);
    case scene::Projection::equidistant:
        return r;
    case scene::Projection::equisolid:
        return 2 * std::asin(std::min(1.0, r / 2));
    case scene::Projection::stereographic:
        return 2 * std::atan(r / 2);
    case scene::Projection::orthographic:
        return std::asin(std::min(1.0, r));
    }
    return r;
}

PlanePoint Lens::on_plane(double x, double y) const {
    const double u = (x - centre_x_) * scale_x_;
    const double v = (y - centre_y_) * scale_y_;
    return {cosine_ * u - sine_ * v, sine_ * u + cosine_ * v};
}

double Lens::solid_angle_per_area(double t) const {
    switch (projection_) {
    case scene::Projection::model:
    case scene::Projection::pinhole:
        return std::cos(t) * std::cos(t) * std::cos(t);
    case scene::Projection::equidistant:
        return t > 0 ? std::sin(t) / t : 1;
    case scene::Projection::equisolid:
        return 1;
    case scene::Projection::stereographic: {
        const double c = std::cos(t / 2) * std::cos(t / 2);
        return c * c;
    }
    case scene::Projection::orthographic:
        return 1 / std::max(std::cos(t), 1e-3);
    }
    return 1;
}

Vec3 Lens::direction_at(double x, double y, double& solid_angle_sr) const {
    const PlanePoint real = on_plane(x, y);
    double area_ratio = 1;
    const std::optional<PlanePoint> ideal = distortion_.ideal(real, area_ratio);
    const PlanePoint p = ideal ? *ideal : real;
    const double r = std::sqrt(p.x * p.x + p.y * p.y);
    const double t = std::min(angle(std::min(r, max_radius_)), max_angle_rad_);
    const bool inside = ideal.has_value() && r <= max_radius_;
    solid_angle_sr = inside ? scale_x_ * scale_y_ * area_ratio * solid_angle_per_area(t) : 0;
    if (r == 0) return {0, 0, 1};
    const double s = std::sin(t) / r;
    return {p.x * s, p.y * s, std::cos(t)};
}

void Lens::rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 d = direction_at(x[i], y[i], weight_sr[i]);
        direction.set(i, d);
        weight_sr[i] *= transmission(d);
    }
}

double Lens::solid_angle_sr(double x, double y) const {
    double solid_angle = 0;
    (void)direction_at(x, y, solid_angle);
    return solid_angle;
}

std::optional<ImagePoint> Lens::project_any(Vec3 direction) const {
    const double across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
    const double t = std::atan2(across, direction.z);
    if (!(t <= max_angle_rad_)) return std::nullopt;
    const double s = across > 0 ? radius(t) / across : 0;
    const std::optional<PlanePoint> p = distortion_.real({direction.x * s, direction.y * s});
    if (!p) return std::nullopt;
    return ImagePoint{(cosine_ * p->x + sine_ * p->y) / scale_x_ + centre_x_,
                      (cosine_ * p->y - sine_ * p->x) / scale_y_ + centre_y_};
}

std::optional<ImagePoint> Lens::project(Vec3 direction) const {
    const double across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
    if (!(std::atan2(across, direction.z) <= limit_rad_)) return std::nullopt;
    return project_any(direction);
}

double Lens::transmission(Vec3 direction) const {
    return pupil_cosine_ ? std::max(0.0, direction.z / length(direction)) : 1;
}

double Lens::local_pixel_angle_rad(Vec3 direction) const {
    const double finer = std::min(scale_x_, scale_y_);
    const double h = std::min(1e-4, finer);
    const std::array<Vec3, 5> around = directions_around(normalized(direction), h);
    const auto at = project(around[0]);
    double most = 0; // pixels per radian
    for (std::size_t i = 1; i < around.size(); ++i) {
        const auto p = project(around[i]);
        if (at && p)
            most = std::max(most,
                            std::sqrt((p->x - at->x) * (p->x - at->x) + (p->y - at->y) * (p->y - at->y)) / h);
    }
    return most > 0 ? 1 / most : finer;
}

double Lens::field_angle_rad(double margin) const {
    double most = 0;
    constexpr int steps = 64;
    const auto look = [&](double x, double y) {
        double inside = 0;
        const Vec3 d = direction_at(x, y, inside);
        most =
            std::max(most, inside > 0 ? std::atan2(std::sqrt(d.x * d.x + d.y * d.y), d.z) : max_angle_rad_);
    };
    // Reduce the margin until the distortion has an inverse everywhere in it.
    double m = margin;
    const auto good = [&](double x, double y) {
        double ratio = 1;
        return distortion_.ideal(on_plane(x, y), ratio).has_value();
    };
    while (m > 0.5 && !(good(-0.5 - m, -0.5 - m) && good(width_ - 0.5 + m, -0.5 - m) &&
                        good(-0.5 - m, height_ - 0.5 + m) && good(width_ - 0.5 + m, height_ - 0.5 + m)))
        m /= 2;
    for (int i = 0; i <= steps; ++i) {
        const double x = -0.5 - m + (width_ + 2 * m) * i / steps;
        const double y = -0.5 - m + (height_ + 2 * m) * i / steps;
        look(x, -0.5 - m);
        look(x, height_ - 0.5 + m);
        look(-0.5 - m, y);
        look(width_ - 0.5 + m, y);
    }
    const double between = pixel_angle_rad_ * (std::max(width_, height_) + 2 * m) / steps / 8;
    return std::min(most + between, pi);
}

} // namespace obscura::renderer
