// SPDX-License-Identifier: Apache-2.0
// PNG writer: 16-bit grey digital numbers without stretching, and 8-bit pictures for people.
#pragma once

#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>

namespace obscura::images {

/// Writes `pixels` (row-major, width * height) as 16-bit grey. An sBIT chunk states the significant bits
/// `bits`, tEXt chunks hold the cards. The file appears complete or not at all. Throws OutputError.
void write_png16(const std::filesystem::path& file, std::int32_t width, std::int32_t height, int bits,
                 std::span<const std::uint16_t> pixels, const Cards& cards);

/// Writes an 8-bit grey image (preview) in the same way.
void write_png8(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                std::span<const std::uint8_t> pixels, const Cards& cards);

/// Writes an 8-bit colour image in the same way; `bytes` are red, green and blue of each pixel.
void write_png_rgb(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   std::span<const std::uint8_t> bytes, const Cards& cards);

} // namespace obscura::images
