// SPDX-License-Identifier: Apache-2.0
#include "renderer/registries/shape_cache.hpp"

#include "renderer/planets/surface_tiles.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/shapes/model_shape.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>
#include <variant>

namespace obscura::renderer {
namespace {

/// Size and time of change of a file.
std::string state_of(const std::filesystem::path& file) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const auto changed = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    return fmt::format(" {} {}", bytes, changed);
}

/// The same of a file and, if it is a label, of all those beside it that differ in the ending alone.
std::string state_with_data(const std::filesystem::path& file) {
    std::string state = state_of(file);
    if (file.extension() != ".lbl" && file.extension() != ".LBL") return state;
    std::map<std::string, std::string> beside; // a folder has no order
    std::error_code error;
    for (std::filesystem::directory_iterator each(file.parent_path(), error), end; !error && each != end;
         each.increment(error))
        if (each->path().stem() == file.stem())
            beside.emplace(each->path().filename().string(), state_of(each->path()));
    for (const auto& [name, of_it] : beside)
        state += of_it;
    return state;
}

void add(const config::Key& key, std::string& text) {
    text += fmt::format("\n{} = {}", key.name, config::value_text(key));
    if (const auto* path = std::get_if<config::Path>(&key.target)) text += state_with_data(*path->value);
}

void add(const config::Section& section, std::string& text) {
    text += fmt::format("\n[{}]", section.name);
    for (const config::Key& key : section.keys)
        add(key, text);
    for (const config::Section& table : section.tables)
        add(table, text);
    for (const config::List& list : section.lists)
        for (std::size_t i = 0; i < list.size(); ++i)
            add(list.at(i), text);
}

/// All that a shape is made of.
std::string key_of(const scene::Shape& description, bool emits) {
    scene::Shape bound = description; // what the keys are bound to
    const ShapeKind& kind = *scene::find_kind(shape_kinds(), description.kind());
    std::string key = fmt::format("{} {}", kind.name, emits);
    for (const scene::Parameter& parameter : kind.parameters(bound))
        add(parameter.key, key);
    add(kind.tables(bound), key);
    if (const auto* const model = description.get_if<ModelShapeParameters>()) key += identity_of(*model);
    return key;
}

bool keeps_history(const Shape& shape) {
    return shape.tiles() != nullptr && shape.tiles()->sun_visibility() != nullptr;
}

} // namespace

void ShapeCache::begin_scene(const std::vector<WantedShape>& wanted) {
    std::map<std::string, std::shared_ptr<const Shape>> kept;
    for (const WantedShape& each : wanted)
        if (auto found = shapes_.extract(key_of(*each.description, each.emits)))
            kept.insert(std::move(found));
    shapes_ = std::move(kept);
}

std::shared_ptr<const Shape> ShapeCache::get(const scene::Shape& description, ShapeContext& context) {
    const std::string key = key_of(description, context.emits);
    if (const auto kept = shapes_.find(key); kept != shapes_.end()) return kept->second;
    std::shared_ptr<const Shape> shape = make_shape(description, context);
    if (!keeps_history(*shape)) shapes_.emplace(key, shape);
    return shape;
}

} // namespace obscura::renderer
