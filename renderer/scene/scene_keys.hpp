// SPDX-License-Identifier: Apache-2.0
// Keys of scene files for the structs of a scene: units, ranges, defaults and help of their members.
#pragma once

#include "config/keys.hpp"
#include "core/pose_range.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::scene {

/// Range of coordinates in metres.
constexpr config::Range anywhere{-max_position_m, max_position_m};

/// Ranges of longitudes and latitudes in degrees.
constexpr config::Range longitudes_deg{-360, 360}, latitudes_deg{-90, 90};

// Keys bound to the members of the argument. Keys that have no member of their own (a direction instead of a
// position, kinds of shape and material) are added by renderer/scene_files.
[[nodiscard]] config::Keys keys_of(Scene& scene);
[[nodiscard]] config::Keys keys_of(Sun& sun);
[[nodiscard]] config::Keys keys_of(Camera& camera);
[[nodiscard]] config::Keys keys_of(Body& body);
[[nodiscard]] config::Keys keys_of(Lamp& lamp);
[[nodiscard]] config::Keys keys_of(SpectralBand& band);
[[nodiscard]] config::Keys keys_of(models::Global& landmark);
[[nodiscard]] config::Keys keys_of(Landmark& landmark);
[[nodiscard]] config::Keys keys_of(StrayLight& stray);

} // namespace obscura::scene
