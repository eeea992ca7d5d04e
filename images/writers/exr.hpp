// SPDX-License-Identifier: Apache-2.0
// OpenEXR files of 32-bit floats with named layers.
#pragma once

#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace obscura::images {

/// One channel. `name` may hold dots: "layer.channel".
struct ExrChannel {
    std::string name;
    std::string unit;              ///< header attribute "<name>:unit"
    std::span<const float> values; ///< row-major, width * height
};

/// Writes the channels, losslessly compressed, with the cards as header attributes. The same input gives the
/// same bytes. The file appears complete or not at all. Throws OutputError.
void write_exr(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
               const std::vector<ExrChannel>& channels, const Cards& cards);

} // namespace obscura::images
