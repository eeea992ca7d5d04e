// SPDX-License-Identifier: Apache-2.0
// View of an image: a part of it, binned to what a screen shows; histogram of all of it.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::web {

/// What becomes of the pixels of a bin.
enum class Reduce : std::uint8_t {
    max,  ///< the largest: stars and hot pixels stay, noise and background are biased
    mean, ///< rounded to the nearest, halves up
};
constexpr auto enum_names(Reduce /*type*/) {
    return std::array{EnumName{Reduce::max, "max"}, EnumName{Reduce::mean, "mean"}};
}

/// What stands behind the header of a picture, byte 51 of which has it.
enum class PictureEncoding : std::uint8_t {
    u16,       ///< digital numbers
    jpeg,      ///< 8-bit grey, with the contrast of previews
    automatic, ///< of a request: digital numbers, or JPEG where larger bins would be needed
};
constexpr auto enum_names(PictureEncoding /*type*/) {
    return std::array{EnumName{PictureEncoding::u16, "u16"}, EnumName{PictureEncoding::jpeg, "jpeg"},
                      EnumName{PictureEncoding::automatic, "auto"}};
}

/// Pixels [x, x + width) x [y, y + height) of an image, bin x bin of them to one; bins at the right and the
/// lower edge may have fewer.
struct View {
    static constexpr std::uint32_t max_bin = 64; ///< a power of two, as all bins
    static constexpr std::uint32_t max_side = 65535;

    std::uint32_t x = 0, y = 0, width = 0, height = 0; ///< width or height 0: up to the image's edge
    std::uint32_t bin = 1;
    Reduce reduce = Reduce::max;

    bool operator==(const View&) const = default;
    [[nodiscard]] std::size_t columns() const { return (std::size_t{width} + bin - 1) / bin; }
    [[nodiscard]] std::size_t rows() const { return (std::size_t{height} + bin - 1) / bin; }
    /// Size of its 16-bit numbers.
    [[nodiscard]] std::size_t bytes() const { return 2 * columns() * rows(); }
};

/// The part of `view` that is in an image of at least one pixel: at least one pixel, too.
[[nodiscard]] View clipped(const View& view, std::uint32_t image_width, std::uint32_t image_height);

/// The pixels of a view that is within the image, row-major. Any values give a result, also while they
/// change.
[[nodiscard]] std::vector<std::uint16_t> reduced(std::span<const std::uint16_t> image,
                                                 std::uint32_t image_width, const View& view);

/// Digital numbers of an image, each pixel counted.
struct Histogram {
    std::array<std::uint64_t, 256> bins{}; ///< of equal width over 0 .. 2^bits - 1
    std::uint64_t saturated = 0;           ///< pixels at 2^bits - 1 or above
    std::uint16_t min = 0, max = 0;
    std::uint16_t p50 = 0, p99 = 0; ///< least number that at least this share of the pixels does not exceed
    double mean = 0;
};

/// Histogram of at least one pixel with 8 to 16 bits; numbers beyond these count as the last bin. `counts` is
/// memory to work with.
[[nodiscard]] Histogram histogram_of(std::span<const std::uint16_t> image, unsigned bits,
                                     std::vector<std::uint32_t>& counts);

} // namespace obscura::web
