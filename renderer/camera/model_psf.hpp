// SPDX-License-Identifier: Apache-2.0
// Point spread function that a user has written in SuMoL: its program, and what is wrong with it.
#pragma once

#include "models/kinds/psf_program.hpp"
#include "renderer/scene/scene.hpp"

#include <string>
#include <vector>

namespace obscura::renderer {

/// The function of a camera whose psf is a model. Throws ConfigError for one that cannot be used, tested in
/// the middle and the corners of the sensor: not finite, negative, or less than half of the light in the
/// core.
[[nodiscard]] models::PsfProgram psf_program(const scene::Camera& camera);

/// What users should know of the camera's function if it is a model, a line each, without a full stop.
[[nodiscard]] std::vector<std::string> psf_warnings(const scene::Camera& camera);

} // namespace obscura::renderer
