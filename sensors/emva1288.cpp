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

struct Saturation {
    double photons = 0, signal = 0;
};

/// Level of the largest variance: the absolute maximum of the photon transfer curve.
const Level& noisiest_level(std::span<const Level> levels) {
    return *std::max_element(levels.begin(), levels.end(), [](const Level& a, const Level& b) {
        return a.bright.variance - a.dark.variance < b.bright.variance - b.dark.variance;
    });
}

/// Exposure at which the response, extrapolated from below, reaches the plateau.
Saturation full_well(std::span<const Level> levels) {
    const Level& noisiest = noisiest_level(levels);
    const Level& last = levels.back();
    if (last.bright.variance > 0.5 * noisiest.bright.variance) return {noisiest.photons, signal(noisiest)};
    const double plateau = signal(last);
    std::size_t i = 0;
    while (i + 1 < levels.size() && signal(levels[i + 1]) < 0.95 * plateau)
        ++i;
    if (i < 2) return {noisiest.photons, plateau};
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
        if (!(rate > 0)) return {c.photons + (plateau - signal(c)) / bc, plateau};
        p -= (value - plateau) / rate;
    }
    return {p, plateau};
}

} // namespace

PairStatistics pair_statistics(std::span<const std::uint16_t> a, std::span<const std::uint16_t> b) {
    assert(a.size() == b.size() && !a.empty());
    std::int64_t sum = 0, difference = 0, squares = 0, sum_squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const std::int64_t d = std::int64_t{a[i]} - b[i];
        const std::int64_t both = std::int64_t{a[i]} + b[i];
        sum += both;
        sum_squares += both * both;
        difference += d;
        squares += d * d;
    }
    const auto n = static_cast<double>(a.size());
    const double mean_difference = static_cast<double>(difference) / n;
    PairStatistics out{static_cast<double>(sum) / (2 * n),
                       (static_cast<double>(squares) / n - mean_difference * mean_difference) / 2};
    const double over_pixels =
        a.size() > 1 ? (static_cast<double>(sum_squares) / 4 - n * out.mean * out.mean) / (n - 1) : 0;
    out.spatial_variance = over_pixels - out.variance / 2;
    return out;
}

double model_snr(const LinearModel& m, double photons, const Nonuniformity& pattern) {
    const double electrons = m.quantum_efficiency * photons, gain = m.gain_dn_per_e;
    const double fixed = pattern.prnu * electrons;
    return electrons /
           std::sqrt(m.dark_noise.electrons * m.dark_noise.electrons + quantisation_variance / (gain * gain) +
                     electrons + pattern.dsnu_e * pattern.dsnu_e + fixed * fixed);
}

DarkNoise dark_noise(double variance_dn2, double gain_dn_per_e) {
    DarkNoise noise;
    noise.upper_limit = !(variance_dn2 >= min_variance_dn2);
    noise.dn = noise.upper_limit ? limit_of_noise_dn : std::sqrt(variance_dn2);
    noise.electrons = std::sqrt(noise.dn * noise.dn - quantisation_variance) / gain_dn_per_e;
    return noise;
}

