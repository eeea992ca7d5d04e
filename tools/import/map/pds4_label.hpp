// SPDX-License-Identifier: Apache-2.0
// Special constants of PDS4 labels (PDS4 Information Model 1.20, class Special_Constants).
#pragma once

#include "images/readers/pds_sample.hpp"

#include <cstdint>
#include <string>

namespace obscura::tools {

/// Takes the numbers of missing samples and the bounds of valid ones from the label `xml` of a product, from
/// the first array of that size: all constants count as missing, as those of PDS3 labels do. Leaves `numbers`
/// as they are where the array has none. Throws InputError `name: ...` on a constant that is no number.
void read_pds4_constants(const std::string& xml, const std::string& name, std::int64_t width,
                         std::int64_t height, const images::PdsSampleType& type, images::PdsNumbers& numbers);

} // namespace obscura::tools
