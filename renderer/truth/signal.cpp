// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/signal.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Squared shares beyond this distance add nothing to the noise-equivalent area.
constexpr double area_reach_px = 8;
/// Steps along a streak.
constexpr double signal_step_px = 0.25;

/// Share of the light of a point in a pixel.
class PointWeights {
public:
    PointWeights(const TruthScene& scene, std::span<const double> band_weights)
        : scene_(scene), band_weights_(band_weights) {
        for (const double w : band_weights)
            sum_ += w;
        reach_px_ = scene.psf != nullptr ? scene.psf->reach_px() : scene.gaussian_psf.splat_reach_px();
    }
    [[nodiscard]] double reach_px() const { return reach_px_; }
    [[nodiscard]] double operator()(ImagePoint at, std::int32_t column, std::int32_t row) const {
        if (scene_.psf == nullptr)
            return scene_.gaussian_psf.x.weight(at.x, column) * scene_.gaussian_psf.y.weight(at.y, row);
        if (!(sum_ > 0)) return scene_.psf->weight(at, column, row, 0);
        double weight = 0;
        for (std::size_t b = 0; b < band_weights_.size(); ++b)
            if (band_weights_[b] > 0) weight += band_weights_[b] * scene_.psf->weight(at, column, row, b);
        return weight / sum_;
    }

private:
    const TruthScene& scene_;
    std::span<const double> band_weights_;
    double sum_ = 0, reach_px_ = 0;
};

} // namespace

PointImage image_of_point(const TruthScene& scene, ImagePoint at, ImagePoint streak,
                          std::span<const double> band_weights) {
    const PointWeights weight(scene, band_weights);
    PointImage out;
    const double reach = std::min(weight.reach_px(), area_reach_px);
    const auto first = [&](double a) { return static_cast<std::int32_t>(std::floor(a - reach)); };
    const auto last = [&](double a) { return static_cast<std::int32_t>(std::ceil(a + reach)); };
    double squares = 0, peak = 0;
    for (std::int32_t row = first(at.y); row <= last(at.y); ++row)
        for (std::int32_t column = first(at.x); column <= last(at.x); ++column) {
            const double w = weight(at, column, row);
            squares += w * w;
            peak = std::max(peak, w);
        }
    if (!(squares > 0)) return out;
    out.peak_share = peak;
    out.area_px = 1 / squares;
    const double length = std::hypot(streak.x, streak.y);
    if (length < signal_step_px) return out;
    // The middle pixel and its neighbours see the part of the streak that is within reach of them.
    const double half = std::min(length / 2, weight.reach_px() + 2);
    const int steps = std::max(1, static_cast<int>(std::ceil(2 * half / signal_step_px)));
    double brightest = 0;
    const auto column0 = static_cast<std::int32_t>(std::lround(at.x));
    const auto row0 = static_cast<std::int32_t>(std::lround(at.y));
    for (std::int32_t row = row0 - 1; row <= row0 + 1; ++row)
        for (std::int32_t column = column0 - 1; column <= column0 + 1; ++column) {
            double sum = 0;
            for (int i = 0; i < steps; ++i) {
                const double along = ((i + 0.5) / steps - 0.5) * 2 * half / length;
                sum += weight({at.x + along * streak.x, at.y + along * streak.y}, column, row);
            }
            brightest = std::max(brightest, sum / steps * 2 * half / length);
        }
    if (!(brightest > 0)) return out;
    out.area_px *= std::max(1.0, peak / brightest);
    out.peak_share = std::min(peak, brightest);
    return out;
}

void set_signal(TruthEntry& entry, const TruthDetector& detector, double signal_e, const PointImage& image) {
    const double dark_e = detector.dark_e_per_s * to_seconds(entry.exposure_ns);
    entry.signal_e = signal_e;
    entry.peak_e = signal_e * image.peak_share;
    const double variance = signal_e + image.area_px * (dark_e + detector.noise_e * detector.noise_e);
    entry.snr = variance > 0 ? signal_e / std::sqrt(variance) : 0;
    entry.saturated = entry.peak_e + dark_e >= detector.saturation_e;
}

} // namespace obscura::renderer
