// SPDX-License-Identifier: Apache-2.0
// Samples of PDS3 images, and the numbers that mark those without data.
#pragma once

#include "images/readers/pds3_layout.hpp"

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace obscura::images {

/// Value of the sample whose bytes begin at `at`.
[[nodiscard]] double pds3_sample(const Pds3SampleType& type, const std::uint8_t* at);

/// A number of a label as a sample has it: decimal (a real of 32 bits holds it rounded), or as 16#8000#,
/// 8#...#, 2#...# and 0x8000 the bit pattern of a sample. Empty: it is none ("N/A").
[[nodiscard]] std::optional<double> pds3_number(std::string_view text, const Pds3SampleType& type);

/// The numbers that mark samples without data, by all keywords of the PDS3 data dictionary for them: MISSING
/// and MISSING_CONSTANT, NULL and CORE_NULL and their kinds, INVALID, UNKNOWN and NOT_APPLICABLE constants.
[[nodiscard]] std::vector<double> pds3_missing(const PdsLabel& label, const Pds3SampleType& type);

} // namespace obscura::images
