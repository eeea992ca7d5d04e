// SPDX-License-Identifier: Apache-2.0
// Truth table of a frame of the pipeline: scene and detector together.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/scene_truth.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"

#include <cstddef>
#include <span>

namespace obscura::emulator {

/// Where a frame comes from.
struct FrameSource {
    const renderer::Renderer& renderer;
    const sensors::Detector& detector;
    const SensorDescription& sensor;
    const sensors::ReadoutPlan& plan;    ///< of the frame
    std::span<const RowTime> shown_rows; ///< its rows in the time of the scene that is rendered
    /// Times of the pixels of each window, where they have their own (the same time); else empty.
    std::span<const renderer::PixelTimes> pixel_times{};
};

/// Bounds of the memory that a truth table takes; without any, it allocates.
struct TruthMemory {
    std::size_t max_entries = 0;      ///< see renderer::TruthRequest
    std::span<std::byte> workspace{}; ///< see renderer::TruthRequest
};

/// Lists the truth of a frame by the clock of its row times.
void list_truth(const FrameSource& source, const Frame& frame, SceneTruth& truth,
                const TruthMemory& memory = {});

} // namespace obscura::emulator
