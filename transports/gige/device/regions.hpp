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
/// Size of the image that is sent unless the payload is multi-part, before binning: all windows and reads,
/// one below the other.
[[nodiscard]] ImageSize image_size(DeviceContext& d);
/// Whether region `i` is one of several windows or reads that are sent as one image: Width and Height are
/// then those of the image, and cannot be written.
[[nodiscard]] bool is_composed(DeviceContext& d, std::uint32_t i);
/// Region `i` as the sensor reads it, or as it is set while it is disabled.
[[nodiscard]] Region region_read(DeviceContext& d, std::uint32_t i);
/// Sets the regions from the second on as in the camera's settings and disables the others.
void reset_regions(DeviceContext& d);

} // namespace obscura::transports::gige
