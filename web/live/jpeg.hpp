// SPDX-License-Identifier: Apache-2.0
// Pictures as 8-bit grey JPEG, with the contrast of the previews of the command line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::web {

constexpr std::size_t max_jpeg_side = 8192;

/// Display level of each digital number, from all pixels of an image with that number of bits. `counts` is
/// memory to work with.
[[nodiscard]] std::vector<std::uint8_t> preview_levels(std::span<const std::uint16_t> image, unsigned bits,
                                                       std::vector<std::uint64_t>& counts);

/// A picture of `rows` rows, each of its numbers replaced by its level. Empty: it has no pixel, or more than
/// max_jpeg_side columns or rows, or there is no memory.
[[nodiscard]] std::vector<unsigned char> jpeg_of(std::span<const std::uint16_t> pixels, std::size_t rows,
                                                 std::span<const std::uint8_t> levels);

} // namespace obscura::web
