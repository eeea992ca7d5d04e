// SPDX-License-Identifier: Apache-2.0
// Readout whose times are those of a model written in SuMoL.
#pragma once

#include "sensors/sensor.hpp"

#include <cstdint>
#include <span>
#include <string>

namespace obscura::sensors {

/// Appends a frame by ReadoutSettings::timing to `plan`. Windows follow one another: each has its trigger
/// when the one before it has been read. Rows leave in their order: one that is read before the row above it
/// waits for that. Returns why a time cannot be, or an empty string. Real-time safe where it is empty.
[[nodiscard]] std::string plan_modelled(const ReadoutSettings& settings,
                                        std::span<const WindowRequest> windows,
                                        std::span<const std::uint32_t> flags, Time trigger,
                                        ReadoutPlan& plan);

} // namespace obscura::sensors
