// SPDX-License-Identifier: Apache-2.0
// Sparse sample grid: one camera ray for 1, 4 or 16 pixels, interpolated; for frames that are short of time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Points `step` pixels apart, all displaced by one random shift of each frame, over a window and two points
/// beyond it. Different threads may fill different rows, then estimate them.
class SparseGrid {
public:
    /// Sets all to 0 for the sensor's pixels [x, x + width) of rows [y, y + height). `response_px`: standard
    /// deviation of a pixel's response, PSF and pixel.
    void reset(std::int32_t step, std::int32_t x, std::int32_t width, std::int32_t y, std::int32_t height,
               std::size_t channels, double response_px, std::uint64_t seed, std::uint64_t frame_id);
    [[nodiscard]] std::int32_t step() const { return step_; }
    [[nodiscard]] std::int32_t rows() const { return rows_; }
    /// Points of a row: whole packets.
    [[nodiscard]] std::int32_t columns() const { return columns_; }
    /// Place of a point on the sensor, px.
    [[nodiscard]] double x_of(std::int32_t column) const { return first_x_ + column * step_ + shift_x_; }
    [[nodiscard]] double y_of(std::int32_t row) const { return first_y_ + row * step_ + shift_y_; }
    /// The first of the two rows of points about the sensor's row `y`.
    [[nodiscard]] std::int32_t row_about(std::int32_t y) const {
        return between(y, first_y_, shift_y_).first;
    }
    /// Points of a row in the first channel; those of the next lie plane() further.
    [[nodiscard]] float* row(std::int32_t r) {
        return values_.data() + static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_);
    }
    [[nodiscard]] std::size_t plane() const {
        return static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_);
    }
    /// Whether the points of a row have been traced.
    [[nodiscard]] std::uint8_t& filled(std::int32_t r) { return filled_[static_cast<std::size_t>(r)]; }
    /// Whether a row has been estimated, and whether it can be.
    [[nodiscard]] bool estimated(std::int32_t r) const {
        return estimated_[static_cast<std::size_t>(r)] != 0;
    }
    [[nodiscard]] bool can_estimate(std::int32_t r) const {
        const auto at = static_cast<std::size_t>(r);
        return filled_[at - 1] == 1 && filled_[at] == 1 && filled_[at + 1] == 1;
    }
    /// Whether the sensor's row `y` can be taken.
    [[nodiscard]] bool ready(std::int32_t y) const {
        const std::int32_t r = row_about(y);
        return estimated(r) && estimated(r + 1);
    }

    /// Interpolates channel `c` at the pixels from `x` of the sensor's row `y`.
    void interpolate(std::size_t c, std::int32_t x, std::int32_t y, std::span<double> out) const;
    /// Estimates the variance of pixels interpolated from a row of points, which has been traced as have the
    /// rows above and below, by the second differences of the mean over the channels, along it and across.
    void estimate(std::int32_t r, std::size_t channels);
    /// The variance of the pixels of interpolate(), after estimate() of the two rows about them.
    void variance(std::int32_t x, std::int32_t y, std::span<double> out) const;

private:
    struct Between {
        std::int32_t first; ///< of the two points about a pixel
        double share;       ///< of the second one
    };
    [[nodiscard]] Between between(std::int32_t pixel, std::int32_t first, double shift) const;
    [[nodiscard]] double point(std::size_t channels, std::int32_t column, std::int32_t row) const;

    std::vector<float> values_;
    std::vector<float> variance_; ///< of pixels about each point, as estimated
    std::vector<std::uint8_t> filled_, estimated_;
    std::int32_t step_ = 0, rows_ = 0, columns_ = 0;
    double response_ = 0;                    ///< steps
    std::int32_t first_x_ = 0, first_y_ = 0; ///< multiples of the step, of 16 steps along rows
    double shift_x_ = 0, shift_y_ = 0;       ///< px, 0 .. step
};

} // namespace obscura::renderer
