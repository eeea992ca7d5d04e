// SPDX-License-Identifier: Apache-2.0
// Tree of bodies: parents by name and checks of joints.
#pragma once

#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// In place of the index of a parent: none, and the camera, which bodies, lamps and points may hang on.
inline constexpr std::int32_t no_parent = -1, camera_parent = -2;

/// Index of each body's parent, or one of the above. Throws ConfigError if a parent does not exist, parents
/// are circular, also through the camera's own parent or the body that it looks at, or a joint is invalid.
[[nodiscard]] std::vector<std::int32_t> parents_of(const Scene& scene);

/// Index of the body called `name`; -1: none.
[[nodiscard]] std::int32_t index_of(const std::vector<Body>& bodies, const std::string& name) noexcept;
/// Their names, which live as long as the bodies.
[[nodiscard]] std::vector<std::string_view> names_of(const std::vector<Body>& bodies);

/// Index of the parent of a thing that is called `place` in messages, or one of the above. Throws ConfigError
/// if there is no such body or the joint is invalid.
[[nodiscard]] std::int32_t parent_of(const std::vector<Body>& bodies, const std::string& parent,
                                     const Joint& joint, const std::string& place);

/// Why an aim has no target in the scene, with the names that it could have; empty: it has one.
[[nodiscard]] std::string explain_missing_target(const Scene& scene, const Motion& motion);

} // namespace obscura::scene
