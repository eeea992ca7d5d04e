// SPDX-License-Identifier: Apache-2.0
// Projection of a model of kind "projection", for one set of parameters and one sensor.
#pragma once

#include "models/kinds/model_parameters.hpp"
#include "models/kinds/projection_graphs.hpp"
#include "models/kinds/start_table.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

namespace obscura::models {

/// Where packets of directions and image points lie: an array for each component.
struct DirectionRows {
    const double *x, *y, *z;
};

/// Both directions of a projection; that which the text does not have is found by Newton's steps from a
/// table. Immutable; thread-safe. Directions are in the camera frame: x right, y down, z boresight.
class ProjectionProgram {
public:
    /// Throws ConfigError `file:line:column: what`.
    ProjectionProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters,
                      const SensorPlane& plane);

    /// Unit directions that image points (px) see, and the solid angles of pixels there, sr: negative for a
    /// mirrored image, 0 where nothing is seen; the direction is then one near it. `lanes` is a multiple of
    /// Program::lane_step. Real-time safe.
    void rays(const double* x, const double* y, const std::array<double*, 3>& direction,
              double* solid_angle_sr, std::size_t lanes) const noexcept;
    /// Image points of directions of any length; NaN where there is none, and for directions farther from the
    /// middle of the field than the sensor with its margin sees: a polynomial could fold them back into the
    /// image. Real-time safe.
    void project(const DirectionRows& direction, double* x, double* y, std::size_t lanes) const noexcept;
    /// As project(), for all directions.
    void project_any(const DirectionRows& direction, double* x, double* y, std::size_t lanes) const noexcept;
    /// Fraction of the light from directions, as the text gives it; 1 without transmission(). Real-time safe.
    void transmission(const DirectionRows& direction, double* fraction, std::size_t lanes) const noexcept;
    [[nodiscard]] bool has_transmission() const noexcept { return transmission_.program != nullptr; }

    /// No direction falls on the sensor.
    [[nodiscard]] bool is_blind() const noexcept { return blind_; }
    /// Middle of the field, and the cosine of the largest angle to it that is projected.
    [[nodiscard]] const std::array<double, 3>& axis() const noexcept { return axis_; }
    [[nodiscard]] double min_cosine() const noexcept { return min_cosine_; }
    /// Newton's steps of the function that is missing; 0: the text has both.
    [[nodiscard]] int newton_steps() const noexcept { return steps_; }
    [[nodiscard]] const SensorPlane& plane() const noexcept { return plane_; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }
    /// From image points to directions, and back.
    [[nodiscard]] const BoundProgram& ray_program() const noexcept { return rays_; }
    [[nodiscard]] const BoundProgram& point_program() const noexcept { return point_; }

private:
    void find_directions(const ModelParameters& parameters);
    void find_points(const ModelParameters& parameters);
    /// An inverse with the least number of Newton's steps that give, for `inputs`, what the largest does.
    [[nodiscard]] BoundProgram
    with_least_steps(const std::function<BoundProgram(int, const ModelParameters&)>& inverse,
                     const std::array<std::vector<double>, 5>& inputs, const ModelParameters& parameters);
    /// From the directions of nodes, and whether they see.
    void find_field_of(const StartTable& directions, const std::vector<bool>& seen);
    /// A unit direction for a lane that sees nothing.
    void nearest_to_axis(const std::array<double*, 3>& direction, std::size_t lane) const noexcept;
    [[nodiscard]] BoundProgram bound(const ProjectionGraph& graph, std::int32_t inputs,
                                     std::string_view function, const ModelParameters& parameters) const;
    /// Coordinates of a direction in the table of points: equal areas about the axis.
    [[nodiscard]] std::array<double, 2> chart(double x, double y, double z) const noexcept;

    std::shared_ptr<const Model> model_;
    SensorPlane plane_;
    BoundProgram rays_, point_, transmission_;
    StartTable directions_; ///< by image point, for a text without ray()
    StartTable points_;     ///< by chart(), for a text without point()
    std::array<double, 3> axis_{0, 0, 1}, right_{1, 0, 0}, down_{0, 1, 0};
    double min_cosine_ = -1;
    int steps_ = 0;
    bool blind_ = false;
};

} // namespace obscura::models
