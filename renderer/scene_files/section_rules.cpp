// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/section_rules.hpp"

#include <fmt/format.h>

namespace obscura::scene {

void exclude(const config::ReadTable& table, std::string_view key, std::string_view other) {
    if (table.has(key) && table.has(other))
        table.refuse(key, fmt::format("cannot stand beside \"{}\"", other));
}

void require(const config::ReadTable& table, std::string_view key) {
    if (!table.has(key)) table.refuse_table(fmt::format("the key \"{}\" is missing", key));
}

void require_direction(const config::ReadTable& table, Vec3 value, std::string_view key) {
    if (table.has(key) && !(length(value) > 0)) table.refuse(key, "a vector that is not zero is wanted");
}

} // namespace obscura::scene
