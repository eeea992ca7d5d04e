// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/crater_law.hpp"

#include "terrain/detail/exact_math.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::terrain {
namespace {

constexpr double log10_of_2 = 0.30102999566398119521;

double power10(double x) {
    return exact_exp2(x / log10_of_2);
}

/// log10 of N(>D) per km2 and Ga, x = log10 of D in km, D from 10 m to 300 km.
double production_log10(double x) {
    constexpr std::array coefficients{-3.0876,  -3.557528, 0.781027,  1.021521,  -0.156012, -0.444058,
                                      0.019977, 0.086850,  -0.005874, -0.006809, 8.25e-4,   5.54e-5};
    double sum = 0;
    for (std::size_t k = coefficients.size(); k-- > 0;)
        sum = sum * x + coefficients[k];
    return sum;
}

/// Production for surfaces of 1 Ga: of any diameter up to the largest.
double production_per_km2(double diameter_m) {
    const double x = exact_log2(diameter_m) * log10_of_2 - 3;
    constexpr double least = -2, step = 0.01;
    if (x >= least) return power10(production_log10(x));
    const double slope = (production_log10(least + step) - production_log10(least)) / step;
    return power10(production_log10(least) + slope * (x - least));
}

constexpr std::size_t chronology_steps = 2048;
constexpr double oldest_ga = 4.6;

} // namespace

CraterLaw::CraterLaw(double age_ga) : age_ga_(age_ga), chronology_(chronology(age_ga)) {
    for (std::size_t n = 0; n <= chronology_steps; ++n)
        table_.push_back(chronology(oldest_ga * static_cast<double>(n) / chronology_steps));
}

double CraterLaw::chronology(double age_ga) {
    return 5.44e-14 * (exact_exp(6.93 * age_ga) - 1) + 8.38e-4 * age_ga;
}

double CraterLaw::age_of(double chronology) const {
    const auto above = std::upper_bound(table_.begin() + 1, table_.end() - 1, chronology);
    const double low = *(above - 1), high = *above;
    const double index = static_cast<double>(above - table_.begin()) - 1 + (chronology - low) / (high - low);
    return oldest_ga / chronology_steps * index;
}

double CraterLaw::production_per_m2(double diameter_m) const {
    if (diameter_m >= largest_diameter_m) return 0;
    return 1e-6 * production_per_km2(diameter_m) * (chronology_ / chronology(1));
}

double CraterLaw::equilibrium_per_m2(double diameter_m) {
    return power10(-1.1) / (diameter_m * diameter_m);
}

double CraterLaw::per_m2(double diameter_m) const {
    return std::min(production_per_m2(diameter_m), equilibrium_per_m2(diameter_m));
}

double CraterLaw::oldest(double diameter_m) const {
    const double made = production_per_m2(diameter_m);
    return made > 0 ? chronology_ * per_m2(diameter_m) / made : chronology_;
}

double crater_depth_m(double diameter_m) {
    struct Share {
        double diameter_m, depth;
    };
    // Depth over diameter in the middle of each range.
    constexpr std::array<Share, 6> small{
        {{7, 0.10}, {20, 0.11}, {63, 0.13}, {141, 0.15}, {283, 0.17}, {400, 0.194}}};
    if (diameter_m <= small.front().diameter_m) return small.front().depth * diameter_m;
    for (std::size_t n = 1; n < small.size(); ++n) {
        const Share &a = small[n - 1], &b = small[n];
        if (diameter_m > b.diameter_m) continue;
        const double part = exact_log2(diameter_m / a.diameter_m) / exact_log2(b.diameter_m / a.diameter_m);
        return (a.depth + part * (b.depth - a.depth)) * diameter_m;
    }
    const double km = diameter_m / 1000; // the laws meet at 10.6 km
    return 1000 * std::min(0.196 * exact_pow(km, 1.010), 1.044 * exact_pow(km, 0.301));
}

double crater_rim_m(double diameter_m) {
    const double km = diameter_m / 1000; // the laws meet at 21 km
    return 1000 * std::min(0.036 * exact_pow(km, 1.014), 0.236 * exact_pow(km, 0.399));
}

double crater_diffusivity(double diameter_m) {
    if (diameter_m <= 11.2) return 0.0155;
    if (diameter_m < 45) return 1.55e-3 * exact_pow(diameter_m, 0.974);
    if (diameter_m < 125) return 1.23e-3 * exact_pow(diameter_m, 0.8386);
    return 5.2e-3 * exact_pow(diameter_m, 1.3);
}

