// SPDX-License-Identifier: Apache-2.0
// Place and layout of the image that a PDS3 label describes.
#pragma once

#include "images/readers/pds_label.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace obscura::images {

/// Encoding of a sample in the file.
struct Pds3SampleType {
    enum class Kind : std::uint8_t { unsigned_integer, signed_integer, real };
    Kind kind = Kind::unsigned_integer;
    bool little_endian = false;
    std::size_t bytes = 1;
};

/// Lines of all bands one after the other (BAND_SEQUENTIAL), each with its prefix and suffix.
struct Pds3Layout {
    std::filesystem::path data;
    std::int64_t offset = 0; ///< of the first line, bytes
    std::int64_t width = 0, height = 0, bands = 1;
    Pds3SampleType type;
    std::int64_t prefix = 0, suffix = 0, line_bytes = 0;
};

/// Throws InputError if the layout is impossible or not of a kind that is read. The data file is looked for
/// in the label's folder only and need not exist.
[[nodiscard]] Pds3Layout pds3_layout(const PdsLabel& label);

} // namespace obscura::images
