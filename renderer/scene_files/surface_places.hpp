// SPDX-License-Identifier: Apache-2.0
// Positions of what a scene file places on bodies by longitude and latitude, and of landmarks that are aimed
// at.
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene/sky_object.hpp"

#include <vector>

namespace obscura::scene {

/// Turns the places on bodies of camera, bodies, lamps and `points` into positions in the frames of their
/// parents, and aims at landmarks into aims at points of their bodies; what was turned before stays. Makes
/// the shapes of bodies whose ground is asked for. `mistakes` gets what is wrong; with mistakes before,
/// grounds are not looked for.
void find_surface_places(Scene& scene, std::vector<SkyObject>& points, config::Mistakes& mistakes);

/// Aims `motion` at the landmark that its aim names, if there is no body of that name. Throws ConfigError or
/// InputError if the landmark has no place.
void aim_at_landmark(const Scene& scene, Motion& motion);

} // namespace obscura::scene
