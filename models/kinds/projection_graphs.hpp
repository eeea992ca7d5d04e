// SPDX-License-Identifier: Apache-2.0
// Graphs of a projection model: the functions of its text, their inverses by Newton's steps, solid angles.
#pragma once

#include "models/kinds/model_parameters.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::models {

/// Pixels in the focal plane. Image points are in pixels; the centre of pixel (i, j) is at (i, j).
struct SensorPlane {
    double focal_length_m = 0;
    std::int32_t width = 0, height = 0;        ///< px
    double margin_px = 32;                     ///< beyond the sensor, that is projected, too
    std::array<double, 2> first_m{};           ///< focal plane at pixel (0, 0), from the axis: right, down
    std::array<double, 2> column_m{}, row_m{}; ///< from a pixel to the next one in its row, in its column

    /// Area of a pixel.
    [[nodiscard]] double pixel_m2() const;
    /// What the rounding of a direction makes of an image point.
    [[nodiscard]] double rounding_px() const;
    /// Largest difference that counts as none.
    [[nodiscard]] double tolerance_px() const { return 1e-9 + rounding_px(); }
};

/// A graph and the nodes of it that are wanted.
struct ProjectionGraph {
    Graph graph;
    std::vector<NodeId> outputs;
};

/// Largest number of Newton's steps that a graph has.
inline constexpr int max_newton_steps = 6;

/// Inputs direction (3, of any length); outputs image point (2). NaN: none. Throws ConfigError.
[[nodiscard]] ProjectionGraph point_graph(const Model& model, const ModelParameters& parameters,
                                          const SensorPlane& plane);
/// The inverse of point(). Inputs image point (2) and a direction near its own (3); outputs unit direction
/// (3), the solid angle of the pixel, sr, negative where the image is a mirrored one and 0 where none of the
/// directions near it has that point, and the squared distance of the point of the direction, px^2. Throws
/// ConfigError.
[[nodiscard]] ProjectionGraph inverse_point_graph(const Model& model, const ModelParameters& parameters,
                                                  const SensorPlane& plane, int steps);

/// Inputs image point (2); outputs as inverse_point_graph() has first: direction (3), solid angle. Throws
/// ConfigError.
[[nodiscard]] ProjectionGraph ray_graph(const Model& model, const ModelParameters& parameters,
                                        const SensorPlane& plane);
/// The inverse of ray(). Inputs direction (3) and a point near its own (2); outputs image point (2), and the
/// squared length of the step that would follow, px^2; NaN where no point near it has that direction. Throws
/// ConfigError.
[[nodiscard]] ProjectionGraph inverse_ray_graph(const Model& model, const ModelParameters& parameters,
                                                const SensorPlane& plane, int steps);

/// Inputs direction (3), output transmission(). Throws ConfigError.
[[nodiscard]] ProjectionGraph transmission_graph(const Model& model, const ModelParameters& parameters,
                                                 const SensorPlane& plane);

} // namespace obscura::models
