// Which body hangs on which.
#pragma once

#include "core/scene.hpp"

#include <cstdint>
#include <vector>

namespace obscura::scene {

/// Index of each body's parent, -1 where it has none. Throws ConfigError when a parent is not there, when
/// bodies hang on each other in a circle, or when a joint cannot be.
[[nodiscard]] std::vector<std::int32_t> parents_of(const std::vector<Body>& bodies);

} // namespace obscura::scene
