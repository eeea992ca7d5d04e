// SPDX-License-Identifier: Apache-2.0
// Order of the rows of a FITS image (keyword ROWORDER), and its first image among other extensions.
#pragma once

#include <fitsio.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::images {

/// Moves to the first extension with an image of two or more axes, packed by tiles or not. Sets `status` as
/// CFITSIO does; without such an image the last extension is the current one.
void move_to_first_image(fitsfile* fits, int& status);

/// Whether the first row of the current image is the lowest: ROWORDER = 'BOTTOM-UP'. Without the keyword, and
/// with 'TOP-DOWN', it is the top row, as this program writes it.
[[nodiscard]] bool rows_from_bottom(fitsfile* fits);

/// Turns the rows of an image of `width` values a row upside down.
template<typename Value>
void flip_rows(std::span<Value> image, std::size_t width) {
    const std::size_t rows = width == 0 ? 0 : image.size() / width;
    for (std::size_t y = 0; y < rows / 2; ++y)
        std::swap_ranges(image.begin() + static_cast<std::ptrdiff_t>(y * width),
                         image.begin() + static_cast<std::ptrdiff_t>((y + 1) * width),
                         image.begin() + static_cast<std::ptrdiff_t>((rows - 1 - y) * width));
}

} // namespace obscura::images
