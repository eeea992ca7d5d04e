// SPDX-License-Identifier: Apache-2.0
// Standard errors of image fits from their residual: texture, shape and shading that two images do not share.
#pragma once

#include "images/image.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace obscura::tools {

/// Covariance of the slopes of the correlation with respect to the parameters of a fit.
struct ResidualScatter {
    std::vector<double> covariance; ///< parameters x parameters, row-major
    /// Number of independent cells of the residual: the area over the area of one correlation cell.
    double cells = 0;

    /// Factor on variances for the part of the residual that the fit of `parameters` parameters, scale and
    /// offset absorbed. Bounded where fewer cells than parameters are left.
    [[nodiscard]] double small_sample_factor(std::size_t parameters) const;
};

/// The residual normalised_difference(`a`, `b`) is taken for a part of a random field that is stationary over
/// the bodies in the images (pixels that differ from the median by more than 2 % of the largest difference).
/// The field's autocovariance C is estimated from the residual, so the covariance of the slopes is the sum of
/// gradient(p) C(p - q) gradient(q) over all pixels p and q. Blocks of pixels stand for pixels if the bodies
/// extend over more than 64. `gradients`: derivatives of the normalised difference.
[[nodiscard]] ResidualScatter residual_scatter(const images::Image& a, const images::Image& b,
                                               std::span<const images::Image> gradients);

/// Two images at a fit, and normalised differences with each parameter moved by `step` up and down.
struct FittedImages {
    const images::Image &a, &b;
    std::vector<images::Image> plus, minus;
    double step;
};

/// Variances of the fitted parameters: inverse curvature times scatter of the slopes times inverse curvature
/// (sandwich form, White 1982). Of two estimates of the scatter the larger is taken for each parameter:
/// between the blocks of a grid, for differences that stand in few places, and residual_scatter(), for
/// differences that extend over blocks. `inverse_curvature`: of minus the correlation, row-major.
[[nodiscard]] std::vector<double> fit_variances(const FittedImages& fit,
                                                std::span<const double> inverse_curvature);

} // namespace obscura::tools
