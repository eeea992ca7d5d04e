// SPDX-License-Identifier: Apache-2.0
// Source of the difference between TAI and UTC on this machine.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura {

enum class TaiSource : std::uint8_t {
    unknown, ///< none: times called TAI are those of CLOCK_TAI, which equals UTC
    kernel,  ///< CLOCK_TAI, as chrony or phc2sys set it
    ptp,     ///< announced by the network's grandmaster
    list,    ///< leap second list, by the date
};

constexpr auto enum_names(TaiSource /*type*/) {
    return std::array{EnumName{TaiSource::unknown, "unknown"}, EnumName{TaiSource::kernel, "kernel"},
                      EnumName{TaiSource::ptp, "ptp"}, EnumName{TaiSource::list, "list"}};
}

/// Correction to add to CLOCK_TAI.
struct TaiCorrection {
    std::int64_t ns = 0;
    TaiSource source = TaiSource::unknown;

    constexpr bool operator==(const TaiCorrection&) const = default;
};

} // namespace obscura
