// Scene files: [scene] [sun] [stars] [camera] [[body]] [[lamp]] [[band]] [[stray_light]].
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

#include <filesystem>
#include <string>

namespace obscura::scene {

/// Reads a scene file with the tables that it names. Throws ConfigError.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file);

/// Reads `table` over `camera`; the place stays when none is given. Returns what was given, as TOML. Throws
/// ConfigError.
std::string read_view(const config::Value& table, const config::Where& where, Camera& camera);

} // namespace obscura::scene
