// SPDX-License-Identifier: Apache-2.0
// State of one connection of the stimulator to its display.
#pragma once

#include "core/clock.hpp"
#include "transports/stimulator/stimulator_output.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura::transports {

/// How long the transfers in progress may go on after stop().
inline constexpr int stop_timeout_ms = 200;
/// Longest request to the device that is announced to the watchdog.
inline constexpr std::int64_t max_request_ns = 10 * ns_per_s;

inline Time stimulator_now() {
    return MonotonicClock().now();
}

struct StimulatorOutput::Session {
    std::unique_ptr<UsbDevice> device;
    std::unique_ptr<DisplayLink> link;
    OpticalStage* stage = nullptr;
    std::string name;
    std::vector<std::uint16_t> levels;     // drive levels of the full screen
    std::vector<std::uint8_t> next, shown; // packed screens: to show next, and as the device has it
    bool shown_known = false;              // `shown` equals the content of the device
    std::array<Lane, UsbDevice::slots> lanes;
    std::size_t turn = 0;
    bool over = false;
    int stalls = 0;
    bool idled = true;                    // the queue was empty before this frame
    std::uint64_t frame = 0;              // running number of the current frame
    TransmitTimestamps* stamps = nullptr; // time stamps of the current frame
    std::uint64_t bad_frame = 0;          // running number of the last frame that lost an update
    bool counted_late = false;
    std::int32_t copied_rows = 0;
    Time checked;
    double bytes_per_ns = 0; // measured throughput of the link
    std::uint32_t compress_rest = 0, compress_pause = 1;
    // Windows of the last frame and their regions on the screen.
    std::vector<Region> windows, places;
    // For the warnings about refresh.
    Time last_edge;
    ShutterTiming shutter;
    int same_shutter = 0;

    [[nodiscard]] Region screen() const { return {0, 0, link->width(), link->height()}; }
};

} // namespace obscura::transports
