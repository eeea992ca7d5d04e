// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/stars/luminosity_class.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace obscura::ephemeris {
namespace {

/// Mean of one type of a luminosity class: T. Schmidt-Kaler in Landolt-Bornstein VI/2b (1982), as tabulated
/// in Allen's Astrophysical Quantities, 4th ed. (2000), table 15.7.
struct MeanStar {
    double type_number; ///< see CatalogueStar
    double colour_b_v;
    double absolute_v;
};

constexpr MeanStar mean_dwarfs[]{
    {0.5, -0.33, -5.7},  {0.9, -0.31, -4.5}, {1.0, -0.30, -4.0}, {1.2, -0.24, -2.45}, {1.5, -0.17, -1.2},
    {1.8, -0.11, -0.25}, {2.0, -0.02, 0.65}, {2.2, 0.05, 1.3},   {2.5, 0.15, 1.95},   {3.0, 0.30, 2.7},
    {3.5, 0.44, 3.5},    {3.8, 0.52, 4.0},   {4.0, 0.58, 4.4},   {4.2, 0.63, 4.7},    {4.5, 0.68, 5.1},
    {4.8, 0.74, 5.5},    {5.0, 0.81, 5.9},   {5.2, 0.91, 6.4},   {5.5, 1.15, 7.35},   {6.0, 1.40, 8.8},
    {6.2, 1.49, 9.9},    {6.5, 1.64, 12.3}};
constexpr MeanStar mean_giants[]{{1.0, -0.29, -5.1}, {1.5, -0.17, -2.2}, {2.0, -0.03, 0.0}, {2.5, 0.15, 0.7},
                                 {3.0, 0.30, 1.5},   {3.5, 0.43, 1.6},   {4.0, 0.65, 1.0},  {4.5, 0.86, 0.9},
                                 {4.8, 0.94, 0.8},   {5.0, 1.00, 0.7},   {5.2, 1.16, 0.5},  {5.5, 1.50, -0.2},
                                 {6.0, 1.56, -0.4},  {6.2, 1.60, -0.6},  {6.5, 1.63, -0.3}};
constexpr MeanStar mean_supergiants[]{
    {0.9, -0.27, -6.5}, {1.2, -0.17, -6.4}, {1.5, -0.10, -6.2}, {1.8, -0.03, -6.2}, {2.0, -0.01, -6.3},
    {2.5, 0.09, -6.6},  {3.0, 0.17, -6.6},  {3.5, 0.32, -6.6},  {4.0, 0.76, -6.4},  {4.5, 1.02, -6.2},
    {5.0, 1.25, -6.0},  {5.5, 1.60, -5.8},  {6.0, 1.67, -5.6},  {6.5, 1.80, -5.6}};

/// Absolute magnitude at `x` of the column `order`, linear between types; ends hold.
double mean_absolute_v(std::span<const MeanStar> stars, double MeanStar::*order, double x) {
    const auto above = std::find_if(stars.begin(), stars.end(), [&](const auto& s) { return s.*order > x; });
    if (above == stars.begin()) return stars.front().absolute_v;
    if (above == stars.end()) return stars.back().absolute_v;
    const MeanStar& a = *(above - 1);
    const MeanStar& b = *above;
    return a.absolute_v + (x - a.*order) / (b.*order - a.*order) * (b.absolute_v - a.absolute_v);
}

} // namespace

Luminosity luminosity_from_parallax(const CatalogueStar& star, double parallax_error_mas) {
    constexpr double min_significance = 5;
    constexpr double usual_error_mas = 1; // median of Hipparcos: 0.97 mas up to V 9 (ESA SP-1200, vol. 1)
    const double error_mas = std::isnan(parallax_error_mas) ? usual_error_mas : parallax_error_mas;
    if (!(star.parallax_mas > 0) || star.parallax_mas < min_significance * error_mas)
        return Luminosity::unknown;
    const bool typed = !std::isnan(star.type_number);
    if (!typed && std::isnan(star.colour_b_v)) return Luminosity::unknown;
    const auto mean = [&](std::span<const MeanStar> stars) {
        return typed ? mean_absolute_v(stars, &MeanStar::type_number, star.type_number)
                     : mean_absolute_v(stars, &MeanStar::colour_b_v, star.colour_b_v);
    };
    const double absolute_v = star.magnitude_v + 5 + 5 * std::log10(star.parallax_mas * 1e-3);
    const double giant = mean(mean_giants);
    if (absolute_v > (mean(mean_dwarfs) + giant) / 2) return Luminosity::dwarf;
    return absolute_v > (giant + mean(mean_supergiants)) / 2 ? Luminosity::giant : Luminosity::supergiant;
}

} // namespace obscura::ephemeris
