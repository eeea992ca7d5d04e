// SPDX-License-Identifier: Apache-2.0
// Bounds of a Catmull-Rom surface over a rectangle.
#pragma once

#include <span>

namespace obscura::terrain {

/// Rectangle of sample places.
struct PlaceRectangle {
    double x0, x1, y0, y1;
};

/// Smallest and largest value.
struct CubicBounds {
    double least, largest;
};

/// Bounds of the cubics through a grid of samples (rows of `columns`; sample (0, 0) at place (0, 0)) over
/// `part`, whose cells have all their four by four samples: 1 <= x0 <= x1 <= columns - 2, likewise y. From
/// the Bezier points of the parts of the cells (Farin, Curves and Surfaces for CAGD, 2002, 4.6), which the
/// surface nears with the square of the size of `part`.
[[nodiscard]] CubicBounds cubic_bounds(std::span<const float> samples, int columns,
                                       const PlaceRectangle& part);

} // namespace obscura::terrain
