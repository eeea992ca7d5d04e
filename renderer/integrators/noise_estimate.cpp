// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/noise_estimate.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

namespace obscura::renderer {
namespace {

/// Bounds of r = V(k+1) / V(k): independent samples, and better than any scene measured.
constexpr double max_ratio = 0.5;
constexpr double min_noise_ratio = 0.2;
/// The ratio before any is measured (measured at 2 to 4 samples: 0.25 to 0.26 for sunlit bodies, 0.31 to 0.48
/// for indirect light), and its weight in pixels: at 4 samples, where the ratio measured is that of one
/// difference to two, and above.
constexpr double direct_ratio = 0.28;
constexpr double indirect_ratio = 0.38;
constexpr double few_samples_weight = 48;
constexpr double ratio_weight = 12;
/// The ratio of the next level over that of the last two differences: smooth parts of a pixel converge first
/// and leave the edges.
constexpr double ratio_rise = 1.07;

double power_of_two(int k) {
    return static_cast<double>(std::uint64_t{1} << k);
}

/// Differences between the groups of each pixel's samples.
struct Differences {
    int levels[packet_size];           ///< of complete groups: 2^levels <= count; -1: no samples
    double last[packet_size] = {};     ///< mean of D^2 of the last level
    double previous[packet_size] = {}; ///< of the one before
};

/// Third differences between pixels of equal numbers of samples, 1 to 3.
struct ThirdDifferences {
    double squares[packet_size] = {}; ///< sum of those that a pixel takes part in
    double weight[packet_size] = {};
    double all_squares[2] = {}; ///< of pixels of one level
    double all_weight[2] = {};

    void add(const std::uint32_t (&counts)[packet_size], const double (&sums)[packet_size]) {
        constexpr double stencil[4] = {1, -3, 3, -1};
        for (int i = 0; i + 3 < packet_size; ++i) {
            // Pixels without samples are those without a body: 0.
            const std::uint32_t count = *std::max_element(counts + i, counts + i + 4);
            if (count < 1 || count > 3) continue;
            double difference = 0;
            bool equal = true;
            for (int k = 0; k < 4; ++k) {
                equal = equal && (counts[i + k] == count || counts[i + k] == 0);
                if (counts[i + k] > 0) difference += stencil[k] * (sums[i + k] / counts[i + k]);
            }
            if (!equal) continue;
            const int level = count > 1 ? 1 : 0;
            for (int k = 0; k < 4; ++k) {
                squares[i + k] += stencil[k] * stencil[k] * difference * difference / 20;
                weight[i + k] += stencil[k] * stencil[k];
            }
            all_squares[level] += difference * difference / 20;
            all_weight[level] += 1;
        }
    }
};

/// Measures r over the pixels of a level.
double measured_ratio(const Differences& of, int level, const ThirdDifferences& rough, bool sunlight_only) {
    double lasts = 0;
    double previouses = 0;
    double pixels = 0;
    for (int k = 0; k < packet_size; ++k)
        if (of.levels[k] == level) {
            lasts += of.last[k];
            previouses += of.previous[k];
            pixels += 1;
        }
    double ratio = sunlight_only ? direct_ratio : indirect_ratio;
    if (level == 1 && rough.all_weight[1] > 0 && lasts > 0) {
        const double noise = rough.all_squares[1] / rough.all_weight[1];
        ratio = noise / (noise + lasts / pixels);
    } else if (level > 1 && previouses > 0) {
        const double prior = (level == 2 ? few_samples_weight : ratio_weight) / pixels;
        ratio = (ratio_rise * lasts / previouses + prior * ratio) / (1 + prior);
    }
    return std::clamp(ratio, min_noise_ratio, max_ratio);
}

} // namespace

void NoiseSums::reset() {
    std::fill(std::begin(count_), std::end(count_), 0u);
    std::fill(std::begin(sum_), std::end(sum_), 0.0);
}

void NoiseSums::add(int pixel, double value) {
    const std::uint32_t index = count_[pixel]++;
    sum_[pixel] += value;
    // Merge complete halves, as carries run through a binary counter.
    double group = value;
    int k = 0;
    for (; (index >> k & 1u) != 0 && k < max_levels - 1; ++k) {
        const double difference = group - pending_[k][pixel];
        const bool first = index + 1 == 2u << k;
        square_[k][pixel] = difference * difference + (first ? 0.0 : square_[k][pixel]);
        group += pending_[k][pixel];
    }
    pending_[k][pixel] = group;
}

void NoiseSums::variance(bool sunlight_only, Doubles& variance) const {
    Differences of;
    for (int i = 0; i < packet_size; ++i) {
        of.levels[i] = std::min(static_cast<int>(std::bit_width(count_[i])), max_levels - 1) - 1;
        const auto squared = [&](int k) {
            return square_[k][i] / (power_of_two(2 * k + 2) * (count_[i] >> (k + 1)));
        };
        if (of.levels[i] > 0) of.last[i] = squared(of.levels[i] - 1);
        if (of.levels[i] > 1) of.previous[i] = squared(of.levels[i] - 2);
    }
    ThirdDifferences rough;
    rough.add(count_, sum_);
    Doubles own{}; // variance of each pixel from its own samples
    double ratio = 0;
    for (int i = 0; i < packet_size; ++i) {
        if (of.levels[i] < 0) continue;
        if (of.levels[i] == 0) {
            own[i] = rough.weight[i] > 0 ? rough.squares[i] / rough.weight[i] : 0;
            continue;
        }
        if (i == 0 || of.levels[i] != of.levels[i - 1])
            ratio = measured_ratio(of, of.levels[i], rough, sunlight_only);
        // One difference of the last level, two of the one before.
        const double squared = of.levels[i] > 1 ? (of.last[i] + 2 * ratio * of.previous[i]) / 3 : of.last[i];
        own[i] = ratio / (1 - ratio) * squared * power_of_two(of.levels[i]) / count_[i];
    }
    // Smooth along the row, so that few equal samples do not pass for certainty.
    for (int i = 0; i < packet_size; ++i) {
        if (of.levels[i] < 0) continue;
        double sum = 0;
        double weights = 0;
        for (const int k : {i - 1, i, i + 1}) {
            if (k < 0 || k >= packet_size || of.levels[k] < 0) continue;
            const double w = k == i ? 2 : 1;
            const double more = static_cast<double>(count_[k]) / count_[i];
            sum += w * own[k] * more * std::sqrt(more);
            weights += w;
        }
        variance[i] = sum / weights;
    }
}

} // namespace obscura::renderer
