// What the screen must show so that the camera looking at it sees the scene.
#pragma once

#include "core/region.hpp"
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
    std::int32_t sensor_width = 0, sensor_height = 0; ///< the image to be seen, in the camera's own pixels
    std::int32_t levels = 256;                        ///< drive levels of the screen
    double dn_black = 0;                              ///< digital number that means no light
    double dn_white = 65535;                          ///< digital number that means `peak`
    /// Luminance for `dn_white` as seen by the camera, relative to the brightest place of the screen. 0: as
    /// much as the weakest place can give, so that white is white everywhere.
    double peak = 0;
    Dither dither = Dither::both;
    bool use_uniformity = true;
    bool hide_dead_pixels = true; ///< their neighbours show what they cannot

    bool operator==(const OpticalSettings&) const = default;
};

/// The optical stage. For screen pixel p the camera sees at c = map(p):
///     luminance(p) = peak * (DN(c) - black) / (white - black) / uniformity(p)
/// DN(c) is interpolated linearly; where a screen pixel covers more than one camera pixel, it is averaged
/// over the screen pixel's footprint, so that no star slips between two samples. Dead pixels hand their light
/// in equal shares to those of their four neighbours that live. The drive level is the curve's inverse, and
/// its fraction is dithered. Same input and frame number, same levels. One thread; no allocation after
/// construction.
class OpticalStage {
public:
    /// Without a table the camera sees the screen pixel for pixel from the upper left corner on, and the
    /// screen is linear. Throws ConfigError when table and settings do not fit each other.
    OpticalStage(const OpticalSettings& settings, const CalibrationTable* table);

    /// The part of the screen that shows anything of the camera's `window`; empty (width 0) when nothing
    /// does.
    [[nodiscard]] Region screen_region(const Region& window) const;
    /// The last row of the camera image that screen rows up to and including `screen_y` look at; -1 when
    /// none.
    [[nodiscard]] std::int32_t last_camera_row(std::int32_t screen_y) const {
        return last_row_[static_cast<std::size_t>(screen_y)];
    }

    /// Computes the rows [from, to) of `rect` from `image` (sensor_width x sensor_height digital numbers).
    /// Rows of one rectangle come in order from its first to its last. Writes to `levels`, which is the whole
    /// screen, row by row; while dead pixels are hidden the last row waits for the next call.
    void render(std::span<const std::uint16_t> image, const Region& rect, std::int32_t from, std::int32_t to,
                std::uint64_t frame, std::span<std::uint16_t> levels) noexcept;

    [[nodiscard]] const OpticalSettings& settings() const { return settings_; }
    /// The `peak` in use.
    [[nodiscard]] double peak() const { return peak_; }
    /// Screen pixels that were asked for more light than they have, since the start.
    [[nodiscard]] std::uint64_t clipped() const { return clipped_; }

private:
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
    std::vector<float> light_;       // luminance each screen pixel should show by itself
    std::vector<float> shown_;       // one row: with what dead neighbours handed over
    std::vector<std::uint8_t> dead_; // 1 for dead pixels; empty: none
    std::uint64_t clipped_ = 0;
};

} // namespace obscura::transports
