// SPDX-License-Identifier: Apache-2.0
#include "tools/compare/registration_error.hpp"

#include "tools/compare/registration_math.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace obscura::tools {
namespace {

using images::Image;

/// Marks the pixels that differ from the median by more than 2 % of the largest difference.
void mark_bodies(const Image& image, const Image& difference, std::vector<bool>& marked) {
    std::vector<double> values;
    for (std::size_t i = 0; i < image.values.size(); ++i)
        if (!std::isnan(difference.values[i])) values.push_back(image.values[i]);
    if (values.empty()) return;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    const double median = *middle;
    double largest = 0;
    for (const double v : values)
        largest = std::max(largest, std::abs(v - median));
    for (std::size_t i = 0; i < image.values.size(); ++i)
        if (!std::isnan(difference.values[i]) && std::abs(image.values[i] - median) > 0.02 * largest)
            marked[i] = true;
}

/// Sums over blocks of pixels within the marked region's bounding box.
class Blocks {
public:
    Blocks(const Image& image, const std::vector<bool>& marked) : width_(image.width), marked_(marked) {
        std::int32_t right = -1, bottom = -1;
        left_ = image.width, top_ = image.height;
        for (std::int32_t y = 0; y < image.height; ++y)
            for (std::int32_t x = 0; x < image.width; ++x) {
                if (!marked[index(x, y)]) continue;
                left_ = std::min(left_, x), right = std::max(right, x);
                top_ = std::min(top_, y), bottom = y;
            }
        const std::int32_t extent = std::max({right - left_, bottom - top_, 0}) + 1;
        constexpr std::int32_t most = 64;
        side_ = (extent + most - 1) / most;
        columns_ = right < 0 ? 0 : (right - left_) / side_ + 1;
        rows_ = right < 0 ? 0 : (bottom - top_) / side_ + 1;
    }

    [[nodiscard]] std::int32_t columns() const { return columns_; }
    [[nodiscard]] std::int32_t rows() const { return rows_; }
    [[nodiscard]] double pixels_per_block() const { return static_cast<double>(side_) * side_; }

