// SPDX-License-Identifier: Apache-2.0
// Truth table of a frame of the pipeline: scene and detector together.
#pragma once

#include "core/frame.hpp"
#include "core/scene_truth.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"

namespace obscura::emulator {

/// Where a frame comes from.
struct FrameSource {
    const renderer::Renderer& renderer;
    const sensors::Detector& detector;
    const SensorDescription& sensor;
    const sensors::ReadoutPlan& plan; ///< of the frame, scene time
};

/// Lists the truth of a frame; times are in the scheduling clock, as those of `info`. Allocates.
void list_truth(const FrameSource& source, const FrameInfo& info, SceneTruth& truth);

} // namespace obscura::emulator