LinearModel evaluate(std::span<const Level> levels, Method method, double dark_variance_dn2) {
    const auto falling = [&](const Level& a, const Level& b) {
        return a.photons > b.photons || (a.photons == b.photons && method == Method::full_well);
    };
    if (levels.size() < 4 || std::adjacent_find(levels.begin(), levels.end(), falling) != levels.end())
        throw std::invalid_argument("a series needs at least 4 levels with rising numbers of photons");
    LinearModel m;
    const Level& noisiest = noisiest_level(levels);
    const Saturation saturation =
        method == Method::standard ? Saturation{noisiest.photons, signal(noisiest)} : full_well(levels);
    m.saturation_photons = saturation.photons;
    m.saturation_signal_dn = saturation.signal;
    const double top = saturation.signal;

    const auto fit = [&](double range) {
        double xx = 0, xy = 0, pp = 0, ps = 0, largest = 0;
        for (const Level& l : levels) {
            const double s = signal(l);
            if (s > range * top || l.photons > m.saturation_photons) continue;
            xx += s * s;
            xy += s * (l.bright.variance - l.dark.variance);
            pp += l.photons * l.photons;
            ps += l.photons * s;
            largest = std::max(largest, l.bright.variance);
        }
        if (pp > 0 && largest < min_variance_dn2)
            throw std::invalid_argument(
                "K cannot be determined: the temporal variance is below 0.24 DN^2, where quantisation hides it, at all levels up to 70 % of saturation");
        if (!(xx > 0 && xy > 0 && ps > 0))
            throw std::invalid_argument(
                "K cannot be determined: mean and temporal variance do not rise with the light below 70 % of saturation");
        m.fit_range = range;
        m.gain_dn_per_e = xy / xx;
        m.responsivity_dn_per_photon = ps / pp;
    };
    // Linearity error: relative deviations from the line that minimises them, 5 to 95 % of saturation.
    double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
    const auto in_range = [&](const Level& l) {
        return signal(l) > 0.05 * top && signal(l) < 0.95 * top && l.photons <= m.saturation_photons;
    };
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
        m.linearity_offset_dn = a0, m.linearity_slope_dn_per_photon = a1;
    }
    fit(method == Method::full_well && m.linearity_error_percent > 1 ? 0.2 : 0.7);

    m.quantum_efficiency = m.responsivity_dn_per_photon / m.gain_dn_per_e;
    m.dark_noise =
        dark_noise(dark_variance_dn2 < 0 ? levels.front().dark.variance : dark_variance_dn2, m.gain_dn_per_e);
    m.saturation_e = m.quantum_efficiency * m.saturation_photons;
    m.threshold_photons = (m.dark_noise.dn / m.gain_dn_per_e + 0.5) / m.quantum_efficiency;
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

double ImageStack::spatial_variance(double temporal) const {
    const double m = mean();
    double sum = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i)
        sum += (pixel(i) - m) * (pixel(i) - m);
    return sum / static_cast<double>(sum_.size() - 1) - temporal / static_cast<double>(count_);
}

SpatialVariances split_variance(std::span<const double> values, std::size_t width) {
    const std::size_t height = values.size() / width;
    assert(width > 1 && height > 1 && width + height > 4);
    std::vector<double> columns(width), rows(height);
    double mean = 0;
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const double v = values[y * width + x];
            columns[x] += v / static_cast<double>(height);
            rows[y] += v / static_cast<double>(width);
            mean += v / static_cast<double>(values.size());
        }
    const auto variance = [mean](std::span<const double> of) {
        double sum = 0;
        for (const double v : of)
            sum += (v - mean) * (v - mean);
        return sum / static_cast<double>(of.size() - 1);
    };
    // The mean of a column still holds the pixels' variance over the number of rows, that of a row over the
    // number of columns, and the variance of all is the sum of the three: solve for them.
    const double of_columns = variance(columns), of_rows = variance(rows), of_all = variance(values);
    SpatialVariances parts;
    const auto m = static_cast<double>(height), n = static_cast<double>(width);
    parts.pixel = (of_all - of_columns - of_rows) / (1 - 1 / m - 1 / n);
    parts.column = of_columns - parts.pixel / m;
    parts.row = of_rows - parts.pixel / n;
    return parts;
}

SpatialVariances operator-(const SpatialVariances& a, const SpatialVariances& b) {
    return {a.column - b.column, a.row - b.row, a.pixel - b.pixel};
}

SpatialVariances ImageStack::spatial_parts(std::size_t width, double temporal) const {
    std::vector<double> means(pixels());
    for (std::size_t i = 0; i < means.size(); ++i)
        means[i] = pixel(i);
    SpatialVariances parts = split_variance(means, width);
    parts.pixel -= temporal / static_cast<double>(count_);
    return parts;
}

Line fit_line(std::span<const double> x, std::span<const double> y) {
    assert(x.size() == y.size() && x.size() > 1);
    double mx = 0, my = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        mx += x[i], my += y[i];
    mx /= static_cast<double>(x.size()), my /= static_cast<double>(x.size());
    double xy = 0, xx = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        xy += (x[i] - mx) * (y[i] - my), xx += (x[i] - mx) * (x[i] - mx);
    return {xy / xx, my - xy / xx * mx};
}

} // namespace obscura::sensors::emva1288
