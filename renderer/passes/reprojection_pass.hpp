// SPDX-License-Identifier: Apache-2.0
// Reprojection pass: motion of kept light since its frame, the rows that take it, and the keeping of it.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/row_block.hpp"
#include "renderer/passes/row_scheduler.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/world/exposure.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace obscura::renderer {

/// Finds the motion of the request's reprojected rows; false when cancelled.
bool fill_motion(const RowScheduler& workers, const PassRequest& request, const std::atomic<bool>* cancel,
                 const RowBlock& rows);
/// The same of its rows `first` to `last`, whatever their levels.
bool fill_motion(const RowScheduler& workers, const PassRequest& request, std::int32_t first,
                 std::int32_t last, const std::atomic<bool>* cancel, const RowBlock& rows);

/// Takes the pixels of row `y` of what was kept from the earlier frame; `now`: the middle of the exposure.
/// Real-time safe.
void take_earlier(const BuiltScene& built, const PassRequest& request, std::int32_t y, QualityLevel level,
                  std::size_t channels, const RowState& now, Scratch& s);
/// Keeps the light of a row's bodies. Allocates on the first row of a thread only.
void keep_light(const BuiltScene& built, const PassRequest& request, std::int32_t y, const Exposure& when,
                Scratch& s);

} // namespace obscura::renderer
