// SPDX-License-Identifier: Apache-2.0
// One part of a multi-part payload: a sensor window or the chunks.
#pragma once

#include "core/camera/frame.hpp"

#include <cstddef>
#include <cstdint>

namespace obscura::transports::gige {

constexpr std::size_t max_parts = max_windows + 1; ///< every window, and the chunks

struct PayloadPart {
    std::size_t begin = 0, bytes = 0; ///< in the payload
    std::uint32_t first_packet = 0;   ///< its first packet, counted from 0 over the payload
    std::uint32_t packets = 0;
    std::uint32_t window = 0; ///< of the frame; the chunk part has max_windows
};

} // namespace obscura::transports::gige
