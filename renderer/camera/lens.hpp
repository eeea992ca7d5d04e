// SPDX-License-Identifier: Apache-2.0
// Lens: five projections, distortion, a shifted and rotated sensor, a flat pupil.
#pragma once

#include "renderer/camera/distortion.hpp"
#include "renderer/camera/projection.hpp"

namespace obscura::renderer {

/// Direction -> ideal point of the focal plane (projection) -> real point (distortion) -> pixel (sensor).
/// Directions farther from the boresight than the sensor with a margin sees are not projected: a polynomial
/// could fold them back into the image.
class Lens final : public Projection {
public:
    /// Throws ConfigError if the distortion has no inverse somewhere on the sensor.
    explicit Lens(const scene::Camera& camera);

    void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const override;
    [[nodiscard]] double solid_angle_sr(double x, double y) const override;
    [[nodiscard]] std::optional<ImagePoint> project(Vec3 direction) const override;
    [[nodiscard]] double transmission(Vec3 direction) const override;
    [[nodiscard]] double pixel_angle_rad() const override { return pixel_angle_rad_; }
    [[nodiscard]] double local_pixel_angle_rad(Vec3 direction) const override;
    [[nodiscard]] double field_angle_rad(double margin_px) const override;

private:
    /// Unit direction of an image point, and in `solid_angle_sr` the solid angle of a pixel there. Where the
    /// lens forms no image, that is 0 and the direction the nearest that the lens does image.
    [[nodiscard]] Vec3 direction_at(double x, double y, double& solid_angle_sr) const;
    [[nodiscard]] PlanePoint on_plane(double x, double y) const;
    [[nodiscard]] std::optional<ImagePoint> project_any(Vec3 direction) const;
    /// Image distance from the centre, over the focal length, of an angle to the boresight; and the inverse.
    [[nodiscard]] double radius(double angle_rad) const;
    [[nodiscard]] double angle(double radius) const;
    /// Solid angle over area of the ideal plane, both over the focal length squared.
    [[nodiscard]] double solid_angle_per_area(double angle_rad) const;

    scene::Projection projection_;
    Distortion distortion_;
    std::int32_t width_, height_;
    double scale_x_, scale_y_; ///< pitch / focal length
    double centre_x_, centre_y_, cosine_, sine_;
    bool pupil_cosine_;
    double max_radius_, max_angle_rad_; ///< of the projection itself
    double limit_rad_ = 0;              ///< directions farther from the boresight are not projected
    double pixel_angle_rad_ = 0;
};

} // namespace obscura::renderer
