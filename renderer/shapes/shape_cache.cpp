// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/shape_cache.hpp"

#include "renderer/shapes/registry.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>
#include <variant>

namespace obscura::renderer {
namespace {

/// Size and time of change of a file.
std::string state_of(const std::string& file) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    const auto changed = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    return fmt::format("{} {}", bytes, changed);
}

/// All that a shape is made of; empty: more than its parameters.
std::string key_of(const scene::Shape& description, bool emits) {
    scene::Shape bound = description; // what the keys are bound to
    const ShapeKind& kind = *scene::find_kind(shape_kinds(), description.kind());
    const config::Section inside = kind.tables(bound);
    if (!inside.tables.empty() || !inside.lists.empty()) return {};
    std::string key = fmt::format("{} {}", kind.name, emits);
    for (const scene::Parameter& parameter : kind.parameters(bound)) {
        key += fmt::format("\n{} = {}", parameter.key.name, config::value_text(parameter.key));
        if (const auto* path = std::get_if<config::Path>(&parameter.key.target))
            key += fmt::format(" {}", state_of(*path->value));
    }
    return key;
}

} // namespace

void ShapeCache::begin_scene() {
    last_.merge(now_);
    now_.clear();
}

std::shared_ptr<const Shape> ShapeCache::get(const scene::Shape& description, ShapeContext& context) {
    const std::string key = key_of(description, context.emits);
    if (key.empty()) return make_shape(description, context);
    std::shared_ptr<const Shape>& shape = now_[key];
    if (const auto kept = last_.find(key); !shape && kept != last_.end()) shape = kept->second;
    if (!shape) shape = make_shape(description, context);
    return shape;
}

void ShapeCache::end_scene() {
    last_.clear();
}

} // namespace obscura::renderer
