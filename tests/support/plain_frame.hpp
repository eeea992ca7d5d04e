// SPDX-License-Identifier: Apache-2.0
// The description of a frame of one whole window, for tests that make frames of their own.
#pragma once

#include "core/camera/frame.hpp"

namespace obscura::test {

/// 16-bit numbers in Mono16, one window that begins at the sensor's first pixel.
inline void describe_mono16(FrameInfo& info, std::uint64_t id, std::int32_t width, std::int32_t height) {
    info.frame_id = id;
    info.width = width;
    info.height = height;
    info.bits_per_pixel = 16;
    info.pixel_format = PixelFormat::mono16;
    info.window_count = 1;
    info.windows[0].sensor = {0, 0, width, height};
}

} // namespace obscura::test
