// SPDX-License-Identifier: Apache-2.0
// How a real lens departs from its ideal projection, and the way back.
#pragma once

#include "renderer/scene/scene.hpp"

#include <optional>
#include <vector>

namespace obscura::renderer {

/// A point of the focal plane over the focal length, from the optical axis; x right, y down.
struct PlanePoint {
    double x = 0, y = 0;
};

/// Immutable; any thread may call any member.
class Distortion {
public:
    /// Throws ConfigError when coefficients or table cannot be.
    Distortion(const scene::Distortion& d, double focal_length_m);

    /// Where the lens really forms the image of an ideal point. Nothing where it has none: beyond a table, or
    /// where the polynomial of the way back has no inverse.
    [[nodiscard]] std::optional<PlanePoint> real(PlanePoint ideal) const;
    /// The ideal point whose image is there, and how much of the ideal plane's area belongs to one unit of
    /// the real one.
    [[nodiscard]] std::optional<PlanePoint> ideal(PlanePoint real, double& area_ratio) const;

private:
    /// The direction in which the model is a formula, and the one in which it must be inverted.
    [[nodiscard]] PlanePoint formula(PlanePoint p) const;
    [[nodiscard]] std::optional<PlanePoint> inverse(PlanePoint target, double& determinant) const;
    /// Matrix of derivatives of the formula, by differences.
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
