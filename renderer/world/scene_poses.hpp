// SPDX-License-Identifier: Apache-2.0
// Poses of a scene's camera and bodies over time and where bodies are in the picture, without their shapes.
#pragma once

#include "core/geometry.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <memory>
#include <optional>

namespace obscura::renderer {

/// How the camera sees the centre of a body.
struct BodyView {
    Pose pose;            ///< inertial; with Scene::light_time when the light left it
    double range_m = 0;   ///< from the camera to the centre
    double phase_rad = 0; ///< angle at the centre between Sun and camera; 0 for the Sun
    /// Angle between the boresight and the direction in which the centre is seen.
    double off_axis_rad = 0;
    std::optional<ImagePoint> pixel{}; ///< on the sensor; empty: outside the field of the lens
};

/// Geometry of a scene without meshes, materials and stars: made at once, whatever the scene holds.
/// Immutable, thread-safe.
class ScenePoses {
public:
    /// Throws ConfigError if the camera is invalid.
    explicit ScenePoses(scene::Scene scene);
    ~ScenePoses();
    ScenePoses(ScenePoses&&) noexcept;
    ScenePoses& operator=(ScenePoses&&) noexcept;

    [[nodiscard]] const scene::Scene& scene() const noexcept;
    [[nodiscard]] Pose camera(double time_s) const;
    /// Velocity by which the directions are turned, inertial; zero without Scene::aberration.
    [[nodiscard]] Vec3 camera_velocity_m_s(double time_s) const;
    /// Body `index` of the scene.
    [[nodiscard]] BodyView body(std::size_t index, double time_s) const;
    [[nodiscard]] BodyView sun(double time_s) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace obscura::renderer
