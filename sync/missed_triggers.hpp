// SPDX-License-Identifier: Apache-2.0
// Reasons for which edges are missed, and how many were for each.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace obscura::sync {

/// Why an edge produced no frame.
enum class MissedReason : std::uint8_t {
    lost_edge,  ///< the source or the way from it lost the edge: a gap in its numbers
    chip_busy,  ///< the sensor would not have been ready either: exposure, readout or a burst in progress
    rendering,  ///< the sensor would have been ready, but the frame before was still being made
    latch_full, ///< OverTrigger::latch: one edge waited already
    stopped,    ///< OverTrigger::latch: the acquisition ended while it waited
};
constexpr auto enum_names(MissedReason /*type*/) {
    using R = MissedReason;
    return std::array{EnumName{R::lost_edge, "lost_edge"}, EnumName{R::chip_busy, "chip_busy"},
                      EnumName{R::rendering, "rendering"}, EnumName{R::latch_full, "latch_full"},
                      EnumName{R::stopped, "stopped"}};
}
inline constexpr std::size_t missed_reason_count = enum_names(MissedReason{}).size();

/// Missed edges by MissedReason.
using MissedCounts = std::array<std::uint64_t, missed_reason_count>;

} // namespace obscura::sync