namespace {

/// A crater is taken for gone at this wear: 1 % of its depth is left.
constexpr double gone = 4;
constexpr std::size_t profile_rows = 24;

/// Radial grid for diffusion, in radii.
constexpr std::size_t nodes_per_radius = 24;
constexpr std::size_t nodes = 4 * nodes_per_radius;

/// Fassett and Thomson's equation 4, height over diameter; `rim`: over theirs; `floor`: lowest.
double fresh(double r, double rim, double floor) {
    constexpr double rim_height = 0.036822095;
    if (r < 0.98) {
        const double bowl =
            -0.228809953 + r * (0.227533882 + r * (0.083116795 - r * 0.039499407)) - rim_height * (1 - rim);
        return std::max(bowl, floor);
    }
    if (r <= 1.02) return rim * rim_height;
    if (r >= 1.5) return 0;
    return rim * std::max(0.0, 0.188253307 + r * (-0.187050452 + r * (0.01844746 + r * 0.01505647)));
}

std::vector<double> by_square(const std::vector<double>& heights) {
    std::vector<double> row;
    for (std::size_t n = 0; n < CraterProfiles::steps; ++n) {
        const double r =
            std::sqrt(CraterProfiles::reach_squared * static_cast<double>(n) / CraterProfiles::steps);
        const double place = r * nodes_per_radius;
        const auto k = static_cast<std::size_t>(place);
        const double height = heights[k] + (place - static_cast<double>(k)) * (heights[k + 1] - heights[k]);
        // What has spread further is left out.
        row.push_back(height * (1 - smooth_step((r - 1.75) / (CraterProfiles::reach - 1.75))));
    }
    row.push_back(0);
    row.push_back(0);
    return row;
}

} // namespace

CraterProfiles::CraterProfiles(double diameter_m, double max_wear) : max_wear_(std::min(max_wear, gone)) {
    const double rim = crater_rim_m(diameter_m) / diameter_m;
    const double floor = rim - crater_depth_m(diameter_m) / diameter_m;
    std::vector<double> heights(nodes + 1), next(nodes + 1);
    for (std::size_t k = 0; k <= nodes; ++k)
        heights[k] = fresh(static_cast<double>(k) / nodes_per_radius, rim / 0.036822095, floor);
    rows_.push_back(by_square(heights));
    constexpr double step = 1.0 / nodes_per_radius, max_time_step = 0.2 * step * step;
    double wear = 0;
    for (std::size_t row = 1; row <= profile_rows; ++row) {
        const double share = static_cast<double>(row) / profile_rows;
        const double until = max_wear_ * share * share;
        const double parts = std::max(1.0, std::ceil((until - wear) / max_time_step));
        const double factor = (until - wear) / parts / (step * step);
        for (double part = 0; part < parts; ++part) {
            next[0] = heights[0] + 4 * factor * (heights[1] - heights[0]);
            for (std::size_t k = 1; k < nodes; ++k) {
                const double outwards = 0.5 / static_cast<double>(k);
                next[k] = heights[k] + factor * ((1 + outwards) * (heights[k + 1] - heights[k]) -
                                                 (1 - outwards) * (heights[k] - heights[k - 1]));
            }
            next[nodes] = 0;
            heights.swap(next);
        }
        wear = until;
        rows_.push_back(by_square(heights));
    }
    for (std::vector<double>& values : rows_) {
        // A hundred-thousandth of the diameter is not seen.
        constexpr double nothing = 1e-5;
        std::size_t extent = steps;
        while (extent > 0 && std::abs(values[extent - 1]) < nothing)
            --extent;
        std::fill(values.begin() + static_cast<std::ptrdiff_t>(extent), values.end(), 0.0);
        extents_.push_back(extent);
        const auto [low, high] = std::minmax_element(values.begin(), values.end());
        least_ = std::min(least_, *low);
        largest_ = std::max(largest_, *high);
    }
}

std::size_t CraterProfiles::at(double wear, double* values) const {
    const double place = max_wear_ > 0 ? std::sqrt(std::min(wear / max_wear_, 1.0)) * profile_rows : 0.0;
    const auto k = std::min(static_cast<std::size_t>(place), profile_rows - 1);
    const double part = place - static_cast<double>(k);
    const std::vector<double>&a = rows_[k], &b = rows_[k + 1];
    for (std::size_t n = 0; n < a.size(); ++n)
        values[n] = a[n] + part * (b[n] - a[n]);
    return std::max(extents_[k], extents_[k + 1]);
}

} // namespace obscura::terrain
