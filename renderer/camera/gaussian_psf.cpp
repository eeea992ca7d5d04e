// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/gaussian_psf.hpp"

#include <algorithm>
#include <array>
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

/// normal_cdf() from a table: cubic between values and slopes, error below 5e-11.
class NormalCdf {
public:
    NormalCdf() {
        for (std::size_t i = 0; i < values_.size(); ++i) {
            const double z = static_cast<double>(i) / per_unit - limit;
            values_[i] = {normal_cdf(z), std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi) / per_unit};
        }
    }
    [[nodiscard]] double operator()(double z) const {
        const double at = std::clamp((z + limit) * per_unit, 0.0, 2.0 * limit * per_unit - 1e-9);
        const auto cell = static_cast<std::size_t>(at);
        const double t = at - static_cast<double>(cell);
        const Node& a = values_[cell];
        const Node& b = values_[cell + 1];
        // Hermite's cubic.
        const double rise = b.value - a.value;
        return a.value +
               t * (a.slope + t * (3 * rise - 2 * a.slope - b.slope + t * (a.slope + b.slope - 2 * rise)));
    }

private:
    static constexpr double limit = 8; ///< beyond it the CDF is 0 or 1 within 1e-15
    static constexpr double per_unit = 128;
    struct Node {
        double value, slope;
    };
    std::array<Node, static_cast<std::size_t>(2 * limit * per_unit) + 1> values_;
};

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
}

void GaussianAxis::offsets(const Doubles& u, Doubles& offset) const {
    interpolate_table(quantiles_.data(), u, offset);
}

double GaussianAxis::weight(double x, std::int32_t i) const {
    const double d = i - x;
    if (sigma_px_ == 0) return d > -0.5 && d <= 0.5 ? 1 : 0;
    return normal_cdf((d + 0.5) / sigma_px_) - normal_cdf((d - 0.5) / sigma_px_);
}

void GaussianAxis::weights(double x, std::int32_t first, std::span<double> weights) const {
    if (sigma_px_ == 0) {
        for (std::size_t i = 0; i < weights.size(); ++i)
            weights[i] = weight(x, first + static_cast<std::int32_t>(i));
        return;
    }
    static const NormalCdf cdf;
    const double per_sigma = 1 / sigma_px_;
    const double from = first - 0.5 - x;
    double before = cdf(from * per_sigma);
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const double after = cdf((from + static_cast<double>(i + 1)) * per_sigma);
        weights[i] = after - before;
        before = after;
    }
}

} // namespace obscura::renderer
