// SPDX-License-Identifier: Apache-2.0
// DAF files in little-endian binary form, the container of SPK, CK and binary PCK kernels.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// An array of a DAF file, its summary without the two addresses.
struct DafArrayData {
    std::string name;                   ///< segment identifier, at most 40 characters are kept
    std::vector<double> doubles;        ///< 2
    std::vector<std::int32_t> integers; ///< 4 in an SPK or CK, 3 in a PCK
    std::vector<double> words;
};

/// The bytes of a file of `kind` ("SPK", "CK" or "PCK") with `arrays` in order of rising priority. `title` is
/// the internal file name; `comments` are lines of the comment area. Throws std::logic_error if a summary
/// does not fit the kind, InputError if the file would exceed the 2^31 words that DAF can address.
[[nodiscard]] std::string daf_bytes(std::string_view kind, std::string_view title, std::string_view comments,
                                    const std::vector<DafArrayData>& arrays);

} // namespace obscura::ephemeris
