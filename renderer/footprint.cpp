#include "renderer/footprint.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

constexpr int intervals = 2048;

double normal_cdf(double z) {
    return 0.5 * std::erfc(-z * (1 / std::numbers::sqrt2));
}

/// Integral of normal_cdf.
double normal_cdf_integral(double z) {
    return z * normal_cdf(z) + std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
}

/// Cumulative response of a pixel of width 1 through a Gaussian.
double response_cdf(double x, double sigma) {
    return sigma * (normal_cdf_integral((x + 0.5) / sigma) - normal_cdf_integral((x - 0.5) / sigma));
}

double response_quantile(double p, double sigma) {
    double low = -0.5 - 9 * sigma;
    double high = 0.5 + 9 * sigma;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (response_cdf(middle, sigma) < p ? low : high) = middle;
    }
    return (low + high) / 2;
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

} // namespace

Footprint::Footprint(double sigma_px) : sigma_px_(sigma_px), reach_px_(0.5), quantiles_(intervals + 1) {
    for (int i = 0; i <= intervals / 2; ++i) {
        const double p = i == 0 ? 1.0 / (16 * intervals) : static_cast<double>(i) / intervals;
        const double x =
            sigma_px > 0 ? response_quantile(p, sigma_px) : static_cast<double>(i) / intervals - 0.5;
        quantiles_[static_cast<std::size_t>(i)] = static_cast<float>(x);
        quantiles_[static_cast<std::size_t>(intervals - i)] = static_cast<float>(-x);
    }
    quantiles_[intervals / 2] = 0;
    reach_px_ = -static_cast<double>(quantiles_[0]);
}

void Footprint::offsets(const Doubles& u, Doubles& offset) const {
    interpolate_table(quantiles_.data(), u, offset);
}

double Footprint::weight(double x, std::int32_t i) const {
    const double d = i - x;
    if (sigma_px_ == 0) return d > -0.5 && d <= 0.5 ? 1 : 0;
    return normal_cdf((d + 0.5) / sigma_px_) - normal_cdf((d - 0.5) / sigma_px_);
}

} // namespace obscura::renderer
