// SPDX-License-Identifier: Apache-2.0
// Truth pass: where things are in a frame, by what its rows were rendered with.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/integrators/star_rows.hpp"
#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/scratch.hpp"
#include "renderer/passes/tile_loading.hpp"
#include "renderer/truth/overlay.hpp"
#include "renderer/truth/scene_truth.hpp"

namespace obscura::renderer {

/// Memory of the truth of a frame: its stars, and the states of the scene. One call at a time.
struct TruthMemory {
    StarsInView stars;
    Scratch scratch;
};

/// See Renderer::fill_truth().
void fill_ground_truth(const BuiltScene& built, Time t, GroundTruth& truth) noexcept;
/// See Renderer::list_truth().
void list_frame_truth(const BuiltScene& built, const TileLoading& tiles, const TruthRequest& request,
                      StarsInView& in_view, Scratch& scratch, SceneTruth& truth);
/// See Renderer::overlay().
[[nodiscard]] Overlay frame_overlay(const BuiltScene& built, const TileLoading& tiles,
                                    const OverlayRequest& request, TruthMemory& memory);

} // namespace obscura::renderer
