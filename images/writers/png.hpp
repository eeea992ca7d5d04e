// 16-bit grey PNG files: digital numbers as they are, not stretched.
#pragma once

#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>

namespace obscura::images {

/// Writes `pixels` (row-major, width * height) as 16-bit grey; an sBIT chunk tells the `bits` that are in
/// use, tEXt chunks hold the cards. Throws OutputError; the file appears complete or not at all.
void write_png16(const std::filesystem::path& file, std::int32_t width, std::int32_t height, int bits,
                 std::span<const std::uint16_t> pixels, const Cards& cards);

/// The same for 8-bit grey pictures (previews).
void write_png8(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                std::span<const std::uint8_t> pixels, const Cards& cards);

} // namespace obscura::images
