// SPDX-License-Identifier: Apache-2.0
// Projection and distortion of a lens as cards of an image's header.
#pragma once

#include "images/writers/card.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// PROJ, SENSROT and DISTMODL with the numbers of the model: DISTN and DIST00, DIST01, ..., or of a table
/// DISTI000 and DISTR000, ... With images::intrinsics_cards() they give the direction of every pixel;
/// docs/images.md says how.
[[nodiscard]] images::Cards lens_cards(const scene::Camera& camera);

} // namespace obscura::renderer
