// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/pinhole.hpp"

#include <cmath>

namespace obscura::renderer {
namespace {

OBSCURA_VECTOR_CLONES
void pinhole_rays(double scale_x, double scale_y, double cx, double cy, const Doubles& x, const Doubles& y,
                  Vec3s& direction, Doubles& solid_angle_sr) {
    for (int i = 0; i < packet_size; ++i) {
        const double u = (x.v[i] - cx) * scale_x;
        const double v = (y.v[i] - cy) * scale_y;
        const double inverse = 1 / std::sqrt(u * u + v * v + 1);
        direction.x.v[i] = u * inverse;
        direction.y.v[i] = v * inverse;
        direction.z.v[i] = inverse;
        solid_angle_sr.v[i] = scale_x * scale_y * inverse * inverse * inverse;
    }
}

} // namespace

Pinhole::Pinhole(const scene::Camera& camera)
    : scale_x_(camera.pixel_pitch_m / camera.focal_length_m),
      scale_y_(camera.row_pitch_m() / camera.focal_length_m),
      centre_x_((camera.width - 1) / 2.0),
      centre_y_((camera.height - 1) / 2.0) {}

void Pinhole::rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& solid_angle_sr) const {
    pinhole_rays(scale_x_, scale_y_, centre_x_, centre_y_, x, y, direction, solid_angle_sr);
}

double Pinhole::solid_angle_sr(double x, double y) const {
    const double u = (x - centre_x_) * scale_x_;
    const double v = (y - centre_y_) * scale_y_;
    const double n2 = u * u + v * v + 1;
    return scale_x_ * scale_y_ / (n2 * std::sqrt(n2));
}

std::optional<ImagePoint> Pinhole::project(Vec3 d) const {
    if (!(d.z > 0)) return std::nullopt;
    return ImagePoint{d.x / d.z / scale_x_ + centre_x_, d.y / d.z / scale_y_ + centre_y_};
}

double Pinhole::field_angle_rad(double margin_px) const {
    const double x = (centre_x_ + 0.5 + margin_px) * scale_x_;
    const double y = (centre_y_ + 0.5 + margin_px) * scale_y_;
    return std::atan(std::sqrt(x * x + y * y));
}

} // namespace obscura::renderer
