// SPDX-License-Identifier: Apache-2.0
// Reader of image series in the layout of the EMVA 1288 reference sets.
#pragma once

#include "sensors/emva1288.hpp"

#include <filesystem>
#include <vector>

namespace obscura::tools {

struct EmvaSeries {
    std::vector<sensors::emva1288::Level> levels; ///< in order of rising photon count
};

/// Reads EMVA1288_Data.txt of `folder` ("n bits width height", "b exposure photons", "d exposure", each
/// followed by "i image" lines) and the images it names, 8 or 16-bit grey PNG. Levels with missing images or
/// without a dark pair of the same exposure are skipped. Throws InputError.
[[nodiscard]] EmvaSeries read_emva_series(const std::filesystem::path& folder);

} // namespace obscura::tools
