// SPDX-License-Identifier: Apache-2.0
// Tables of a scene file from the scene of a published client.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <string>
#include <string_view>

namespace obscura::serve::compatible {

class Door;

/// The scene of `door`, whose session folder gets files that the tables name.
[[nodiscard]] nlohmann::json scene_tables(Door& door);

} // namespace obscura::serve::compatible
