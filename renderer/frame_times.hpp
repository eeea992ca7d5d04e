// SPDX-License-Identifier: Apache-2.0
// Times of the rows and pixels of a picture that is taken without a sensor.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/region.hpp"
#include "renderer/pixel_times.hpp"
#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace obscura::renderer {

/// All in scene time.
struct FrameTimes {
    std::vector<RowTime> rows;      ///< of the window
    std::optional<Time> common_mid; ///< see renderer::common_mid()
    PixelTimes pixels;              ///< of scene::Camera::timing, if pixels have times of their own
};

/// Times of the rows of a window of the camera, whose whole sensor is read. `exposure`: of all of them, or
/// what scene::Camera::timing is asked for, with its trigger at the beginning. Throws ConfigError: times that
/// cannot be.
[[nodiscard]] FrameTimes frame_times(const scene::Camera& camera, const Region& window, RowTime exposure);

/// Middles of the exposures of the pixels of a row of the window, s. `out`: one for each column.
void fill_middles(const FrameTimes& times, const Region& window, std::int32_t row, std::span<float> out);

} // namespace obscura::renderer