    /// Sum of value(pixel index) over each block's marked pixels.
    template<class Value>
    [[nodiscard]] std::vector<double> sums(const Value& value) const {
        std::vector<double> out(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
        for (std::int32_t y = top_; y < top_ + rows_ * side_; ++y)
            for (std::int32_t x = left_; x < left_ + columns_ * side_; ++x) {
                if (x >= width_ || index(x, y) >= marked_.size() || !marked_[index(x, y)]) continue;
                const double v = value(index(x, y));
                if (!std::isnan(v))
                    out[static_cast<std::size_t>((y - top_) / side_ * columns_ + (x - left_) / side_)] += v;
            }
        return out;
    }

private:
    [[nodiscard]] std::size_t index(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    std::int32_t width_, left_ = 0, top_ = 0, side_ = 1, columns_ = 0, rows_ = 0;
    const std::vector<bool>& marked_;
};

} // namespace

double ResidualScatter::small_sample_factor(std::size_t parameters) const {
    const double fitted = static_cast<double>(parameters) + 2;
    const double n = std::max(cells, fitted + 1);
    return n / (n - fitted);
}

ResidualScatter residual_scatter(const Image& a, const Image& b, std::span<const Image> gradients) {
    ResidualScatter out{std::vector<double>(gradients.size() * gradients.size()),
                        std::numeric_limits<double>::infinity()};
    const Image difference = normalised_difference(a, b);
    std::vector<bool> marked(difference.values.size());
    mark_bodies(a, difference, marked);
    mark_bodies(b, difference, marked);
    const Blocks blocks(difference, marked);
    const std::vector<double> area = blocks.sums([](std::size_t) { return 1.0; });
    std::vector<double> residual = blocks.sums([&](std::size_t i) { return difference.values[i]; });
    std::vector<std::vector<double>> slopes;
    slopes.reserve(gradients.size());
    for (const Image& gradient : gradients)
        slopes.push_back(blocks.sums([&](std::size_t i) { return gradient.values[i]; }));

    // Remove the mean of the residual.
    double total_area = 0, total = 0;
    for (std::size_t i = 0; i < area.size(); ++i)
        total_area += area[i], total += residual[i];
    if (!(total_area > 0)) return out;
    for (std::size_t i = 0; i < area.size(); ++i)
        residual[i] -= area[i] * total / total_area;

    // Estimate the autocovariance: products of residuals over products of areas, by lag.
    const std::int32_t columns = blocks.columns(), rows = blocks.rows(), lags = 2 * columns - 1;
    std::vector<double> covariance(static_cast<std::size_t>(lags) * static_cast<std::size_t>(2 * rows - 1)),
        overlap(covariance.size());
    const auto each_pair = [&](const auto& visit) {
        for (std::int32_t y = 0; y < rows; ++y)
            for (std::int32_t x = 0; x < columns; ++x) {
                const auto p = static_cast<std::size_t>(y * columns + x);
                if (!(area[p] > 0)) continue;
                for (std::int32_t v = 0; v < rows; ++v)
                    for (std::int32_t u = 0; u < columns; ++u)
                        visit(p, static_cast<std::size_t>(v * columns + u),
                              static_cast<std::size_t>((v - y + rows - 1) * lags + u - x + columns - 1));
            }
    };
    each_pair([&](std::size_t p, std::size_t q, std::size_t lag) {
        covariance[lag] += residual[p] * residual[q], overlap[lag] += area[p] * area[q];
    });
    // Lags at which less than half of a block overlaps are not estimated.
    const double least = 0.5 * blocks.pixels_per_block() * blocks.pixels_per_block();
    for (std::size_t lag = 0; lag < covariance.size(); ++lag)
        covariance[lag] = overlap[lag] > least ? covariance[lag] / overlap[lag] : 0;
    double squares = 0;
    for (std::size_t lag = 0; lag < covariance.size(); ++lag)
        squares += covariance[lag] * covariance[lag] * overlap[lag];
    const double variance = covariance[static_cast<std::size_t>((rows - 1) * lags + columns - 1)];
    if (!(squares > 0)) return out;
    out.cells = total_area * total_area * variance * variance / squares;

    const auto n = static_cast<double>(sums_of(a, b).n);
    each_pair([&](std::size_t p, std::size_t q, std::size_t lag) {
        const double c = covariance[lag] / (n * n);
        for (std::size_t i = 0; i < slopes.size(); ++i)
            for (std::size_t j = 0; j < slopes.size(); ++j)
                out.covariance[i * slopes.size() + j] += slopes[i][p] * c * slopes[j][q];
    });
    return out;
}

std::vector<double> fit_variances(const FittedImages& fit, std::span<const double> inverse_curvature) {
    const std::size_t count = fit.plus.size();
    std::vector<Image> gradients = fit.plus;
    std::vector<BlockShares> slopes(count);
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < gradients[i].values.size(); ++k)
            gradients[i].values[k] = (fit.plus[i].values[k] - fit.minus[i].values[k]) / (2 * fit.step);
        const BlockShares plus = block_shares(fit.plus[i]), minus = block_shares(fit.minus[i]);
        for (std::size_t k = 0; k < plus.size(); ++k)
            slopes[i][k] = (plus[k] - minus[k]) / (2 * fit.step);
    }
    std::vector<double> blocks(count * count);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t k = 0; k < slopes[i].size(); ++k)
                blocks[i * count + j] += slopes[i][k] * slopes[j][k];
    const ResidualScatter field = residual_scatter(fit.a, fit.b, gradients);
    std::vector<double> out;
    for (std::size_t i = 0; i < count; ++i) {
        double of_blocks = 0, of_field = 0;
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t k = 0; k < count; ++k) {
                const double weight = inverse_curvature[i * count + j] * inverse_curvature[k * count + i];
                of_blocks += weight * blocks[j * count + k];
                of_field += weight * field.covariance[j * count + k];
            }
        out.push_back(std::max(of_blocks, of_field) * field.small_sample_factor(count));
    }
    return out;
}

} // namespace obscura::tools
