// SPDX-License-Identifier: Apache-2.0
// Edge input on a pulse-per-second device (RFC 2783, /dev/ppsN).
#pragma once

#include "sync/edge_input.hpp"

#include <memory>
#include <string>

namespace obscura::sync {

/// Opens the device and captures its assert edges. The kernel time-stamps them in CLOCK_REALTIME and counts
/// them; its count is the sequence number. Throws HardwareError that names the key `device` of `table`.
[[nodiscard]] std::unique_ptr<EdgeInput> open_pps(const std::string& table, const std::string& device);

} // namespace obscura::sync
