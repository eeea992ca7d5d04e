// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/scene_file.hpp"

#include "core/error.hpp"
#include "renderer/scene_files/camera_section.hpp"
#include "renderer/scene_files/kernel_keys.hpp"
#include "renderer/scene_files/scene_section.hpp"
#include "renderer/scene_files/surface_places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

namespace obscura::scene {

std::string read_view(const config::Value& table, const config::Where& where, Scene& scene) {
    config::Section section = camera_section(scene.camera, std::make_shared<KernelKeys>(scene));
    config::Mistakes mistakes;
    read_section(&table, table.at, where, section, mistakes);
    std::vector<SkyObject> no_points;
    find_surface_places(scene, no_points, mistakes);
    mistakes.throw_if_any();
    section.keys.erase(
        std::remove_if(section.keys.begin(), section.keys.end(),
                       [&](const config::Key& key) { return table.find(key.name) == nullptr; }),
        section.keys.end());
    return print_keys(section.keys);
}

Scene read_scene(const config::Value& root, const std::filesystem::path& file) {
    for (const std::string_view table : {"scene", "daemon", "sensor", "trigger", "gige"})
        if (root.find(table) != nullptr)
            throw ConfigError(
                fmt::format("{}: is a configuration, by its table [{}]; a scene is wanted. obscura capture "
                            "makes what the camera of a configuration would see",
                            file.string(), table));
    Scene scene;
    config::Mistakes mistakes;
    read_section(&root, root.at, {file, ""}, scene_section(scene), mistakes);
    mistakes.throw_if_any();
    if (scene.name.empty()) scene.name = file.stem().string();
    return scene;
}

Scene load_scene(const std::filesystem::path& file) {
    return read_scene(config::parse_file(file), file);
}

Scene parse_scene(std::string_view text, const std::filesystem::path& file) {
    return read_scene(config::parse_text(text, file.string()), file);
}

} // namespace obscura::scene
