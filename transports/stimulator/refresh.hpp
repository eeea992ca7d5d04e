// SPDX-License-Identifier: Apache-2.0
// Warnings about beats between the screen's refresh and the camera's shutter.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::transports {

/// Refresh rate and latency of the screen.
struct ScreenTiming {
    double refresh_hz = 0;        ///< 0: unknown, no warnings
    std::int64_t transfer_ns = 0; ///< time that one update takes to reach the screen
};

/// Exposure and readout of the camera in front of the screen.
struct ShutterTiming {
    std::int64_t exposure_ns = 0;
    std::int64_t readout_ns = 0;      ///< first row's reset to last row's reset; 0: global shutter
    std::int64_t frame_period_ns = 0; ///< between triggers; 0: unknown
    bool operator==(const ShutterTiming&) const = default;
};

/// Peak-to-peak brightness error, relative to the mean, of a screen that lights each pixel once per refresh
/// in a flash, seen with `exposure_ns`: an exposure of n refreshes contains floor(n) or ceil(n) flashes, so
/// the error is 1/n, and 0 for whole n. It appears as bands with a rolling shutter and as flicker with a
/// global shutter. For n < 1 some rows contain no flash: the error is 1/n too, which exceeds the mean.
[[nodiscard]] double banding(std::int64_t exposure_ns, double refresh_hz);

/// One line for each artefact that the camera will see and the scene does not contain; empty if none.
[[nodiscard]] std::vector<std::string> explain_refresh(const ScreenTiming& screen,
                                                       const ShutterTiming& shutter);

} // namespace obscura::transports
