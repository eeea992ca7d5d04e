// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/binning.hpp"

#include <algorithm>
#include <cassert>

namespace obscura::transports::gige {

void RowBinner::reserve(std::int32_t width) {
    totals_.resize(static_cast<std::size_t>(width));
    binned_.resize(static_cast<std::size_t>(width));
}

std::span<const std::uint16_t> RowBinner::row(const Frame& frame, std::int32_t image_row, std::int32_t width,
                                              PixelFormat format, const Binning& binning) noexcept {
    const auto columns = static_cast<std::size_t>(width);
    const auto side = static_cast<std::size_t>(binning.horizontal);
    assert(columns <= totals_.size());
    const auto totals = std::span(totals_).first(columns);
    std::fill(totals.begin(), totals.end(), 0U);
    for (std::int32_t r = 0; r < binning.vertical; ++r) {
        const std::uint16_t* pixel = frame.row(image_row * binning.vertical + r).data();
        for (std::uint32_t& total : totals)
            for (std::size_t i = 0; i < side; ++i)
                total += *pixel++;
    }
    const std::uint32_t parts =
        (binning.horizontal_mode == BinningMode::average ? static_cast<std::uint32_t>(binning.horizontal)
                                                         : 1U) *
        (binning.vertical_mode == BinningMode::average ? static_cast<std::uint32_t>(binning.vertical) : 1U);
    // Packing drops the low bits of numbers that are deeper than the format, so both have the same full
    // scale.
    const std::uint32_t largest =
        (1U << std::clamp(std::max(significant_bits(format), frame.info.bits_per_pixel), 1, 16)) - 1;
    std::transform(totals.begin(), totals.end(), binned_.begin(), [=](std::uint32_t total) {
        return static_cast<std::uint16_t>(std::min((total + parts / 2) / parts, largest));
    });
    return std::span(binned_).first(columns);
}

} // namespace obscura::transports::gige
