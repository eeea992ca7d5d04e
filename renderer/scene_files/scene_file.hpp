// SPDX-License-Identifier: Apache-2.0
// Scene files: [scene] [sun] [stars] [camera] [[body]] [[lamp]] [[band]] [[stray_light]].
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::scene {

/// Reads a scene file with the tables that it names. Throws ConfigError with one line for each mistake.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file);

/// The scene that `text` would be in the scene file `file`, which need not exist: paths in it start from its
/// folder. For programs that describe a scene, or a body of one, by the keys of scene files. Throws
/// ConfigError.
[[nodiscard]] Scene parse_scene(std::string_view text, const std::filesystem::path& file);

/// Reads `table` over `camera`; the place stays when none is given. Returns what was given, as TOML. Throws
/// ConfigError.
std::string read_view(const config::Value& table, const config::Where& where, Camera& camera);

} // namespace obscura::scene
