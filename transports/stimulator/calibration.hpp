// SPDX-License-Identifier: Apache-2.0
// Steps of calibrate() and what they hand to each other.
#pragma once

#include "transports/stimulator/calibrate.hpp"
#include "transports/stimulator/polynomial_surface.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace obscura::transports {

/// 0 without values.
double median(std::vector<float> values);

/// One calibration, from the first capture to the table.
class Calibration {
public:
    Calibration(const PatternSequence& sequence,
                const std::function<const Capture*(const std::string&)>& capture,
                const CalibrationSettings& settings, CalibrationReport& report)
        : sequence_(sequence), capture_(capture), settings_(settings), report_(report) {}

    CalibrationTable run();

private:
    using Image = std::vector<float>;

    /// Fraction of the usual contrast below which a camera pixel does not see the screen.
    static constexpr double seen_fraction = 0.15;

    [[noreturn]] static void fail(const std::string& line);
    const Image& need(const std::string& name);
    [[nodiscard]] std::size_t at(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }

    void find_screen();
    /// Decodes the screen coordinate of every camera pixel that sees the screen. Returns the width of the
    /// finest stripes resolved.
    int decode(const char* what, int bits, std::int32_t side, Image& position);
    void decode_all();
    void first_homography();

    void find_dots();
    /// Centroid of the light of a dot near `centre`; returns false if there is no dot.
    [[nodiscard]] bool centroid(const Image& dots, const Image& black, double scale,
                                PixelPoint& centre) const;
    void fit_map();
    [[nodiscard]] bool reject_dots(const std::vector<double>& miss);
    void fit_surfaces(PolynomialSurface& du, PolynomialSurface& dv);
    void place_nodes(const PolynomialSurface& du, const PolynomialSurface& dv);
    void add_residuals(const PolynomialSurface& du, const PolynomialSurface& dv);

    void measure_curve();
    void measure_uniformity();
    void find_dead_pixels();
    /// Finds spots whose light is too low or too high by about one screen pixel's light or more.
    void collect(const Image& off);
    void mark(const Image& off, const std::vector<std::size_t>& spot);

    const PatternSequence& sequence_;
    const std::function<const Capture*(const std::string&)>& capture_;
    const CalibrationSettings& settings_;
    CalibrationReport& report_;
    std::int32_t width_ = 0, height_ = 0;
    Image dark_, contrast_;
    double usual_ = 0, noise_ = 0, white_level_ = 1, limit_ = 2;
    std::vector<std::uint8_t> seen_;
    Image x_, y_; ///< screen position that each camera pixel sees
    Homography rough_;
    std::vector<PixelPoint> dot_screen_, dot_camera_;
    std::vector<int> dot_index_;
    CalibrationTable table_;
};

} // namespace obscura::transports
