// Does the screen's refresh go together with the camera's shutter? Warnings, not refusals.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::transports {

/// When the screen shows what it was sent.
struct ScreenTiming {
    double refresh_hz = 0;        ///< 0: unknown, then there is nothing to warn of
    std::int64_t transfer_ns = 0; ///< time that one update takes to reach the screen
};

/// When the camera in front of the screen integrates.
struct ShutterTiming {
    std::int64_t exposure_ns = 0;
    std::int64_t readout_ns = 0;      ///< first row's reset to last row's reset; 0: global shutter
    std::int64_t frame_period_ns = 0; ///< between triggers; 0: unknown
    bool operator==(const ShutterTiming&) const = default;
};

/// Peak-to-peak brightness error, relative to the mean, of a screen that lights each pixel once per refresh
/// in a flash, seen with `exposure_ns`: an exposure of n refreshes catches floor(n) or ceil(n) flashes, so
/// the error is 1/n, and 0 for whole n. Rows of a rolling shutter show it as bands, frames of a global one as
/// flicker. For n < 1 some rows catch nothing: the error is 1/n still, which is more than the mean.
[[nodiscard]] double banding(std::int64_t exposure_ns, double refresh_hz);

/// One line for each thing that the camera will see and the scene does not have; empty when all is well.
[[nodiscard]] std::vector<std::string> explain_refresh(const ScreenTiming& screen,
                                                       const ShutterTiming& shutter);

} // namespace obscura::transports
