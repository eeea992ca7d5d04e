// SPDX-License-Identifier: Apache-2.0
#include "sensors/emva1288.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

namespace obscura::sensors::emva1288 {
namespace {

constexpr double quantisation_variance = 1.0 / 12;

double signal(const Level& l) {
    return l.bright.mean - l.dark.mean;
}

/// Photons at which the response, extrapolated from below, reaches the plateau.
double saturation(std::span<const Level> levels, double& top_signal) {
    const auto noisiest = std::max_element(levels.begin(), levels.end(), [](const Level& a, const Level& b) {
        return a.bright.variance < b.bright.variance;
    });
    top_signal = signal(*noisiest);
    const Level& last = levels.back();
    if (last.bright.variance > 0.5 * noisiest->bright.variance) return noisiest->photons;
    const double plateau = signal(last);
    top_signal = plateau;
    std::size_t i = 0;
    while (i + 1 < levels.size() && signal(levels[i + 1]) < 0.95 * plateau)
        ++i;
    if (i < 2) return noisiest->photons;
    // Fit a parabola through three levels below the knee, because responses are not linear, and solve it for
    // the plateau.
    const Level &a = levels[i - 2], &b = levels[i - 1], &c = levels[i];
    const double ab = (signal(b) - signal(a)) / (b.photons - a.photons);
    const double bc = (signal(c) - signal(b)) / (c.photons - b.photons);
    const double bend = (bc - ab) / (c.photons - a.photons);
    double p = c.photons + (plateau - signal(c)) / bc;
    for (int step = 0; step < 20; ++step) {
        const double value = signal(c) + bc * (p - c.photons) + bend * (p - c.photons) * (p - b.photons);
        const double rate = bc + bend * (2 * p - c.photons - b.photons);
        if (!(rate > 0)) return c.photons + (plateau - signal(c)) / bc;
        p -= (value - plateau) / rate;
    }
    return p;
}

} // namespace

PairStatistics pair_statistics(std::span<const std::uint16_t> a, std::span<const std::uint16_t> b) {
    assert(a.size() == b.size() && !a.empty());
    std::int64_t sum = 0, difference = 0, squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const std::int64_t d = std::int64_t{a[i]} - b[i];
        sum += std::int64_t{a[i]} + b[i];
        difference += d;
        squares += d * d;
    }
    const auto n = static_cast<double>(a.size());
    const double mean_difference = static_cast<double>(difference) / n;
    return {static_cast<double>(sum) / (2 * n),
            (static_cast<double>(squares) / n - mean_difference * mean_difference) / 2};
}

LinearModel evaluate(std::span<const Level> levels) {
    const auto rising = [](const Level& a, const Level& b) { return a.photons >= b.photons; };
    if (levels.size() < 4 || std::adjacent_find(levels.begin(), levels.end(), rising) != levels.end())
        throw std::invalid_argument("a series needs at least 4 levels with rising numbers of photons");
    LinearModel m;
    double top = 0;
    m.saturation_photons = saturation(levels, top);

    const auto fit = [&](double range) {
        double xx = 0, xy = 0, pp = 0, ps = 0;
        for (const Level& l : levels) {
            const double s = signal(l);
            if (s > range * top || l.photons > m.saturation_photons) continue;
            xx += s * s;
            xy += s * (l.bright.variance - l.dark.variance);
            pp += l.photons * l.photons;
            ps += l.photons * s;
        }
        m.fit_range = range;
        m.gain_dn_per_e = xy / xx;
        m.responsivity_dn_per_photon = ps / pp;
    };
    // Linearity error: relative deviations from the line that minimises them, 5 to 95 % of saturation.
    double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
    const auto in_range = [&](const Level& l) { return signal(l) > 0.05 * top && signal(l) < 0.95 * top; };
    for (const Level& l : levels)
        if (in_range(l)) {
            const double weight = 1 / (signal(l) * signal(l));
            w += weight, wx += weight * l.photons, wy += weight * signal(l);
            wxx += weight * l.photons * l.photons, wxy += weight * l.photons * signal(l);
        }
    const double determinant = w * wxx - wx * wx;
    if (determinant > 0) {
        const double a0 = (wxx * wy - wx * wxy) / determinant, a1 = (w * wxy - wx * wy) / determinant;
        double sum = 0, count = 0;
        for (const Level& l : levels)
            if (in_range(l)) {
                sum += std::fabs(signal(l) / (a0 + a1 * l.photons) - 1);
                ++count;
            }
        m.linearity_error_percent = 100 * sum / count;
    }
    fit(m.linearity_error_percent > 1 ? 0.2 : 0.7);

    m.quantum_efficiency = m.responsivity_dn_per_photon / m.gain_dn_per_e;
    const double dark = std::max(0.0, levels.front().dark.variance - quantisation_variance);
    m.dark_noise_e = std::sqrt(dark) / m.gain_dn_per_e;
    m.saturation_e = m.quantum_efficiency * m.saturation_photons;
    m.threshold_photons =
        (std::sqrt(levels.front().dark.variance) / m.gain_dn_per_e + 0.5) / m.quantum_efficiency;
    m.dynamic_range_db = 20 * std::log10(m.saturation_photons / m.threshold_photons);
    m.snr_max_db = 10 * std::log10(m.saturation_e);
    return m;
}

void ImageStack::add(std::span<const std::uint16_t> image) {
    assert(image.size() == sum_.size());
    for (std::size_t i = 0; i < image.size(); ++i) {
        sum_[i] += image[i];
        squares_[i] += double{1} * image[i] * image[i];
    }
    ++count_;
}

double ImageStack::mean() const {
    double sum = 0;
    for (const double s : sum_)
        sum += s;
    return sum / static_cast<double>(count_ * sum_.size());
}

double ImageStack::temporal_variance() const {
    const auto n = static_cast<double>(count_);
    double sum = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i)
        sum += (squares_[i] - sum_[i] * sum_[i] / n) / (n - 1);
    return sum / static_cast<double>(sum_.size());
}

double ImageStack::spatial_variance() const {
    const double m = mean();
    double sum = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i)
        sum += (pixel(i) - m) * (pixel(i) - m);
    return sum / static_cast<double>(sum_.size() - 1) - temporal_variance() / static_cast<double>(count_);
}

double slope(std::span<const double> x, std::span<const double> y) {
    assert(x.size() == y.size() && x.size() > 1);
    double mx = 0, my = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        mx += x[i], my += y[i];
    mx /= static_cast<double>(x.size()), my /= static_cast<double>(x.size());
    double xy = 0, xx = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        xy += (x[i] - mx) * (y[i] - my), xx += (x[i] - mx) * (x[i] - mx);
    return xy / xx;
}

} // namespace obscura::sensors::emva1288
