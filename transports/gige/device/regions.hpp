// SPDX-License-Identifier: Apache-2.0
// Regions (SFNC) of the sensor: the windows that the camera reads.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <cstdint>

namespace obscura::transports::gige {

[[nodiscard]] std::uint32_t region_count(const DeviceContext& d) noexcept;
[[nodiscard]] CameraWindow region_window(const DeviceContext& d, std::uint32_t i);
/// Replaces region `i`, or switches it on or off; nothing changes on refusal.
Status write_region(DeviceContext& d, std::uint32_t i, const CameraWindow& window, bool enabled);
/// What the chip makes of region `i`; of several reads of it the extremes. All 0 while it is off.
[[nodiscard]] FrameWindow region_obtained(DeviceContext& d, std::uint32_t i);
/// Regions from the second on as the camera's settings have them, the others off.
void reset_regions(DeviceContext& d);

} // namespace obscura::transports::gige
