// SPDX-License-Identifier: Apache-2.0
// Gaussian PSF integrated over square pixels.
#pragma once

#include "renderer/packets/packet.hpp"

#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Separable, in pixels. A camera sample of a pixel is displaced by offset(u), offset(v); a point source at x
/// gives pixel i the fraction weight(x, i) along each axis. Both describe the same response. sigma 0: the
/// square of the pixel alone.
class GaussianPsf {
public:
    explicit GaussianPsf(double sigma_px);

    /// Inverse CDF of the pixel response along one axis: a box of 1 px convolved with the Gaussian.
    /// Tabulated; the outermost 1/2048 of the light ends at the quantile 1/32768.
    void offsets(const Doubles& u, Doubles& offset) const;
    [[nodiscard]] double sigma_px() const { return sigma_px_; }
    /// Largest |offset|.
    [[nodiscard]] double reach_px() const { return reach_px_; }

    /// Fraction of the light of a point at `x` (pixel centres at integers) that falls into pixel `i`.
    [[nodiscard]] double weight(double x, std::int32_t i) const;
    /// Beyond this distance from a pixel's centre weight() is below 1e-10.
    [[nodiscard]] double splat_reach_px() const { return 0.5 + 6.5 * sigma_px_; }

private:
    double sigma_px_;
    double reach_px_;
    std::vector<float> quantiles_;
};

} // namespace obscura::renderer
