// SPDX-License-Identifier: Apache-2.0
// Image that a PDS3 label describes: its place and layout in the data file, its numbers, its samples.
#pragma once

#include "core/io/input_file.hpp"
#include "images/readers/pds_label.hpp"
#include "images/readers/pds_sample.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace obscura::images {

/// Sample of band b, line y and column x begins at offset + b * band_bytes + y * line_bytes + x *
/// pixel_bytes.
///
/// Bands are stored one after the other (BAND_SEQUENTIAL), line by line (LINE_INTERLEAVED) or sample by
/// sample (SAMPLE_INTERLEAVED). Each line of a band, or of samples of all bands, has LINE_PREFIX_BYTES before
/// it and LINE_SUFFIX_BYTES behind it.
struct Pds3Layout {
    std::filesystem::path label, data;
    std::int64_t offset = 0; ///< of the first sample, bytes
    std::int64_t width = 0, height = 0, bands = 1;
    PdsSampleType type;
    std::int64_t pixel_bytes = 0, line_bytes = 0, band_bytes = 0;
    std::int64_t end = 0; ///< behind the last sample, bytes
};

/// Throws InputError if the layout is impossible or not of a kind that is read. The data file is looked for
/// in the label's folder only and need not exist.
[[nodiscard]] Pds3Layout pds3_layout(const PdsLabel& label);

/// Scale, offset, unit and range of the image's values. Throws InputError `file: ...`.
[[nodiscard]] PdsNumbers pds3_values(const PdsLabel& label);

/// These, and the numbers of missing samples. All its constants for special samples count as missing:
/// without data, invalid, unknown, not applicable, saturated. Throws InputError `file: ...` on a constant
/// that is no number.
[[nodiscard]] PdsNumbers pds3_numbers(const PdsLabel& label, const PdsSampleType& type);

/// Samples of an image that is not compressed. Reentrant.
class Pds3Samples {
public:
    /// Throws InputError if the data file cannot be opened or is shorter than the label says.
    explicit Pds3Samples(const Pds3Layout& layout);

    [[nodiscard]] const Pds3Layout& layout() const { return at_; }
    /// Numbers of `out.size()` columns from `x` on of line `y` of band `band`, all counted from 0 and inside
    /// the image. Throws InputError.
    void read(std::int64_t band, std::int64_t x, std::int64_t y, std::span<double> out);

private:
    Pds3Layout at_;
    InputFile file_;
    std::vector<std::uint8_t> bytes_;
};

} // namespace obscura::images
