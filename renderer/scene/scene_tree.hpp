// SPDX-License-Identifier: Apache-2.0
// Tree of bodies: parents by name and checks of joints.
#pragma once

#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::scene {

/// Index of each body's parent, -1: none. Throws ConfigError if a parent does not exist, parents are circular
/// or a joint is invalid.
[[nodiscard]] std::vector<std::int32_t> parents_of(const std::vector<Body>& bodies);

/// Index of the body called `name`; -1: none.
[[nodiscard]] std::int32_t index_of(const std::vector<Body>& bodies, const std::string& name) noexcept;

/// Index of the parent of a camera or a lamp, called `place` in messages; -1: none. Throws ConfigError if the
/// body does not exist or the joint is invalid. (Only bodies are parents: no circles.)
[[nodiscard]] std::int32_t parent_of(const std::vector<Body>& bodies, const std::string& parent,
                                     const Joint& joint, const std::string& place);

/// Why an aim has no target in the scene, with the names that it could have; empty: it has one.
[[nodiscard]] std::string explain_missing_target(const std::vector<Body>& bodies, const Motion& motion);

} // namespace obscura::scene
