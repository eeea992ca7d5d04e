// SPDX-License-Identifier: Apache-2.0
// Stellar aberration: how the observer's motion turns the directions that light comes from.
#pragma once

#include "renderer/camera/projection.hpp"

namespace obscura::renderer {

constexpr double light_speed_m_s = 299'792'458.0;

/// The unit direction in which an observer who moves with `beta` (velocity over that of light, in the same
/// frame) sees what lies in the unit direction `d` for one at rest. The way back is the same with -beta.
/// Special relativity: the component along the motion is cos t' = (cos t + beta) / (1 + beta cos t).
[[nodiscard]] Vec3 aberrate(Vec3 d, Vec3 beta);

/// A lens in motion: directions are those for an observer at rest, in camera axes. Brightness stays as it is;
/// the change, as the fourth power of the Doppler factor, is 4 parts in 10,000 on Earth's orbit.
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
    /// Angles at rest are larger than those seen by up to 1 + beta: far less than what the lens adds for
    /// safety.
    [[nodiscard]] double pixel_angle_rad() const override;
    [[nodiscard]] double local_pixel_angle_rad(Vec3 direction) const override;
    [[nodiscard]] double field_angle_rad(double margin_px) const override;

private:
    const Projection& lens_;
    Vec3 beta_;
};

} // namespace obscura::renderer
