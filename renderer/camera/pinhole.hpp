// SPDX-License-Identifier: Apache-2.0
// Pinhole projection without distortion, vectorised.
#pragma once

#include "renderer/camera/projection.hpp"

namespace obscura::renderer {

/// x = f/p X/Z + (width-1)/2, y likewise; camera frame x right, y down, z boresight.
class Pinhole final : public Projection {
public:
    explicit Pinhole(const scene::Camera& camera);

    void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const override;
    [[nodiscard]] double solid_angle_sr(double x, double y) const override;
    [[nodiscard]] std::optional<ImagePoint> project(Vec3 direction) const override;
    [[nodiscard]] double pixel_angle_rad() const override { return scale_; }
    [[nodiscard]] double field_angle_rad(double margin_px) const override;

private:
    double scale_; ///< pitch / focal length
    double centre_x_, centre_y_;
};

} // namespace obscura::renderer
