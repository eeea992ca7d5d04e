// SPDX-License-Identifier: Apache-2.0
// Projection that a user has written in SuMoL.
#pragma once

#include "models/kinds/projection_program.hpp"
#include "renderer/camera/projection.hpp"

#include <string>
#include <vector>

namespace obscura::renderer {

/// The sensor of a camera in the focal plane, with the margin that is projected.
[[nodiscard]] models::SensorPlane sensor_plane(const scene::Camera& camera);

/// The model of a camera whose projection is one. Throws ConfigError: it has none, or one that cannot be run.
[[nodiscard]] models::ProjectionProgram projection_program(const scene::Camera& camera);

/// Runs point() and ray() of a model, and their inverses. Transmissions outside of 0..1 count as 0.
class ModelProjection final : public Projection {
public:
    /// Throws ConfigError: there is no model, or it is no projection of this sensor.
    explicit ModelProjection(const scene::Camera& camera);

    void rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const override;
    [[nodiscard]] double solid_angle_sr(double x, double y) const override;
    [[nodiscard]] std::optional<ImagePoint> project(Vec3 direction) const override;
    [[nodiscard]] double transmission(Vec3 direction) const override;
    [[nodiscard]] double pixel_angle_rad() const override { return pixel_angle_rad_; }
    [[nodiscard]] double local_pixel_angle_rad(Vec3 direction) const override;
    [[nodiscard]] double field_angle_rad(double margin_px) const override;

private:
    void set_pixel_angle();

    models::ProjectionProgram program_;
    bool pupil_cosine_;
    double finer_rad_; ///< the shorter pitch over the focal length
    double pixel_angle_rad_ = 0;
};

/// What users should know of the projection of `camera`, a line each, without a full stop; none if it is
/// built in.
[[nodiscard]] std::vector<std::string> model_projection_warnings(const scene::Camera& camera);

} // namespace obscura::renderer
