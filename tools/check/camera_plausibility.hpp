// SPDX-License-Identifier: Apache-2.0
// Plausibility of the cameras of a configuration: view, expected signal, durations.
#pragma once

#include "emulator/unit/assemble.hpp"
#include "tools/check/frame_estimate.hpp"
#include "tools/check/plausibility.hpp"

#include <optional>
#include <string>

namespace obscura::tools {

/// View of a configured camera.
[[nodiscard]] Plausibility view_of_camera(const std::string& name, const emulator::DaemonConfig& config,
                                          const emulator::Imaging& imaging);

/// Durations that follow from the settings after reset.
[[nodiscard]] TimeFigures times_of_camera(const emulator::DaemonConfig& config,
                                          const emulator::Imaging& imaging);

/// Signal of a frame that was made with pixel truth; none with a test pattern or automatic exposure, which
/// say nothing about the settings.
[[nodiscard]] std::optional<SignalFigures> signal_of_frame(const emulator::DaemonConfig& config,
                                                           const Frame& frame);

/// Renders the first frame as estimate_frame() does, and adds its signal and its rendering time; the signal
/// as signal_of_frame().
void add_estimates(Plausibility& plausibility, const emulator::DaemonConfig& config,
                   const emulator::Imaging& imaging, double limit_s, const RowsDone& rows_done);

/// As add_estimates(), of a scene without a sensor.
void add_estimates(Plausibility& plausibility, const renderer::Renderer& renderer, double limit_s,
                   const RowsDone& rows_done);

} // namespace obscura::tools
