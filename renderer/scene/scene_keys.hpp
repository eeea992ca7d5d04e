// SPDX-License-Identifier: Apache-2.0
// Keys of scene files for the plain structs of a scene: units, ranges, defaults and help of their members.
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::scene {

/// 1e15 m is far beyond any planet and still a comfortable double.
constexpr config::Range anywhere{-1e15, 1e15};

// The keys are bound to the members of their argument. Keys that stand for something else (a direction
// instead of a position, the kinds of shape and material) are added by renderer/scene_files.
[[nodiscard]] config::Keys keys_of(Scene& scene);
[[nodiscard]] config::Keys keys_of(Sun& sun);
[[nodiscard]] config::Keys keys_of(Camera& camera);
[[nodiscard]] config::Keys keys_of(Body& body);
[[nodiscard]] config::Keys keys_of(Lamp& lamp);
[[nodiscard]] config::Keys keys_of(SpectralBand& band);
[[nodiscard]] config::Keys keys_of(StrayLight& stray);

} // namespace obscura::scene
