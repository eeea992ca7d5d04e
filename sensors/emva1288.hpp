// SPDX-License-Identifier: Apache-2.0
// Estimators of EMVA standard 1288, release 4 (2021), linear camera model, from digital numbers only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::sensors::emva1288 {

/// Mean and temporal variance of two images under the same illumination (eqs. 22 and 23), DN and DN^2.
struct PairStatistics {
    double mean = 0, variance = 0;
};
[[nodiscard]] PairStatistics pair_statistics(std::span<const std::uint16_t> a,
                                             std::span<const std::uint16_t> b);

/// One exposure level of the series.
struct Level {
    /// Mean number per pixel; if unknown, any quantity proportional to it.
    double photons = 0;
    PairStatistics bright, dark;
};

/// Parameters estimated from the photon transfer of a series.
struct LinearModel {
    double gain_dn_per_e = 0;              ///< K, section 6.5: slope of variance against mean
    double responsivity_dn_per_photon = 0; ///< R, section 6.4
    double quantum_efficiency = 0;         ///< eta = R / K
    /// Dark noise sigma_d, eq. 42, without quantisation noise; 0 if there is no other.
    double dark_noise_e = 0;
    double saturation_photons = 0, saturation_e = 0; ///< section 6.6
    double linearity_error_percent = 0;              ///< section 6.7, over 5 to 95 % of saturation
    double fit_range = 0.7;       ///< fraction of the saturation over which K and R were fitted
    double threshold_photons = 0; ///< absolute sensitivity threshold, eq. 27
    double dynamic_range_db = 0, snr_max_db = 0;
};

/// Evaluates a series of at least 4 levels with rising photons; throws std::invalid_argument otherwise.
///
/// Saturation is the exposure at which the extrapolated response meets the plateau of the levels beyond it;
/// in a series without such levels it is, as in the standard, the level of the largest variance. If the
/// linearity error exceeds 1 %, K and R are fitted over 20 % of the saturation instead of 70 %.
[[nodiscard]] LinearModel evaluate(std::span<const Level> levels);

/// Mean, temporal variance and spatial variance of a stack of images (section 8.1).
class ImageStack {
public:
    explicit ImageStack(std::size_t pixels) : sum_(pixels), squares_(pixels) {}
    void add(std::span<const std::uint16_t> image);

    [[nodiscard]] double mean() const;
    /// Temporal variance, averaged over the pixels.
    [[nodiscard]] double temporal_variance() const;
    /// Variance over the pixels of their means, corrected for residual temporal noise. Needs at least 2
    /// images.
    [[nodiscard]] double spatial_variance() const;
    /// Mean of pixel i.
    [[nodiscard]] double pixel(std::size_t i) const { return sum_[i] / static_cast<double>(count_); }
    [[nodiscard]] std::size_t pixels() const { return sum_.size(); }

private:
    std::vector<double> sum_, squares_;
    std::size_t count_ = 0;
};

/// Slope of a least-squares line through (x, y).
[[nodiscard]] double slope(std::span<const double> x, std::span<const double> y);

} // namespace obscura::sensors::emva1288
