// SPDX-License-Identifier: Apache-2.0
// The picture that v4l2_stream sends and image_check expects: every pixel depends on place and frame.
#pragma once

#include <cstdint>

namespace obscura::rig {

constexpr std::uint16_t pattern(std::int32_t x, std::int32_t y, std::uint64_t frame_id, int bits) {
    const auto value =
        static_cast<std::uint64_t>(x) * 17 + static_cast<std::uint64_t>(y) * 1031 + frame_id * 7;
    return static_cast<std::uint16_t>(value & ((1u << bits) - 1));
}

} // namespace obscura::rig
