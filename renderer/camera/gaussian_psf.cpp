// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/gaussian_psf.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

constexpr int intervals = 2048;

double normal_cdf(double z) {
    return 0.5 * std::erfc(-z * (1 / std::numbers::sqrt2));
}

/// Integral of normal_cdf().
double normal_cdf_integral(double z) {
    return z * normal_cdf(z) + std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
}

/// Response of a pixel of width 1 through a Gaussian.
struct Response {
    double pdf, cdf;
};

Response response(double x, double sigma) {
    const double above = (x + 0.5) / sigma, below = (x - 0.5) / sigma;
    return {normal_cdf(above) - normal_cdf(below),
            sigma * (normal_cdf_integral(above) - normal_cdf_integral(below))};
}

/// Quantile of the response at p, searched upwards from `low` by Newton steps; bisection where a step leaves
/// the bracket.
double response_quantile(double p, double sigma, double low) {
    double high = 0.5 + 9 * sigma;
    double x = low;
    for (int i = 0; i < 100; ++i) {
        const Response at = response(x, sigma);
        (at.cdf < p ? low : high) = x;
        double next = x - (at.cdf - p) / at.pdf;
        if (std::abs(next - x) < 1e-9 * sigma) return next; // the error after a step is quadratic in it
        if (!(next > low && next < high)) next = (low + high) / 2;
        x = next;
    }
    return x;
}

OBSCURA_VECTOR_CLONES
void interpolate_table(const float* table, const Doubles& u, Doubles& offset) {
    for (int i = 0; i < packet_size; ++i) {
        const double position = u.v[i] * intervals;
        const auto cell = static_cast<std::int32_t>(position);
        const double a = table[cell];
        const double b = table[cell + 1];
        offset.v[i] = a + (b - a) * (position - cell);
    }
}

/// Narrower PSFs would need large tables.
constexpr double min_tabulated_px = 0.02;

/// Hermite's cubic at `t` between the values and slopes `a` and `b`, `stride` apart, of `count` pixels.
OBSCURA_VECTOR_CLONES
void interpolate_weights(const double* a, const double* b, std::size_t stride, double t, std::size_t count,
                         double* weights) {
    const double slope_a = t * (1 - t) * (1 - t), slope_b = t * t * (t - 1);
    const double later = t * t * (3 - 2 * t);
    for (std::size_t i = 0; i < count; ++i)
        weights[i] = a[i] + later * (b[i] - a[i]) + slope_a * a[i + stride] + slope_b * b[i + stride];
}

} // namespace

GaussianAxis::GaussianAxis(double sigma_px) : sigma_px_(sigma_px), reach_px_(0.5), quantiles_(intervals + 1) {
    double quantile = -0.5 - 9 * sigma_px;
    for (int i = 0; i <= intervals / 2; ++i) {
        const double p = i == 0 ? 1.0 / (16 * intervals) : static_cast<double>(i) / intervals;
        quantile = sigma_px > 0 ? response_quantile(p, sigma_px, quantile)
                                : static_cast<double>(i) / intervals - 0.5;
        quantiles_[static_cast<std::size_t>(i)] = static_cast<float>(quantile);
        quantiles_[static_cast<std::size_t>(intervals - i)] = static_cast<float>(-quantile);
    }
    quantiles_[intervals / 2] = 0;
    reach_px_ = -static_cast<double>(quantiles_[0]);
    if (sigma_px >= min_tabulated_px) make_weights();
}

void GaussianAxis::offsets(const Doubles& u, Doubles& offset) const {
    interpolate_table(quantiles_.data(), u, offset);
}

double GaussianAxis::weight(double x, std::int32_t i) const {
    const double d = i - x;
    if (sigma_px_ == 0) return d > -0.5 && d <= 0.5 ? 1 : 0;
    return normal_cdf((d + 0.5) / sigma_px_) - normal_cdf((d - 0.5) / sigma_px_);
}

void GaussianAxis::make_weights() {
    // The error of the cubics is h^4 / 384 times the fourth derivative, 1.1 / sigma^4 at most: 7e-11.
    positions_ = std::max(16.0, std::ceil(80 / sigma_px_));
    before_ = static_cast<std::int32_t>(std::ceil(splat_reach_px()));
    columns_ = 2 * before_ + 2;
    const auto slope = [&](double d) {
        const double z = d / sigma_px_;
        return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi) / sigma_px_;
    };
    for (double k = 0; k <= positions_; ++k) {
        const double at = k / positions_;
        for (std::int32_t c = 0; c < columns_; ++c)
            weights_.push_back(weight(at, c - before_));
        for (std::int32_t c = 0; c < columns_; ++c) {
            const double d = c - before_ - at;
            weights_.push_back((slope(d - 0.5) - slope(d + 0.5)) / positions_);
        }
    }
}

void GaussianAxis::weights(double x, std::int32_t first, std::span<double> weights) const {
    if (weights_.empty()) {
        for (std::size_t i = 0; i < weights.size(); ++i)
            weights[i] = weight(x, first + static_cast<std::int32_t>(i));
        return;
    }
    const double pixel = std::floor(x);
    const double position = (x - pixel) * positions_;
    const double cell = std::min(std::floor(position), positions_ - 1);
    const auto columns = static_cast<std::size_t>(columns_);
    const double* const a = weights_.data() + static_cast<std::size_t>(cell) * 2 * columns;
    // Pixels of the table among those that are asked for.
    const std::int64_t offset = first - (static_cast<std::int64_t>(pixel) - before_);
    const auto size = static_cast<std::int64_t>(weights.size());
    const std::int64_t begin = std::clamp<std::int64_t>(-offset, 0, size);
    const std::int64_t end = std::clamp<std::int64_t>(columns_ - offset, begin, size);
    std::fill(weights.begin(), weights.begin() + begin, 0);
    if (end > begin)
        interpolate_weights(a + offset + begin, a + 2 * columns + offset + begin, columns, position - cell,
                            static_cast<std::size_t>(end - begin), weights.data() + begin);
    std::fill(weights.begin() + end, weights.end(), 0);
}

} // namespace obscura::renderer
