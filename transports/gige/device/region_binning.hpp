// SPDX-License-Identifier: Apache-2.0
// Binning of Region0: extents in binned pixels, and adjustment of the region when binning changes.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <cstdint>

namespace obscura::transports::gige {

/// Width and height of Region0 in binned pixels.
[[nodiscard]] BinnedExtent binned_columns(const DeviceContext& d, const Binning& binning);
[[nodiscard]] BinnedExtent binned_rows(const DeviceContext& d, const Binning& binning);
/// Binning of region `i`; only Region0 is binned, and the others are disabled meanwhile.
[[nodiscard]] inline Binning region_binning(const DeviceContext& d, std::uint32_t i) {
    return i == 0 ? d.binning : Binning{};
}
/// Fits Region0 to `wanted` and enables it; nothing changes on refusal.
Status write_binning(DeviceContext& d, const Binning& wanted);

} // namespace obscura::transports::gige
