// SPDX-License-Identifier: Apache-2.0
// Digital binning (SFNC): digital numbers of neighbouring pixels are combined when a frame is sent.
#pragma once

#include "core/camera/frame.hpp"

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace obscura::transports::gige {

/// SFNC BinningHorizontalMode, BinningVerticalMode.
enum class BinningMode : std::uint8_t { sum, average };

/// SFNC BinningHorizontal, BinningVertical and their modes. The sensor exposes and reads every pixel; only
/// its digital numbers are binned, not its charge.
struct Binning {
    std::int32_t horizontal = 1, vertical = 1; ///< 1, 2 or 4
    BinningMode horizontal_mode = BinningMode::sum, vertical_mode = BinningMode::sum;

    constexpr bool operator==(const Binning&) const = default;
    [[nodiscard]] constexpr bool active() const noexcept { return horizontal > 1 || vertical > 1; }
    /// The rectangle of the binned image; columns and rows that do not fill a binned pixel are left out.
    [[nodiscard]] constexpr Region of(const Region& pixels) const noexcept {
        return {pixels.x / horizontal, pixels.y / vertical, pixels.width / horizontal,
                pixels.height / vertical};
    }
};

/// Range and step of Width, Height or an offset, in binned pixels.
struct BinnedExtent {
    std::int32_t minimum = 1, maximum = 1, step = 1;
};
/// Extent along a side of `pixels` sensor pixels, of which at least `minimum` are read, in steps of `step`.
[[nodiscard]] constexpr BinnedExtent binned_extent(std::int32_t pixels, std::int32_t minimum,
                                                   std::int32_t step, std::int32_t binning) noexcept {
    const std::int32_t common = std::lcm(step, binning);
    return {(minimum + common - 1) / common * common / binning, pixels / common * common / binning,
            common / binning};
}

/// Combines sensor rows into binned rows. Thread-bound; only reserve() allocates.
class RowBinner {
public:
    void reserve(std::int32_t width);
    /// Row `image_row` of the binned image of `frame`, as digital numbers of its ADC: a sum saturates at the
    /// largest number of `format` or of the ADC, whichever is larger; an average rounds half up, once for
    /// both directions. Valid until the next call. `width` is in binned pixels, at most that of reserve().
    std::span<const std::uint16_t> row(const Frame& frame, std::int32_t image_row, std::int32_t width,
                                       PixelFormat format, const Binning& binning) noexcept;

private:
    std::vector<std::uint32_t> totals_;
    std::vector<std::uint16_t> binned_;
};

} // namespace obscura::transports::gige
