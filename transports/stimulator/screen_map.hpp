// SPDX-License-Identifier: Apache-2.0
// Geometric map from screen pixels to camera pixels: homography plus residual distortion.
#pragma once

#include <array>
#include <vector>

namespace obscura::transports {

/// A point in pixels; (0,0) is the centre of the first pixel.
struct PixelPoint {
    double x = 0, y = 0;
};

/// 3x3 homography, row-major: screen (x, y, 1) to camera (u w, v w, w).
struct Homography {
    std::array<double, 9> h{1, 0, 0, 0, 1, 0, 0, 0, 1};
    [[nodiscard]] PixelPoint operator()(PixelPoint p) const;
};

/// Residual distortion: camera position minus homography, in camera pixels, at the nodes of a regular grid on
/// the screen. Interpolated by Catmull-Rom splines (Keys 1981, a = -1/2), which reproduce polynomials up to
/// the second degree. Empty: none.
struct DistortionGrid {
    int columns = 0, rows = 0;
    double x0 = 0, y0 = 0, step = 1; ///< screen position of node (0,0) and distance of nodes, pixels
    std::vector<float> du, dv;       ///< row-major, columns * rows each

    [[nodiscard]] bool empty() const { return columns == 0; }
    /// Points outside of the grid get the value at its edge.
    [[nodiscard]] PixelPoint operator()(PixelPoint p) const;
};

/// Map from screen position to camera position: homography plus residual distortion.
struct ScreenMap {
    Homography homography;
    DistortionGrid distortion;
    /// Camera position at which screen position `p` is seen.
    [[nodiscard]] PixelPoint operator()(PixelPoint p) const;
    /// Screen position that is seen at camera position `c`, by Newton's method from the homography's inverse.
    /// Accurate to 1e-6 pixels for any one-to-one map.
    [[nodiscard]] PixelPoint inverse(PixelPoint c) const;
};

/// Fits the homography that maps from[i] to to[i] with the least squared algebraic error, by Hartley's
/// normalised DLT. Needs at least 4 points, no three in line; returns false if they do not determine one.
[[nodiscard]] bool fit_homography(const std::vector<PixelPoint>& from, const std::vector<PixelPoint>& to,
                                  Homography& result);
/// The inverse matrix; the homography must have one.
[[nodiscard]] Homography inverse(const Homography& homography);

} // namespace obscura::transports
