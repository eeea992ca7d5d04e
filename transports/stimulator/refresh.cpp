// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/refresh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::transports {
namespace {
constexpr double ms = 1e-6; // ns to ms
// Deviation, in refreshes, up to which a multiple counts as whole: exposures are not set to the last digit.
constexpr double whole_tolerance = 0.005;
} // namespace

double banding(std::int64_t exposure_ns, double refresh_hz) {
    const double n = static_cast<double>(exposure_ns) * 1e-9 * refresh_hz;
    if (!(n > 0)) return 0;
    const double off = std::abs(n - std::round(n));
    return std::round(n) >= 1 && off <= whole_tolerance ? 0 : 1 / n;
}

std::vector<std::string> explain_refresh(const ScreenTiming& screen, const ShutterTiming& shutter) {
    std::vector<std::string> lines;
    if (!(screen.refresh_hz > 0)) return lines;
    const double refresh_ns = 1e9 / screen.refresh_hz;
    const auto exposure = static_cast<double>(shutter.exposure_ns);
    const auto readout = static_cast<double>(shutter.readout_ns);
    const auto period = static_cast<double>(shutter.frame_period_ns);
    const char* where = shutter.readout_ns > 0 ? "bands between rows" : "flicker between frames";
    if (shutter.exposure_ns > 0 && exposure < refresh_ns * (1 - whole_tolerance))
        lines.push_back(fmt::format(
            "exposure of {:.3f} ms is shorter than the screen's refresh of {:.3f} ms: {}, parts of the image may stay dark",
            exposure * ms, refresh_ns * ms, where));
    else if (const double error = banding(shutter.exposure_ns, screen.refresh_hz); error > 0.01)
        lines.push_back(fmt::format(
            "exposure of {:.3f} ms is {:.2f} refreshes of {:.3f} ms: {} of up to {:.1f} % on a flashing screen; "
            "whole multiples have none",
            exposure * ms, exposure / refresh_ns, refresh_ns * ms, where, 100 * error));
    if (shutter.frame_period_ns > 0) {
        if (period < refresh_ns * (1 - whole_tolerance))
            lines.push_back(fmt::format(
                "frame period of {:.3f} ms is shorter than the screen's refresh of {:.3f} ms: not every frame is shown",
                period * ms, refresh_ns * ms));
        const double update = static_cast<double>(screen.transfer_ns) + refresh_ns;
        if (exposure + readout + update > period)
            lines.push_back(fmt::format(
                "exposure {:.3f} ms, readout {:.3f} ms and change of picture {:.3f} ms do not fit into the frame period of {:.3f} ms: {} see two frames",
                exposure * ms, readout * ms, update * ms, period * ms,
                shutter.readout_ns > 0 ? "the last rows" : "exposures"));
    }
    return lines;
}

} // namespace obscura::transports
