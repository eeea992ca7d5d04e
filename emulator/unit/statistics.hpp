// SPDX-License-Identifier: Apache-2.0
// Counters and latencies of a run as one line of text and as a JSON value.
#pragma once

#include "core/camera/camera_counters.hpp"
#include "emulator/camera/camera.hpp"
#include "emulator/camera/releaser.hpp"
#include "emulator/record/recent_timing.hpp"
#include "transports/transport.hpp"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

using TransportList = std::vector<std::unique_ptr<transports::Transport>>;

/// The trigger source of a camera.
struct SourceState {
    std::string_view name = "none";
    ClockState clock = ClockState::free;
    bool lockstep = false;     ///< a simulator steps the camera: its time is no clock's
    std::uint64_t refused = 0; ///< TriggerSource::refused()
    /// Last event of its reference minus the instant at which that was expected; none: it has no reference,
    /// or that has not come twice.
    std::optional<std::int64_t> offset_ns{};
};

/// Adds the counters of the port for simulators to the state of a camera.
void add_metrics(nlohmann::ordered_json& state, const SimulatorCounters& counters);

[[nodiscard]] std::string summary_line(const Camera& camera, const TransportList& transports);

/// {"clock": {"state": "free", "locked", "holdover" or "lockstep", "source", "offset_ns" if known},
///  "trigger": {"refused"}, "camera": {"run", counters...},
///  "latency_us": {"trigger_to_first_row": {"count", "p50", "p99", "max", "sum", "up_to": numbers of spans up
///  to each of latency_bounds_us}, ...},
///  "stages_us": {"trigger_seen": the same, "render", "detector", "first_byte": {"gige": ...}},
///  "transports": {"gige": {...}, ...}}
[[nodiscard]] nlohmann::ordered_json statistics_json(const Camera& camera, const Releaser& releaser,
                                                     const TransportList& transports,
                                                     const StageLatencies& stages, const SourceState& source,
                                                     std::uint32_t run);

} // namespace obscura::emulator
