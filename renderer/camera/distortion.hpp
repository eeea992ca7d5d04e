// SPDX-License-Identifier: Apache-2.0
// Lens distortion: from ideal to real image points, and the inverse.
#pragma once

#include "renderer/scene/scene.hpp"

#include <optional>
#include <vector>

namespace obscura::renderer {

/// Point of the focal plane over the focal length, from the optical axis; x right, y down.
struct PlanePoint {
    double x = 0, y = 0;
};

/// Immutable; thread-safe.
class Distortion {
public:
    /// Throws ConfigError if coefficients or table are invalid.
    Distortion(const scene::Distortion& d, double focal_length_m);

    /// Real image point of an ideal one. Empty where there is none: beyond a table, or where the polynomial
    /// has no inverse.
    [[nodiscard]] std::optional<PlanePoint> real(PlanePoint ideal) const;
    /// Ideal point of a real one, and the area of the ideal plane per unit of area of the real one.
    [[nodiscard]] std::optional<PlanePoint> ideal(PlanePoint real, double& area_ratio) const;

private:
    /// The model as the formula states it, and its inverse.
    [[nodiscard]] PlanePoint formula(PlanePoint p) const;
    [[nodiscard]] std::optional<PlanePoint> inverse(PlanePoint target, double& determinant) const;
    /// Jacobian matrix of the formula, by differences.
    struct Derivatives {
        double xx, xy, yx, yy;
        [[nodiscard]] double determinant() const { return xx * yy - xy * yx; }
    };
    [[nodiscard]] Derivatives derivatives(PlanePoint p) const;
    [[nodiscard]] static std::optional<PlanePoint> look_up(PlanePoint p, const std::vector<double>& from,
                                                           const std::vector<double>& slopes,
                                                           const std::vector<double>& to);

    scene::Distortion::Model model_;
    double k_[12] = {};
    std::vector<double> ideal_, real_; ///< radii of the table over the focal length
    std::vector<double> slopes_;
};

} // namespace obscura::renderer
