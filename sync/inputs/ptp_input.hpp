// SPDX-License-Identifier: Apache-2.0
// Edge input on an external time stamp channel of a PTP hardware clock (EXTTS of /dev/ptpN).
#pragma once

#include "sync/edge_input.hpp"

#include <memory>
#include <string>

namespace obscura::sync {

/// Enables time stamps of rising edges on `channel`. They are in the device's own time, which is compared
/// with the scheduling clock at each edge. The device does not count edges. Throws HardwareError that names a
/// key of `table`.
[[nodiscard]] std::unique_ptr<EdgeInput> open_ptp(const std::string& table, const std::string& device,
                                                  unsigned channel);

} // namespace obscura::sync
