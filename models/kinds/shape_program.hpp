// SPDX-License-Identifier: Apache-2.0
// Surface of a model of kind "shape", for one set of parameters.
#pragma once

#include "core/geometry.hpp"
#include "models/kinds/model_parameters.hpp"
#include "models/kinds/shape_cells.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <string_view>

namespace obscura::models {

/// Parameters of a shape, and what its scene says besides.
struct ShapeParameters : ModelParameters {
    Vec3 radii_m{}; ///< of the ellipsoid under height(); 0 with outside()
};

/// The function that is positive outside, its gradient and the cells of its bounding ball. A height() over an
/// ellipsoid becomes |p| - (distance of the ellipsoid along p) - height. Immutable; thread-safe.
class ShapeProgram {
public:
    /// Throws ConfigError `file:line:column: what`, also for a slope without a bound.
    ShapeProgram(std::shared_ptr<const Model> model, const ShapeParameters& parameters);

    /// Radius of the ball about the origin that has the surface.
    [[nodiscard]] double bounding_radius_m() const noexcept { return radius_m_; }
    /// Value and gradient at `lanes` points, a multiple of Program::lane_step: inputs are rows of x, y and z,
    /// outputs rows of the value and of its derivatives. Real-time safe.
    void run(const std::array<const double*, 3>& points, const std::array<double*, 4>& outputs,
             std::size_t lanes) const noexcept {
        bound_.program->run(bound_.uniforms, points.data(), outputs.data(), lanes);
    }
    [[nodiscard]] const ShapeCells& cells() const noexcept { return *cells_; }

    /// The slope that the text claims by its property `lipschitz`; 0: bounds come of interval arithmetic.
    [[nodiscard]] double claimed_slope() const noexcept { return claimed_slope_; }
    /// "outside" or "height".
    [[nodiscard]] std::string_view function() const noexcept { return function_; }
    [[nodiscard]] Place place() const noexcept { return model_->function(function_)->at; }
    [[nodiscard]] const Model& model() const noexcept { return *model_; }
    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }

private:
    [[nodiscard]] NodeId graph_of_heights(Graph& graph, const ShapeParameters& parameters,
                                          std::span<const double> uniforms);
    [[nodiscard]] double radius_of_text(const ShapeParameters& parameters) const;
    void bound_slopes(const Graph& graph, NodeId value, std::span<const double> uniforms);
    /// Bounds of the gradient over a box from its values at points of it, doubled.
    void measure_slopes(const std::array<Interval, 3>& box, SlopeBounds& bounds) const;

    std::shared_ptr<const Model> model_;
    std::string_view function_;
    double radius_m_ = 0;
    /// Within this, all is inside, and about the axis of height() slopes are measured: 0 with outside().
    double core_m_ = 0, axis_m_ = 0;
    double claimed_slope_ = 0;
    BoundProgram bound_;
    std::unique_ptr<const ShapeCells> cells_;
};

} // namespace obscura::models
