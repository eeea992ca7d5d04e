// SPDX-License-Identifier: Apache-2.0
// Adaptive sampling of BlockTracer: errors of pixels, and the numbers of samples that they need.
#include "renderer/integrators/block_tracer.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Ratio of the target error of each pixel to the resulting error over all pixels: the estimates are
/// conservative, and most pixels need no further samples (measured by the test of adaptive sampling).
constexpr double error_margin = 2.3;
/// As error_margin, for pixels that share a grid: their error is estimated by the residual of its points from
/// a plane, most of which is detail that the grid still resolves.
constexpr double shared_error_margin = 7;
/// As error_margin, for the number of samples of pixels which the grid is too coarse for.
constexpr double shared_refined_margin = 3.5;
/// As error_margin, for further rounds, in which few pixels take part: the ratio of the error of these pixels
/// to that over all.
constexpr double refined_error_margin = 1.5;
/// As error_margin, for indirect light, whose error is much the same in all pixels.
constexpr double indirect_error_margin = 0.85;
/// The error of n samples of indirect light falls with this power of n.
constexpr double indirect_power = 0.575;
/// Variance of a filtered pixel over that which independent errors of the grid's points would cause, for
/// direct sunlight: the points err together along an edge, but second differences take the edge itself for
/// noise as well (measured by noise_estimate_test.cpp).
constexpr double direct_grid_noise = 0.58;

/// n^0.75
double three_quarter_power(double n) {
    const double root = std::sqrt(n);
    return root * std::sqrt(root);
}

} // namespace

std::uint32_t BlockTracer::samples_for(double spread, double aim, std::uint32_t least) const {
    // n^0.75 = spread / aim, rounded up to a power of two: Sobol points are best there.
    const std::uint32_t most = std::max(least, sampling_.max_samples);
    const double ratio2 = spread * spread / (aim * aim);
    std::uint32_t count = 1;
    while (count < most && static_cast<double>(count) * count * count < ratio2 * ratio2)
        count *= 2;
    return std::min(count, most);
}

std::uint32_t BlockTracer::indirect_samples_for(double error, double count, double aim,
                                                std::uint32_t least) const {
    if (!(error > aim)) return 1;
    const std::uint32_t most = std::max(least, sampling_.max_samples);
    const double needed = count * std::pow(error / aim, 1 / indirect_power);
    std::uint32_t n = 1;
    while (n < most && n < needed)
        n *= 2;
    return std::min(n, most);
}

double BlockTracer::goal(const NearBodies& near, int pixel, double mean, double block_mean) const {
    const double value = sunlight_only_ ? mean : (mean + block_mean) / 2;
    return sampling_.target_error * std::max(near.reference * solid_angle_.v[pixel], value);
}

void BlockTracer::take_smooth(const SampleGridKernel& kernel, const SampleGrid& grid, const NearBodies& near,
                              BlockResult& result, std::uint32_t (&wanted)[packet_size]) const {
    const std::size_t channels = tracer_.channels();
    Doubles mean{};
    for (std::size_t c = 0; c < channels; ++c) {
        Doubles value;
        grid.gather(kernel, c, first_x_, y_, value);
        for (int i = 0; i < packet_size; ++i) {
            result.mean[c][i] = value.v[i];
            mean.v[i] += value.v[i] / static_cast<double>(channels);
        }
    }
    const GridRoughness rough = grid.roughness(channels, first_x_, y_);
    double block_mean = 0;
    double block_noise2 = 0;
    double pixels = 0;
    for (int i = 0; i < packet_size; ++i) {
        if (!result.covered[i]) continue;
        block_mean += mean.v[i];
        block_noise2 += rough.noise2.v[i];
        pixels += 1;
    }
    block_mean /= std::max(pixels, 1.0);
    block_noise2 /= std::max(pixels, 1.0);
    // At least as many as the grid's effective samples per pixel: fewer would be no better.
    const double floor = std::pow(kernel.noise, -3.0);
    for (int i = 0; i < packet_size; ++i) {
        // Smooth along the row, with pixels that will have samples of their own: they are where the grid is
        // rough, and without them the smooth rest would look better than it is.
        const double left = rough.noise2.v[std::max(i - 1, 0)];
        const double right = rough.noise2.v[std::min(i + 1, packet_size - 1)];
        result.variance[i] = (sunlight_only_ ? direct_grid_noise : 1.0) * kernel.independent *
                             (left + 2 * rough.noise2.v[i] + right) / 4;
        wanted[i] = 0;
        result.samples[i] = result.covered[i] ? 1 : 0;
        if (!result.covered[i]) continue;
        const double aim = goal(near, i, mean.v[i], block_mean);
        if (kernel.noise * rough.residual.v[i] > shared_error_margin * aim)
            wanted[i] =
                samples_for(std::max(rough.deviation.v[i] / (shared_refined_margin * aim), floor), 1, 1);
        if (sunlight_only_) continue;
        const double noise2 = std::max(rough.noise2.v[i], block_noise2);
        if (noise2 * kernel.independent > indirect_error_margin * indirect_error_margin * aim * aim)
            wanted[i] = std::max(wanted[i],
                                 indirect_samples_for(std::sqrt(noise2), 1, indirect_error_margin * aim, 2));
    }
}

bool BlockTracer::refine(const NearBodies& near, const BlockResult& result, bool first_round,
                         const Sums& sums, const Doubles& variance,
                         std::uint32_t (&wanted)[packet_size]) const {
    double block_mean = 0;
    double block_spread2 = 0; // squares of what one sample would err by, if its error fell as n^-0.75
    double pixels = 0;
    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        block_mean += sums.noise.mean(i);
        block_spread2 += variance[i] * n * std::sqrt(n);
        pixels += 1;
    }
    if (pixels == 0) return false;
    block_mean /= pixels;
    block_spread2 /= pixels;
    bool more = false;
    for (int i = 0; i < packet_size; ++i) {
        const double n = sums.count[i];
        if (n == 0) continue;
        const double aim = goal(near, i, sums.noise.mean(i), block_mean);
        double spread = std::sqrt(variance[i]) * three_quarter_power(n);
        double margin = refined_error_margin;
        if (first_round) {
            // Few samples: half the range over the pixel and its neighbours estimates the standard
            // deviation, and sees edges between pixels which all samples of a pixel miss.
            double least = sums.least[i];
            double largest = sums.most[i];
            for (const int k : {i - 1, i + 1})
                if (k >= 0 && k < packet_size && result.covered[k]) {
                    least = std::min(least, sums.least[k]);
                    largest = std::max(largest, sums.most[k]);
                }
            spread = (largest - least) / 2;
            margin = error_margin;
        }
        std::uint32_t count = 1;
        if (spread > margin * aim) count = samples_for(spread, margin * aim, near.samples);
        if (!sunlight_only_) {
            const double error = std::sqrt(std::max(variance[i], block_spread2 / (n * std::sqrt(n))));
            count =
                std::max(count, indirect_samples_for(error, n, indirect_error_margin * aim, near.samples));
        }
        if (count > sums.count[i]) {
            wanted[i] = count;
            more = true;
        }
    }
    return more;
}

} // namespace obscura::renderer
