// SPDX-License-Identifier: Apache-2.0
// Point pass: bodies smaller than pixels, as points of the image.
#pragma once

#include "renderer/integrators/point_splatter.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/row_block.hpp"
#include "renderer/passes/row_scheduler.hpp"
#include "renderer/passes/scratch.hpp"

#include <atomic>
#include <cstdint>

namespace obscura::renderer {

/// Traces the small bodies that the request's rows share; false when cancelled.
bool fill_points(const RowScheduler& workers, const PassRequest& request, const std::atomic<bool>* cancel,
                 RowBlock& rows);
/// Adds the small bodies at instant `instant` of the row's exposure.
void splat_bodies(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                  const SplatTarget& target, std::uint32_t instant, Tracer& tracer, Scratch& s);

} // namespace obscura::renderer
