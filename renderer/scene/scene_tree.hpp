// SPDX-License-Identifier: Apache-2.0
// Which body hangs on which.
#pragma once

#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::scene {

/// Index of each body's parent, -1 where it has none. Throws ConfigError when a parent is not there, when
/// bodies hang on each other in a circle, or when a joint cannot be.
[[nodiscard]] std::vector<std::int32_t> parents_of(const std::vector<Body>& bodies);

/// Index of the body called `name`; -1: none.
[[nodiscard]] std::int32_t index_of(const std::vector<Body>& bodies, const std::string& name) noexcept;

/// Index of the body that a camera or a lamp, called `place` in messages, hangs on; -1: none. Throws
/// ConfigError when there is no such body or the joint cannot be. (Nothing hangs on them: no circles.)
[[nodiscard]] std::int32_t parent_of(const std::vector<Body>& bodies, const std::string& parent,
                                     const Joint& joint, const std::string& place);

} // namespace obscura::scene
