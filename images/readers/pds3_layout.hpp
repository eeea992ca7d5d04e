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

/// Where the samples are. Bands are stored one after the other (BAND_SEQUENTIAL), line by line
/// (LINE_INTERLEAVED) or sample by sample (SAMPLE_INTERLEAVED). Each line, which of interleaved samples has
/// those of all bands, has a prefix and a suffix.
struct Pds3Layout {
    std::filesystem::path data;
    std::int64_t offset = 0; ///< of the first line, bytes
    std::int64_t width = 0, height = 0, bands = 1;
    Pds3SampleType type;
    std::int64_t prefix = 0, suffix = 0, line_bytes = 0;
    /// From a sample of a band to the next, from a line to the next, from a band to the next.
    std::int64_t sample_bytes = 0, row_bytes = 0, band_bytes = 0;
    bool interleaved = false;
};

/// Throws InputError if the layout is impossible or not of a kind that is read. The data file is looked for
/// in the label's folder only and need not exist.
[[nodiscard]] Pds3Layout pds3_layout(const PdsLabel& label);

} // namespace obscura::images
