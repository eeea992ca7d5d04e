// SPDX-License-Identifier: Apache-2.0
#include "sensors/response_pattern.hpp"

#include "sensors/kernels.hpp"
#include "sensors/streams.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace obscura::sensors {
namespace {

std::vector<double> pattern_normals(Effect effect, std::uint64_t seed, std::size_t n) {
    std::vector<float> z0(n + kernels::padding), z1(n + kernels::padding);
    kernels::normal_row(n, stream_of(effect, seed, 0, 0), z0.data(), z1.data());
    return {z0.begin(), z0.begin() + static_cast<std::ptrdiff_t>(n)};
}

/// Subtracts the mean; returns the mean square of the rest.
double centre(std::vector<double>& values) {
    const double n = static_cast<double>(values.size());
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
    double squares = 0;
    for (double& v : values) {
        v -= mean;
        squares += v * v;
    }
    return squares / n;
}

void scale(std::vector<double>& values, double factor) {
    for (double& v : values)
        v *= factor;
}

/// Pattern that is the sum of a profile over the columns and one over the rows.
struct Profiles {
    std::vector<double> column, row;

    /// Adds `weight` times `other` at mean 0 and rms 1.
    void add(Profiles other, double weight) {
        const double rms = std::sqrt(centre(other.column) + centre(other.row));
        if (!(rms > 0)) return;
        const auto into = [&](std::vector<double>& sum, const std::vector<double>& part) {
            std::transform(sum.begin(), sum.end(), part.begin(), sum.begin(),
                           [&](double s, double p) { return s + weight / rms * p; });
        };
        into(column, other.column);
        into(row, other.row);
    }
};

/// Global part of the response at rms 1 and mean 0 over the array.
class GlobalPart {
public:
    GlobalPart(const SensorDescription& d, std::uint64_t seed)
        : width_(static_cast<std::size_t>(d.readout.width)),
          height_(static_cast<std::size_t>(d.readout.height)),
          fields_across_(static_cast<std::size_t>(d.detector.stitch_columns)),
          fields_down_(static_cast<std::size_t>(d.detector.stitch_rows)),
          smooth_{std::vector<double>(width_), std::vector<double>(height_)},
          fields_(fields_across_ * fields_down_) {
        const DetectorSettings& s = d.detector;
        const auto words = words_of(stream_of(Effect::response_shape, seed, 0, 0));
        const double w = static_cast<double>(width_), h = static_cast<double>(height_);

        Profiles bowl = smooth_, gradient = smooth_, columns = smooth_;
        const double x0 = w * (0.5 + 0.1 * (uniform_double(words[0]) - 0.5));
        const double y0 = h * (0.5 + 0.1 * (uniform_double(words[1]) - 0.5));
        const double angle = 2 * std::numbers::pi * uniform_double(words[2]);
        for (std::size_t x = 0; x < width_; ++x) {
            const double at = static_cast<double>(x) + 0.5;
            bowl.column[x] = -(at - x0) * (at - x0);
            gradient.column[x] = at * std::cos(angle);
        }
        for (std::size_t y = 0; y < height_; ++y) {
            const double at = static_cast<double>(y) + 0.5;
            bowl.row[y] = -(at - y0) * (at - y0);
            gradient.row[y] = at * std::sin(angle);
        }
        columns.column = pattern_normals(Effect::response_columns, seed, width_);
        smooth_.add(std::move(bowl), s.prnu_bowl_weight);
        smooth_.add(std::move(gradient), s.prnu_gradient_weight);
        smooth_.add(std::move(columns), s.prnu_column_weight);
        if (fields_.size() > 1) {
            fields_ = pattern_normals(Effect::response_fields, seed, fields_.size());
            scale(fields_, s.prnu_stitching_weight / std::sqrt(std::max(centre(fields_), 1e-30)));
        }

        double sum = 0, squares = 0;
        for (std::size_t y = 0; y < height_; ++y)
            for (std::size_t x = 0; x < width_; ++x) {
                const double v = raw(x, y);
                sum += v;
                squares += v * v;
            }
        mean_ = sum / (w * h);
        rms_ = std::sqrt(std::max(squares / (w * h) - mean_ * mean_, 0.0));
    }

    [[nodiscard]] double at(std::size_t x, std::size_t y) const {
        return rms_ > 0 ? (raw(x, y) - mean_) / rms_ : 0;
    }

private:
    [[nodiscard]] double raw(std::size_t x, std::size_t y) const {
        return smooth_.column[x] + smooth_.row[y] +
               fields_[y * fields_down_ / height_ * fields_across_ + x * fields_across_ / width_];
    }

    std::size_t width_, height_, fields_across_, fields_down_;
    Profiles smooth_;
    std::vector<double> fields_; ///< gain of each field of a stitched exposure
    double mean_ = 0, rms_ = 0;
};

} // namespace

std::vector<float> response_pattern(const SensorDescription& d) {
    const DetectorSettings& s = d.detector;
    if (s.prnu_local == 0 && s.prnu_global == 0) return {};
    const std::uint64_t seed = d.serial ^ pattern_key;
    const auto width = static_cast<std::size_t>(d.readout.width);
    const std::size_t n = width * static_cast<std::size_t>(d.readout.height);
    std::vector<float> map(n + kernels::padding), unused(n + kernels::padding);
    kernels::normal_row(n, stream_of(Effect::response, seed, 0, 0), map.data(), unused.data());
    map.resize(n);
    std::optional<GlobalPart> global; // visits every pixel
    if (s.prnu_global != 0) global.emplace(d, seed);
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const double white = static_cast<double>(map[i]);
        map[i] = static_cast<float>(std::max(
            0.0, 1 + s.prnu_local * white + (global ? s.prnu_global * global->at(i % width, i / width) : 0)));
        sum += static_cast<double>(map[i]);
    }
    const double mean = sum / static_cast<double>(n);
    for (float& v : map)
        v = static_cast<float>(static_cast<double>(v) / mean);
    return map;
}

std::string explain_invalid_prnu(const DetectorSettings& s) {
    const bool stitched = s.stitch_columns > 1 || s.stitch_rows > 1;
    const double weights = s.prnu_bowl_weight + s.prnu_gradient_weight + s.prnu_column_weight +
                           (stitched ? s.prnu_stitching_weight : 0);
    if (s.prnu_global == 0 || weights > 0) return {};
    return "prnu_global needs a weight above 0: prnu_bowl_weight, prnu_gradient_weight, prnu_column_weight, or prnu_stitching_weight with more than one field";
}

} // namespace obscura::sensors
