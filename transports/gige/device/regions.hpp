// SPDX-License-Identifier: Apache-2.0
// Regions (SFNC) of the sensor: the windows that the camera reads.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <cstdint>

namespace obscura::transports::gige {

[[nodiscard]] std::uint32_t region_count(const DeviceContext& d) noexcept;
[[nodiscard]] CameraWindow region_window(const DeviceContext& d, std::uint32_t i);
/// Replaces region `i`, enables or disables it; nothing changes on refusal.
Status write_region(DeviceContext& d, std::uint32_t i, const CameraWindow& window, bool enabled);
/// Window and exposure that the sensor obtains for region `i`; extremes over several reads of it. All 0 while
/// the region is disabled.
[[nodiscard]] FrameWindow region_obtained(DeviceContext& d, std::uint32_t i);
/// Sets the regions from the second on as in the camera's settings and disables the others.
void reset_regions(DeviceContext& d);

} // namespace obscura::transports::gige
