// SPDX-License-Identifier: Apache-2.0
// Optical stage of the stimulator: drive levels of a screen from the digital numbers the camera must see.
#pragma once

#include "core/camera/region.hpp"
#include "transports/stimulator/calibration_table.hpp"
#include "transports/stimulator/dither.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::transports {

/// Sizes, digital numbers and luminances between which the optical stage maps.
struct OpticalSettings {
    std::int32_t screen_width = 0, screen_height = 0; ///< pixels
    std::int32_t sensor_width = 0, sensor_height = 0; ///< input image, camera pixels
    std::int32_t levels = 256;                        ///< drive levels of the screen
    double dn_black = 0;                              ///< digital number that means no light
    double dn_white = 65535;                          ///< digital number that means `peak`
    /// Luminance for `dn_white` as seen by the camera, relative to the brightest point of the screen. 0: the
    /// maximum luminance of the darkest point, so that white is uniform.
    double peak = 0;
    Dither dither = Dither::both;
    bool use_uniformity = true;
    bool hide_dead_pixels = true; ///< add the light of dead pixels to their neighbours

    bool operator==(const OpticalSettings&) const = default;
};

/// The optical stage. For screen pixel p the camera sees at c = map(p):
///     luminance(p) = peak * (DN(c) - black) / (white - black) / uniformity(p)
/// DN(c) is interpolated linearly; where a screen pixel covers more than one camera pixel, it is averaged
/// over the screen pixel's footprint, so that no star is lost between two samples. The light of a dead pixel
/// is shared equally by its working neighbours among the four adjacent. The drive level is the curve's
/// inverse, and its fraction is dithered. The same input and frame number give the same levels. Thread-bound;
/// no allocation after construction.
class OpticalStage {
public:
    /// A null table means that the camera sees the screen pixel for pixel from the upper left corner on, and
    /// that the screen is linear. Throws ConfigError if table and settings contradict each other.
    OpticalStage(const OpticalSettings& settings, const CalibrationTable* table);

    /// Region of the screen that shows any part of the camera's `window`; empty (width 0) if none does.
    [[nodiscard]] Region screen_region(const Region& window) const;
    /// Last row of the camera image that screen rows up to and including `screen_y` depend on; -1 if none.
    [[nodiscard]] std::int32_t last_camera_row(std::int32_t screen_y) const {
        return last_row_[static_cast<std::size_t>(screen_y)];
    }

    /// Computes the rows [from, to) of `rect` from `image` (sensor_width x sensor_height digital numbers).
    /// Rows of one rectangle must come in order from its first to its last. Writes to `levels`, which holds
    /// the full screen row by row; with hidden dead pixels the last row is written by the next call.
    void render(std::span<const std::uint16_t> image, const Region& rect, std::int32_t from, std::int32_t to,
                std::uint64_t frame, std::span<std::uint16_t> levels) noexcept;

    [[nodiscard]] const OpticalSettings& settings() const { return settings_; }
    /// Effective `peak`.
    [[nodiscard]] double peak() const { return peak_; }
    /// Count of clipped screen pixels, which needed more than their maximum luminance, since construction.
    [[nodiscard]] std::uint64_t clipped() const { return clipped_; }

private:
    [[nodiscard]] double map_screen(const CalibrationTable& table);
    [[nodiscard]] float sample(std::span<const std::uint16_t> image, float u, float v) const noexcept;
    [[nodiscard]] std::size_t at(std::int32_t x, std::int32_t y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(settings_.screen_width) +
               static_cast<std::size_t>(x);
    }
    void light_row(std::span<const std::uint16_t> image, const Region& rect, std::int32_t y) noexcept;
    void spread_row(const Region& rect, std::int32_t y) noexcept;
    void drive_row(const Region& rect, std::int32_t y, std::uint64_t frame,
                   std::span<std::uint16_t> levels) noexcept;

    OpticalSettings settings_;
    RadiometricCurve curve_;
    double peak_ = 1;
    bool direct_ = true;       // screen pixel = camera pixel
    double widest_ = 0;        // largest distance of neighbouring screen pixels, in camera pixels
    int samples_ = 1;          // sub-samples a side of the footprint
    std::vector<float> u_, v_; // camera position of each screen pixel; empty when direct
    std::vector<float> gain_;  // luminance per digital number above black; empty: gain0_
    float gain0_ = 1;
    std::vector<std::int32_t> last_row_;
    std::vector<float> light_;       // luminance of each screen pixel before sharing
    std::vector<float> shown_;       // one row: luminance with the shares of dead neighbours
    std::vector<std::uint8_t> dead_; // 1 for dead pixels; empty: none
    std::uint64_t clipped_ = 0;
};

} // namespace obscura::transports
