// Raw pixel dumps with a sidecar that says what they are.
#pragma once

#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>

namespace obscura::images {

/// Writes `pixels` as 16-bit little-endian words without any header, and beside it a TOML text file (same
/// name, extension .toml) with width, height, bits and the cards. Throws OutputError.
void write_raw16(const std::filesystem::path& file, std::int32_t width, std::int32_t height, int bits,
                 std::span<const std::uint16_t> pixels, const Cards& cards);

/// Writes `text` as a whole file. Throws OutputError.
void write_text(const std::filesystem::path& file, std::string_view text);

} // namespace obscura::images
