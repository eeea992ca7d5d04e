// SPDX-License-Identifier: Apache-2.0
// What users should know of the models that they have written for a scene.
#pragma once

#include "renderer/scene/scene.hpp"

#include <string>
#include <vector>

namespace obscura::renderer {

/// A line for each, without a full stop. Throws ConfigError for a model that cannot be used.
[[nodiscard]] std::vector<std::string> model_warnings(const scene::Scene& scene);

} // namespace obscura::renderer
