// SPDX-License-Identifier: Apache-2.0
// Pinhole projection without distortion, vectorised.
#pragma once

#include "renderer/camera/projection.hpp"

#include <algorithm>

namespace obscura::renderer {

/// x = f/p X/Z + (width-1)/2, y likewise with the pitch of the rows; camera frame x right, y down, z
/// boresight.
class Pinhole final : public Projection {
public:
    explicit Pinhole(const scene::Camera& camera);

    void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const override;
    [[nodiscard]] double solid_angle_sr(double x, double y) const override;
    [[nodiscard]] std::optional<ImagePoint> project(Vec3 direction) const override;
    [[nodiscard]] double pixel_angle_rad() const override { return std::max(scale_x_, scale_y_); }
    [[nodiscard]] double local_pixel_angle_rad(Vec3 /*direction*/) const override {
        return std::min(scale_x_, scale_y_);
    }
    [[nodiscard]] double field_angle_rad(double margin_px) const override;

private:
    double scale_x_, scale_y_; ///< pitch / focal length
    double centre_x_, centre_y_;
};

} // namespace obscura::renderer
