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
    /// Variance over the pixels of the mean of the two images, less the temporal noise that is left in it,
    /// DN^2: the fixed pattern. Negative where noise exceeds the pattern.
    double spatial_variance = 0;
};
[[nodiscard]] PairStatistics pair_statistics(std::span<const std::uint16_t> a,
                                             std::span<const std::uint16_t> b);

/// One exposure level of the series.
struct Level {
    /// Mean number per pixel; if unknown, any quantity proportional to it.
    double photons = 0;
    PairStatistics bright, dark;
};

/// Least variance from which temporal noise can be told from quantisation noise, DN^2 (release 3.1,
/// section 6.6).
constexpr double min_variance_dn2 = 0.24;
/// Standard deviation that takes the place of a smaller measured one, DN: an upper limit (ibid.).
constexpr double limit_of_noise_dn = 0.49;

/// Temporal dark noise in DN and, without quantisation noise, in e- (eq. 42).
struct DarkNoise {
    double dn = 0;
    double electrons = 0;
    /// Both are upper limits, 0.49 DN and 0.40 DN / K: the variance is below min_variance_dn2.
    bool upper_limit = false;
};
/// Dark noise from the temporal variance of dark images, in DN^2. With a gain of 1 `electrons` is in DN.
[[nodiscard]] DarkNoise dark_noise(double variance_dn2, double gain_dn_per_e);

/// Parameters estimated from the photon transfer of a series.
struct LinearModel {
    double gain_dn_per_e = 0;              ///< K, section 6.5: slope of variance against mean
    double responsivity_dn_per_photon = 0; ///< R, section 6.4
    double quantum_efficiency = 0;         ///< eta = R / K
    DarkNoise dark_noise;
    double saturation_photons = 0, saturation_e = 0; ///< section 6.6
    double saturation_signal_dn = 0;                 ///< mean at saturation, less the dark mean
    double linearity_error_percent = 0;              ///< LE, section 6.7, over 5 to 95 % of saturation
    /// The line that LE counts from: mean less dark = offset + slope * photons.
    double linearity_offset_dn = 0, linearity_slope_dn_per_photon = 0;
    double fit_range = 0.7;       ///< fraction of the saturation over which K and R were fitted
    double threshold_photons = 0; ///< absolute sensitivity threshold, eq. 27
    double dynamic_range_db = 0, snr_max_db = 0;
};

/// Fixed pattern of a sensor: DSNU1288 in e-, PRNU1288 as a fraction of the signal; 0 where unknown.
struct Nonuniformity {
    double dsnu_e = 0, prnu = 0;
};
/// Signal-to-noise ratio of the linear model at `photons` per pixel (release 4, section 2.4), and with a
/// fixed pattern the total one, in which the pattern counts as noise.
[[nodiscard]] double model_snr(const LinearModel& model, double photons, const Nonuniformity& pattern = {});

enum class Method {
    /// As the standard prescribes: saturation is the level of the largest temporal variance, and K and R are
    /// fitted over 70 % of it.
    standard,
    /// For dense series that run well into saturation: saturation is the exposure at which the extrapolated
    /// response meets the plateau, where PRNU does not blur it; without a plateau as in the standard. If the
    /// linearity error exceeds 1 %, K and R are fitted over 20 % of the saturation instead of 70 %.
    full_well,
};

/// Evaluates a series of at least 4 levels with rising photons (`standard`: or equal ones).
/// `dark_variance_dn2` is the temporal variance of dark images; if negative, that of the first level is
/// taken. Throws std::invalid_argument for fewer levels, or if quantisation hides the temporal noise of all
/// levels, so that K cannot be determined.
[[nodiscard]] LinearModel evaluate(std::span<const Level> levels, Method method,
                                   double dark_variance_dn2 = -1);

/// Spatial variance by what it varies with (release 4): from column to column, from row to row, and from
/// pixel to pixel beyond these. Any may be negative where noise exceeds it.
struct SpatialVariances {
    double column = 0, row = 0, pixel = 0;
};
[[nodiscard]] SpatialVariances operator-(const SpatialVariances& a, const SpatialVariances& b);
/// Splits the variance of a row-major image of `width` columns; needs 2 columns and 3 rows, or the reverse.
[[nodiscard]] SpatialVariances split_variance(std::span<const double> values, std::size_t width);

/// Mean, temporal variance and spatial variance of a stack of images (section 8.1).
class ImageStack {
public:
    explicit ImageStack(std::size_t pixels) : sum_(pixels), squares_(pixels) {}
    void add(std::span<const std::uint16_t> image);

    [[nodiscard]] double mean() const;
    /// Temporal variance, averaged over the pixels.
    [[nodiscard]] double temporal_variance() const;
    /// Variance over the pixels of their means, corrected for residual temporal noise: `temporal` is the
    /// temporal variance of one image. Negative where noise exceeds the pattern.
    [[nodiscard]] double spatial_variance(double temporal) const;
    /// The same with the temporal variance of the stack itself. Needs at least 2 images.
    [[nodiscard]] double spatial_variance() const { return spatial_variance(temporal_variance()); }
    /// Spatial variance in parts, for images of `width` columns.
    [[nodiscard]] SpatialVariances spatial_parts(std::size_t width, double temporal) const;
    [[nodiscard]] SpatialVariances spatial_parts(std::size_t width) const {
        return spatial_parts(width, temporal_variance());
    }
    /// Mean of pixel i.
    [[nodiscard]] double pixel(std::size_t i) const { return sum_[i] / static_cast<double>(count_); }
    [[nodiscard]] std::size_t pixels() const { return sum_.size(); }

private:
    std::vector<double> sum_, squares_;
    std::size_t count_ = 0;
};

/// Least-squares line through (x, y), of which two x differ.
struct Line {
    double slope = 0, offset = 0;
};
[[nodiscard]] Line fit_line(std::span<const double> x, std::span<const double> y);

} // namespace obscura::sensors::emva1288
