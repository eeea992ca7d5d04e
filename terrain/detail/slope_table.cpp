// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/slope_table.hpp"

#include "core/units.hpp"
#include "terrain/detail/exact_math.hpp"
#include "terrain/detail/gradient_noise.hpp"

#include <algorithm>

namespace obscura::terrain {
namespace {} // namespace

SlopeTable::SlopeTable(std::span<const BaselineSlope> entries) {
    for (const BaselineSlope& entry : entries)
        entries_.push_back(
            {exact_log2(entry.baseline_m), exact_log2(entry.baseline_m * exact_tan(entry.slope_rad))});
    if (entries_.size() == 1) // one slope at all baselines
        entries_.insert(entries_.begin(), {entries_[0].log2_baseline - 1, entries_[0].log2_deviation - 1});
}

SlopeTable SlopeTable::of_class(TerrainClass terrain) {
    const auto table = [](std::initializer_list<BaselineSlope> in_degrees) {
        std::vector<BaselineSlope> entries(in_degrees);
        for (BaselineSlope& entry : entries)
            entry.slope_rad *= degree;
        return SlopeTable(entries);
    };
    switch (terrain) {
    case TerrainClass::highlands:
        return table({{0.1, 12},
                      {1, 11.2},
                      {10, 10.7},
                      {100, 10.4},
                      {500, 9.5},
                      {1000, 8.5},
                      {1900, 7.2},
                      {3800, 6.3},
                      {7600, 4.9},
                      {15e3, 3.9},
                      {30e3, 2.8},
                      {60e3, 1.74},
                      {120e3, 1.02},
                      {240e3, 0.6}});
    case TerrainClass::maria:
        return table({{0.1, 8},
                      {1, 6},
                      {10, 4.5},
                      {100, 3.4},
                      {500, 2.6},
                      {1000, 2.3},
                      {1900, 2},
                      {3800, 1.7},
                      {7600, 1.2},
                      {15e3, 0.87},
                      {30e3, 0.56},
                      {60e3, 0.35},
                      {120e3, 0.23}});
    case TerrainClass::mars:
        return table({{0.1, 9},
                      {1, 7},
                      {10, 5},
                      {100, 3.6},
                      {300, 3},
                      {1000, 2.4},
                      {3000, 1.8},
                      {10e3, 1.2},
                      {30e3, 0.75},
                      {100e3, 0.4}});
    case TerrainClass::rubble_pile:
        break;
    }
    return table({{0.1, 28}, {1, 26}, {10, 20}, {30, 16}, {100, 11}, {300, 7}});
}

SlopeTable SlopeTable::of_hurst(BaselineSlope at, double hurst, double max_m) {
    SlopeTable table(std::span(&at, 1));
    const double baseline = exact_log2(at.baseline_m), deviation = table.entries_[1].log2_deviation;
    const double longest = std::max(exact_log2(max_m), baseline);
    table.entries_ = {{baseline - 1, deviation - hurst}, {longest, deviation + hurst * (longest - baseline)}};
    return table;
}

double SlopeTable::deviation_m(double baseline_m) const {
    const double x = exact_log2(baseline_m);
    std::size_t n = 1;
    while (n + 1 < entries_.size() && x > entries_[n].log2_baseline)
        ++n;
    const Entry &a = entries_[n - 1], &b = entries_[n];
    const double slope = (b.log2_deviation - a.log2_deviation) / (b.log2_baseline - a.log2_baseline);
    return exact_exp2(a.log2_deviation + (x - a.log2_baseline) * slope);
}

double SlopeTable::max_m() const {
    return exact_exp2(entries_.back().log2_baseline);
}

std::vector<Octave> solve_octaves(const SlopeTable& table, int shortest, int longest,
                                  const std::function<double(double)>& made_m2) {
    const int last_baseline =
        std::min(longest, static_cast<int>(std::floor(exact_log2(table.max_m()) + 1e-6)));
    const auto octaves = static_cast<std::size_t>(std::max(0, longest - shortest + 1));
    const auto baselines = static_cast<std::size_t>(std::max(0, last_baseline - shortest + 1));
    std::vector<Octave> result(octaves);
    for (std::size_t k = 0; k < octaves; ++k)
        result[k].exponent = longest - static_cast<int>(k);
    if (baselines == 0) return result;

    std::vector<double> wanted(baselines);
    for (std::size_t j = 0; j < baselines; ++j) {
        const double baseline = std::ldexp(1.0, shortest + static_cast<int>(j));
        const double deviation = table.deviation_m(baseline), made = made_m2(baseline);
        // Not 0: then no octave could help to reach a longer baseline.
        wanted[j] = std::max(deviation * deviation - made, 1e-6 * deviation * deviation);
    }
    std::vector<double> share(baselines * octaves); // of octave k in baseline j
    for (std::size_t j = 0; j < baselines; ++j)
        for (std::size_t k = 0; k < octaves; ++k)
            share[j * octaves + k] =
                noise_structure(std::ldexp(1.0, shortest + static_cast<int>(j) - result[k].exponent));
    // Expectation maximisation (Richardson 1972, Lucy 1974): keeps powers positive.
    std::vector<double> power(octaves);
    for (std::size_t k = 0; k < octaves; ++k) {
        // About the rise of the squared slope from twice the baseline to this one.
        const std::size_t j = std::min(baselines - 1, octaves - 1 - k), next = std::min(baselines - 1, j + 1);
        power[k] = std::max(0.01 * wanted[j], wanted[j] - wanted[next] / 4) / 2;
    }
    for (int step = 0; step < 3000; ++step) {
        std::vector<double> raise(octaves), weight(octaves);
        for (std::size_t j = 0; j < baselines; ++j) {
            double sum = 0;
            for (std::size_t k = 0; k < octaves; ++k)
                sum += share[j * octaves + k] * power[k];
            // Each baseline counts alike: shares are relative to what is wanted there.
            for (std::size_t k = 0; k < octaves; ++k) {
                raise[k] += share[j * octaves + k] / sum;
                weight[k] += share[j * octaves + k] / wanted[j];
            }
        }
        for (std::size_t k = 0; k < octaves; ++k)
            power[k] *= raise[k] / weight[k];
    }
    for (std::size_t k = 0; k < octaves; ++k)
        result[k].rms_m = std::sqrt(power[k]);
    return result;
}

} // namespace obscura::terrain
