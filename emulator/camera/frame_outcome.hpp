// SPDX-License-Identifier: Apache-2.0
// Outcome of one trigger edge, from the camera's counters before it and after.
#pragma once

#include "emulator/camera/camera.hpp"

#include <cstdint>

namespace obscura::emulator {

/// Edges whose frames have come to their end, or that have become none.
[[nodiscard]] std::uint64_t ended_edges(const CameraCounters& counters) noexcept;

/// Outcome of the edge between two counts that differ by one in ended_edges(): "complete", "late",
/// "repeated", "partial", "dropped", "abandoned" or "missed".
[[nodiscard]] const char* outcome_of(const CameraCounters& before, const CameraCounters& after) noexcept;

} // namespace obscura::emulator
