// SPDX-License-Identifier: Apache-2.0
// 8-bit previews with stretched contrast, for viewing only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::tools {

/// Contrast stretch for display: the darkest 5 % of the pixels become black, the brightest 0.01 % white; a
/// display gamma mixed with a logarithm between them shows a bright body and faint stars at once. Not for
/// measurement.
[[nodiscard]] std::vector<std::uint8_t> stretched(const std::vector<float>& image);

/// Writes stretched(image) as an 8-bit PNG. Throws OutputError.
void write_preview(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   const std::vector<float>& image);

} // namespace obscura::tools
