// SPDX-License-Identifier: Apache-2.0
// Raw pixel files with a TOML sidecar that describes them.
#pragma once

#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>

namespace obscura::images {

/// Writes `pixels` as 16-bit little-endian words without a header, and a TOML file of the same name with the
/// extension .toml with width, height, bits and the cards. Throws OutputError.
void write_raw16(const std::filesystem::path& file, std::int32_t width, std::int32_t height, int bits,
                 std::span<const std::uint16_t> pixels, const Cards& cards);

/// Writes `text` as a file, which appears complete or not at all. Throws OutputError.
void write_text(const std::filesystem::path& file, std::string_view text);

} // namespace obscura::images
