// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/path_segment.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace obscura::ephemeris {

bool is_inertial_frame(std::string_view frame) {
    // Realisations are numbered: ICRF3, GCRF2.
    const std::size_t end = frame.find_last_not_of("0123456789") + 1;
    const std::string_view family = frame.substr(0, end);
    if (family == "ICRF" || family == "GCRF") return frame.size() - end <= 2;
    constexpr std::array<std::string_view, 2> others{"EME2000", "J2000"};
    return std::find(others.begin(), others.end(), frame) != others.end();
}

} // namespace obscura::ephemeris
