// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/pattern_profiles.hpp"

#include <algorithm>
#include <limits>

namespace obscura::tools {

Profile profile(const std::vector<double>& values, std::size_t width, Along along) {
    const std::size_t height = width > 0 ? values.size() / width : 0;
    const bool rows = along == Along::rows;
    const std::size_t length = rows ? width : height, lines = rows ? height : width;
    Profile out;
    if (lines == 0) return out;
    out.mean.resize(length);
    out.min.assign(length, std::numeric_limits<double>::infinity());
    out.max.assign(length, -std::numeric_limits<double>::infinity());
    out.middle.resize(length);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const double value = values[y * width + x];
            const std::size_t at = rows ? x : y;
            out.mean[at] += value / static_cast<double>(lines);
            out.min[at] = std::min(out.min[at], value);
            out.max[at] = std::max(out.max[at], value);
            if ((rows ? y : x) == lines / 2) out.middle[at] = value;
        }
    return out;
}

} // namespace obscura::tools
