// SPDX-License-Identifier: Apache-2.0
// Pictures and tables of a projection: grid of angles, pixel angles, residuals.
#pragma once

#include "models/kinds/projection_program.hpp"
#include "tools/pictures/figure.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Image points with their directions; those that see nothing have a solid angle of 0.
struct ProjectedPoints {
    std::vector<double> x, y;        ///< px
    std::vector<double> dx, dy, dz;  ///< unit directions
    std::vector<double> solid_angle; ///< sr; negative: mirrored
    std::vector<double> residual_px; ///< distance of the image point of the direction

    ProjectedPoints(const models::ProjectionProgram& projection, std::vector<double> columns,
                    std::vector<double> rows);
    [[nodiscard]] bool sees(std::size_t i) const { return solid_angle[i] != 0; }
    [[nodiscard]] double angle_deg(std::size_t i) const;   ///< to the boresight
    [[nodiscard]] double azimuth_deg(std::size_t i) const; ///< right to down
};

/// The sensor with lines of equal angles to the boresight, every 10 degrees, and of azimuths; and the angle
/// that a pixel subtends.
[[nodiscard]] Canvas projection_maps(const models::ProjectionProgram& projection);

/// SVG document: image of the same lines; pixel angle and residual of the inverse over the angle.
[[nodiscard]] std::string projection_svg(const models::ProjectionProgram& projection, std::string_view title);

/// CSV with columns x_px, y_px, direction_x, direction_y, direction_z, solid_angle_sr, residual_px: 33 x 33
/// points that see something.
[[nodiscard]] std::string projection_csv(const models::ProjectionProgram& projection);

} // namespace obscura::tools
