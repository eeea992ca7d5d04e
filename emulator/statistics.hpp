// SPDX-License-Identifier: Apache-2.0
// Counters and latencies of a run as one line of text and as JSON.
#pragma once

#include "emulator/camera.hpp"
#include "emulator/releaser.hpp"
#include "transports/transport.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

using TransportList = std::vector<std::unique_ptr<transports::Transport>>;

[[nodiscard]] std::string summary_line(const Camera& camera, const TransportList& transports);

/// {"clock": {"state", "source"}, "camera": {"run", counters...}, "latency_us": {"trigger_to_first_row":
/// {"count", "p50", "p99", "max"}, ...},
///  "transports": {"gige": {...}, ...}}
[[nodiscard]] std::string statistics_to_json(const Camera& camera, const Releaser& releaser,
                                             const TransportList& transports, ClockState clock,
                                             std::string_view source, std::uint32_t run);

} // namespace obscura::emulator
