// Pictures to look at, made from images to measure with.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::tools {

/// Stretches an image for the eye: black is its darkest twentieth, white the brightest ten-thousandth; in
/// between, a display's gamma and some logarithm show a bright body and faint stars at once. Not for
/// measurements.
[[nodiscard]] std::vector<std::uint8_t> stretched(const std::vector<float>& image);

/// Writes stretched(image) as an 8-bit PNG. Throws OutputError.
void write_preview(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   const std::vector<float>& image);

} // namespace obscura::tools
