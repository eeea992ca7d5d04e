// SPDX-License-Identifier: Apache-2.0
// Gaussian PSF integrated over square or rectangular pixels.
#pragma once

#include "renderer/packets/packet.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Response along one axis, in pixels. A camera sample of a pixel is displaced by offset(u); a point source
/// at x gives pixel i the fraction weight(x, i). Both describe the same response. sigma 0: the pixel alone.
class GaussianAxis {
public:
    explicit GaussianAxis(double sigma_px);

    /// Inverse CDF of the pixel response along one axis: a box of 1 px convolved with the Gaussian.
    /// Tabulated; the outermost 1/2048 of the light ends at the quantile 1/32768.
    void offsets(const Doubles& u, Doubles& offset) const;
    [[nodiscard]] double sigma_px() const { return sigma_px_; }
    /// Largest |offset|.
    [[nodiscard]] double reach_px() const { return reach_px_; }

    /// Fraction of the light of a point at `x` (pixel centres at integers) that falls into pixel `i`.
    [[nodiscard]] double weight(double x, std::int32_t i) const;
    /// Fills `weights` with those of the pixels from `first` on, from a table: within 1e-10 of weight().
    void weights(double x, std::int32_t first, std::span<double> weights) const;
    /// Beyond this distance from a pixel's centre weight() is below 1e-10.
    [[nodiscard]] double splat_reach_px() const { return 0.5 + 6.5 * sigma_px_; }

private:
    void make_weights();

    double sigma_px_;
    double reach_px_;
    std::vector<float> quantiles_;
    /// Weights of points at `positions_` places of a pixel and one at its end, each with the weights of
    /// `columns_` pixels, the point's own after `before_` others, and then their slopes from place to place.
    /// Empty: the PSF is narrower.
    std::vector<double> weights_;
    double positions_ = 0;
    std::int32_t before_ = 0, columns_ = 0;
};

/// The responses along columns and rows; the PSF is their product. Round on the focal plane.
struct GaussianPsf {
    /// `sigma_px` is in pitches of the columns, `aspect` the pitch of the rows over that of the columns.
    explicit GaussianPsf(double sigma_px, double aspect = 1) : x(sigma_px), y(sigma_px / aspect) {}

    GaussianAxis x, y;

    /// Largest offset along an axis.
    [[nodiscard]] double reach_px() const { return std::max(x.reach_px(), y.reach_px()); }
    /// Largest distance along an axis at which a point gives a pixel light.
    [[nodiscard]] double splat_reach_px() const { return std::max(x.splat_reach_px(), y.splat_reach_px()); }
};

} // namespace obscura::renderer
