// SPDX-License-Identifier: Apache-2.0
// Camera projection interface: directions to image points and back.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <memory>
#include <optional>

namespace obscura::renderer {

struct ImagePoint {
    double x = 0, y = 0; ///< sensor pixels; the centre of pixel (i, j) is at (i, j)
};

/// Directions are in the camera frame: x right, y down, z boresight. Immutable; thread-safe.
class Projection {
public:
    virtual ~Projection() = default;

    /// Unit directions in the camera frame of the image points, and the weight of a radiance there in the
    /// pixel: its solid angle times transmission(), sr. The weight is 0 where the lens forms no image; the
    /// direction is then the nearest that it does image.
    virtual void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const = 0;
    /// Solid angle of the pixel about an image point, sr; 0 where the lens forms no image.
    [[nodiscard]] virtual double solid_angle_sr(double x, double y) const = 0;
    /// Image point of a direction (any length); empty where there is none, or far outside the sensor.
    [[nodiscard]] virtual std::optional<ImagePoint> project(Vec3 direction) const = 0;
    /// Fraction of the light from a direction that reaches the focal plane.
    [[nodiscard]] virtual double transmission(Vec3 /*direction*/) const { return 1; }

    /// Largest angle that a shift of one pixel subtends anywhere on the sensor.
    [[nodiscard]] virtual double pixel_angle_rad() const = 0;
    /// Approximately the smallest such angle near a direction, for the size of bodies in pixels.
    [[nodiscard]] virtual double local_pixel_angle_rad(Vec3 /*direction*/) const { return pixel_angle_rad(); }
    /// Largest angle to the boresight on the sensor with a margin of `margin_px`.
    [[nodiscard]] virtual double field_angle_rad(double margin_px) const = 0;
};

/// Makes the projection of a camera. Throws ConfigError if the lens is invalid.
[[nodiscard]] std::unique_ptr<Projection> make_projection(const scene::Camera& camera);

/// Margin beyond the sensor within which directions are projected.
[[nodiscard]] double projected_margin_px(const scene::Camera& camera);

/// A unit vector and four about it, `step` rad away across each other and between.
[[nodiscard]] std::array<Vec3, 5> directions_around(Vec3 unit, double step);

} // namespace obscura::renderer
