// SPDX-License-Identifier: Apache-2.0
// Entries of RegionSelector and ChunkRegionID.
#pragma once

#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {

inline constexpr std::array region_entries{
    entry("Region0", 0),   entry("Region1", 1),   entry("Region2", 2),   entry("Region3", 3),
    entry("Region4", 4),   entry("Region5", 5),   entry("Region6", 6),   entry("Region7", 7),
    entry("Region8", 8),   entry("Region9", 9),   entry("Region10", 10), entry("Region11", 11),
    entry("Region12", 12), entry("Region13", 13), entry("Region14", 14), entry("Region15", 15),
    entry("Region16", 16), entry("Region17", 17), entry("Region18", 18), entry("Region19", 19),
    entry("Region20", 20), entry("Region21", 21), entry("Region22", 22), entry("Region23", 23),
    entry("Region24", 24), entry("Region25", 25), entry("Region26", 26), entry("Region27", 27),
    entry("Region28", 28), entry("Region29", 29), entry("Region30", 30), entry("Region31", 31),
};
static_assert(region_entries.size() == max_windows);

} // namespace obscura::transports::gige
