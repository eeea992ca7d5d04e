// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/calibrate.hpp"

#include "core/error.hpp"
#include "transports/stimulator/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::transports {
namespace {

/// Stripes of lower contrast count as not resolved.
constexpr double stripe_contrast = 0.35;

double percentile(std::vector<float> values, double share) {
    if (values.empty()) return 0;
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

} // namespace

double median(std::vector<float> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

CalibrationTable Calibration::run() {
    find_screen();
    decode_all();
    first_homography();
    find_dots();
    fit_map();
    measure_curve();
    measure_uniformity();
    if (settings_.find_dead_pixels) find_dead_pixels();
    return std::move(table_);
}

void Calibration::fail(const std::string& line) {
    throw InputError("calibration: " + line);
}

const Calibration::Image& Calibration::need(const std::string& name) {
    const Capture* capture = capture_(name);
    if (capture == nullptr) fail(fmt::format("capture '{}' is missing", name));
    if (width_ == 0) {
        width_ = capture->width;
        height_ = capture->height;
        if (width_ < 16 || height_ < 16)
            fail(fmt::format("capture '{}' has {}x{} pixels", name, width_, height_));
    }
    if (capture->width != width_ || capture->height != height_)
        fail(fmt::format("capture '{}' has {}x{} pixels, the others have {}x{}", name, capture->width,
                         capture->height, width_, height_));
    return capture->pixels;
}

void Calibration::find_screen() {
    const Image& white = need("white");
    const Image& black = need("black");
    if (settings_.camera_width > 0 &&
        (width_ != settings_.camera_width || height_ != settings_.camera_height))
        fail(fmt::format("captures have {}x{} pixels, the sensor has {}x{}", width_, height_,
                         settings_.camera_width, settings_.camera_height));
    dark_ = capture_("dark") != nullptr ? need("dark") : black;
    const std::size_t n = white.size();
    std::size_t saturated = 0;
    contrast_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        contrast_[i] = white[i] - black[i];
        saturated += white[i] >= settings_.saturation ? 1 : 0;
    }
    if (static_cast<double>(saturated) > 0.001 * static_cast<double>(n))
        fail(fmt::format("capture 'white': {:.1f} % of the pixels are saturated, expose for less",
                         100.0 * static_cast<double>(saturated) / static_cast<double>(n)));
    usual_ = percentile(contrast_, 0.95);
    // Estimate the noise from the differences of neighbouring pixels in the dark.
    std::vector<float> steps;
    for (std::size_t i = 1; i < n; i += 3)
        steps.push_back(std::abs(black[i] - black[i - 1]));
    noise_ = std::max(median(steps), 1e-6);
    if (!(usual_ > 10 * noise_))
        fail(fmt::format(
            "capture 'white' is brighter than 'black' by {:.1f} DN only, with a noise of {:.1f} DN", usual_,
            noise_));
    seen_.assign(n, 0);
    std::size_t seen = 0;
    for (std::size_t i = 0; i < n; ++i)
        if (contrast_[i] > seen_fraction * usual_) {
            seen_[i] = 1;
            ++seen;
        }
    report_.seen_percent = 100.0 * static_cast<double>(seen) / static_cast<double>(n);
    if (report_.seen_percent < 1)
        fail(fmt::format("the camera sees the screen in {:.2f} % of its pixels only", report_.seen_percent));
}

int Calibration::decode(const char* what, int bits, std::int32_t side, Image& position) {
    const std::size_t n = contrast_.size();
    std::vector<std::uint32_t> code(n, 0);
    int resolved = 0;
    for (int bit = 0; bit < bits; ++bit) {
        const Image& plain = need(fmt::format("{}_{:02}", what, bit));
        const Image& inverse = need(fmt::format("{}_{:02}_inverse", what, bit));
        std::vector<float> strength;
        for (std::size_t i = 0; i < n; i += 7)
            if (seen_[i] != 0) strength.push_back(std::abs(plain[i] - inverse[i]) / contrast_[i]);
        const double typical = median(strength);
        if (typical < stripe_contrast) break;
        for (std::size_t i = 0; i < n; ++i)
            code[i] = code[i] << 1 | (plain[i] > inverse[i] ? 1u : 0u);
        ++resolved;
    }
    if (resolved < std::min(3, bits))
        fail(fmt::format(
            "the stripes of '{}_{:02}' cannot be told from each other; is the order right, is it sharp?",
            what, resolved));
    const int cell = 1 << (bits - resolved);
    position.assign(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
        if (seen_[i] == 0) continue;
        position[i] = static_cast<float>(from_gray(code[i])) * static_cast<float>(cell) +
                      static_cast<float>(cell - 1) * 0.5F;
        if (position[i] >= static_cast<float>(side)) seen_[i] = 0;
    }
    return cell;
}

void Calibration::decode_all() {
    report_.finest_column_stripe = decode("column", sequence_.column_bits(), sequence_.width(), x_);
    report_.finest_row_stripe = decode("row", sequence_.row_bits(), sequence_.height(), y_);
}

void Calibration::first_homography() {
    std::vector<PixelPoint> from, to;
    const std::size_t step = std::max<std::size_t>(1, contrast_.size() / 20000);
    for (std::size_t i = 0; i < contrast_.size(); i += step) {
        if (seen_[i] == 0) continue;
        from.push_back({x_[i], y_[i]});
        to.push_back({static_cast<double>(i % static_cast<std::size_t>(width_)),
                      static_cast<double>(i / static_cast<std::size_t>(width_))});
    }
    const auto all_from = from, all_to = to;
    for (int pass = 0; pass < 5; ++pass) {
        if (!fit_homography(from, to, rough_)) fail("the decoded stripes do not cover an area");
        std::vector<float> miss;
        for (std::size_t i = 0; i < all_from.size(); ++i) {
            const PixelPoint p = rough_(all_from[i]);
            miss.push_back(static_cast<float>(std::hypot(p.x - all_to[i].x, p.y - all_to[i].y)));
        }
        // Reject outliers: a wrongly decoded pixel is far off.
        limit_ = std::max(2.0, 4 * median(miss));
        from.clear();
        to.clear();
        for (std::size_t i = 0; i < all_from.size(); ++i)
            if (miss[i] <= limit_) {
                from.push_back(all_from[i]);
                to.push_back(all_to[i]);
            }
    }
    if (from.size() < all_from.size() / 2)
        fail("the decoded stripes contradict each other; were camera, screen and light at rest?");
}

CalibrationTable calibrate(const PatternSequence& sequence,
                           const std::function<const Capture*(const std::string&)>& capture,
                           const CalibrationSettings& settings, CalibrationReport& report) {
    return Calibration(sequence, capture, settings, report).run();
}

} // namespace obscura::transports
