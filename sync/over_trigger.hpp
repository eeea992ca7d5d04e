// Over-trigger policy: what becomes of an edge that comes before the camera is ready.
#pragma once

#include "core/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::sync {

/// What happens to an edge that comes before the camera is ready for it. Every policy counts it.
enum class OverTrigger : std::uint8_t {
    count,  ///< it is missed
    ignore, ///< it is masked, as by a camera that masks its input while busy
    latch,  ///< the first such edge is latched and starts the next frame as soon as possible
};
constexpr auto enum_names(OverTrigger /*type*/) {
    return std::array{EnumName{OverTrigger::count, "count"}, EnumName{OverTrigger::ignore, "ignore"},
                      EnumName{OverTrigger::latch, "latch"}};
}

} // namespace obscura::sync
