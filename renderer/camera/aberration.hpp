// SPDX-License-Identifier: Apache-2.0
// Stellar aberration: directions as seen by a moving observer.
#pragma once

#include "renderer/camera/projection.hpp"

namespace obscura::renderer {

constexpr double light_speed_m_s = 299'792'458.0;

/// Apparent unit direction, for an observer who moves with `beta` (velocity over the speed of light, same
/// frame), of the direction `d` at rest. The inverse is the same with -beta. Special relativity: the
/// component along the motion is cos t' = (cos t + beta) / (1 + beta cos t).
[[nodiscard]] Vec3 aberrate(Vec3 d, Vec3 beta);

/// Lens of a moving camera: directions in and out are those for an observer at rest, camera axes. Radiance is
/// not corrected; the change, the fourth power of the Doppler factor, is 4 parts in 10,000 on Earth's orbit.
class MovingLens final : public Projection {
public:
    /// `lens` must outlive it.
    MovingLens(const Projection& lens, Vec3 beta) : lens_(lens), beta_(beta) {}

    void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const override;
    [[nodiscard]] double solid_angle_sr(double x, double y) const override {
        return lens_.solid_angle_sr(x, y);
    }
    [[nodiscard]] std::optional<ImagePoint> project(Vec3 direction) const override;
    [[nodiscard]] double transmission(Vec3 direction) const override;
    /// Angles at rest are larger than the apparent ones by at most 1 + beta: far less than the margin of the
    /// lens.
    [[nodiscard]] double pixel_angle_rad() const override;
    [[nodiscard]] double local_pixel_angle_rad(Vec3 direction) const override;
    [[nodiscard]] double field_angle_rad(double margin_px) const override;

private:
    const Projection& lens_;
    Vec3 beta_;
};

} // namespace obscura::renderer
