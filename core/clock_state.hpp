// How far the clock that triggers frames can be trusted.
#pragma once

#include <cstdint>

namespace obscura {

enum class ClockState : std::uint8_t {
    free,     ///< nothing to hold on to (yet, or for too long)
    locked,   ///< the last sign of the reference came when it should
    holdover, ///< the reference is missing; its last signs are continued
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
