// SPDX-License-Identifier: Apache-2.0
// Synchronisation state of the clock that triggers frames: free, locked, holdover.
#pragma once

#include <cstdint>

namespace obscura {

enum class ClockState : std::uint8_t {
    free,     ///< no reference: none seen yet, or missing for too long
    locked,   ///< the last event of the reference came when expected
    holdover, ///< the reference is missing; its last period is extrapolated
};

[[nodiscard]] constexpr const char* name_of(ClockState state) noexcept {
    switch (state) {
    case ClockState::locked:
        return "locked";
    case ClockState::holdover:
        return "holdover";
    case ClockState::free:
        break;
    }
    return "free";
}

} // namespace obscura
