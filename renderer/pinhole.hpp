// The pinhole projection.
#pragma once

#include "core/scene.hpp"
#include "renderer/packet.hpp"

#include <optional>

namespace obscura::renderer {

struct ImagePoint {
    double x = 0, y = 0; ///< sensor pixels; the centre of pixel (i, j) is at (i, j)
};

/// x = f/p X/Z + (width-1)/2, y likewise; camera frame x right, y down, z boresight.
class Pinhole {
public:
    explicit Pinhole(const scene::Camera& camera);

    /// Unit directions in the camera frame of the image points, and the solid angle of a pixel there, sr.
    void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& solid_angle_sr) const;

    /// Solid angle of the pixel about an image point, sr.
    [[nodiscard]] double solid_angle_sr(double x, double y) const;

    /// Where a direction (any length) is seen; nothing behind the camera.
    [[nodiscard]] std::optional<ImagePoint> project(Vec3 direction) const;

    /// The largest angle that a shift of one pixel can subtend.
    [[nodiscard]] double pixel_angle_rad() const { return scale_; }
    /// Half the field's diagonal, from the boresight, of the whole sensor grown by `margin_px`.
    [[nodiscard]] double field_angle_rad(double margin_px) const;

private:
    double scale_; ///< pitch / focal length
    double centre_x_, centre_y_;
};

} // namespace obscura::renderer
