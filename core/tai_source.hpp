// SPDX-License-Identifier: Apache-2.0
// Source of the difference between TAI and UTC on this machine.
#pragma once

#include <cstdint>

namespace obscura {

enum class TaiSource : std::uint8_t {
    unknown, ///< none: times called TAI are those of CLOCK_TAI, which equals UTC
    kernel,  ///< CLOCK_TAI, as chrony or phc2sys set it
    ptp,     ///< announced by the network's grandmaster
    list,    ///< leap second list, by the date
};

[[nodiscard]] constexpr const char* name_of(TaiSource source) noexcept {
    switch (source) {
    case TaiSource::kernel:
        return "kernel";
    case TaiSource::ptp:
        return "ptp";
    case TaiSource::list:
        return "list";
    case TaiSource::unknown:
        break;
    }
    return "unknown";
}

/// Correction to add to CLOCK_TAI.
struct TaiCorrection {
    std::int64_t ns = 0;
    TaiSource source = TaiSource::unknown;

    constexpr bool operator==(const TaiCorrection&) const = default;
};

} // namespace obscura
