// SPDX-License-Identifier: Apache-2.0
// Scene file reader: [scene] [sun] [stars] [camera] [[body]] [[lamp]] [[band]] [[stray_light]].
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::scene {

/// Reads a scene file and the tables that it refers to. Throws ConfigError with one line for each mistake.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file);

/// Parses `text` as the scene file `file`, which need not exist: paths are relative to its folder. For
/// programs that describe a scene, or a body of one, by the keys of scene files. Throws ConfigError.
[[nodiscard]] Scene parse_scene(std::string_view text, const std::filesystem::path& file);

/// As parse_scene(), of the tree of the file.
[[nodiscard]] Scene read_scene(const config::Value& root, const std::filesystem::path& file);

/// Reads `table` over `camera`; the place stays if none of its keys is given. Returns the keys given, as
/// TOML. Throws ConfigError.
std::string read_view(const config::Value& table, const config::Where& where, Scene& scene);

} // namespace obscura::scene
