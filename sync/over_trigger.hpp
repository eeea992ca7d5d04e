// SPDX-License-Identifier: Apache-2.0
// Over-trigger policy: handling of edges that come before the camera is ready.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::sync {

/// Handling of an edge that comes before the camera is ready. Every policy counts it.
enum class OverTrigger : std::uint8_t {
    count, ///< the edge is missed
    /// The edge is masked, as by a camera that masks its input while busy.
    ignore,
    /// The first such edge is latched and starts the next frame as soon as possible.
    latch,
};
constexpr auto enum_names(OverTrigger /*type*/) {
    return std::array{EnumName{OverTrigger::count, "count"}, EnumName{OverTrigger::ignore, "ignore"},
                      EnumName{OverTrigger::latch, "latch"}};
}

} // namespace obscura::sync
