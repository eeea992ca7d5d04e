// SPDX-License-Identifier: Apache-2.0
// Frame flags as reported to clients: FrameFlag bits and the state of the trigger's clock.
#pragma once

#include "core/camera/frame.hpp"

namespace obscura {

/// Bits 8 and 9 of the reported flags hold the ClockState: 0 free, 1 locked, 2 holdover.
constexpr unsigned reported_clock_shift = 8;

[[nodiscard]] inline std::uint32_t reported_flags(const Frame& frame) noexcept {
    return frame.flags.load(std::memory_order_relaxed) | static_cast<std::uint32_t>(frame.info.clock_state)
                                                             << reported_clock_shift;
}

} // namespace obscura
