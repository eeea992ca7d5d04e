// SPDX-License-Identifier: Apache-2.0
// Vectors as JSON, for what verbs print and write.
#pragma once

#include "core/geometry.hpp"

#include <nlohmann/json.hpp>

namespace obscura::tools {

/// [x, y, z].
[[nodiscard]] inline nlohmann::ordered_json vector_json(Vec3 v) {
    return nlohmann::ordered_json::array({v.x, v.y, v.z});
}
/// [w, x, y, z].
[[nodiscard]] inline nlohmann::ordered_json quaternion_json(Quat q) {
    return nlohmann::ordered_json::array({q.w, q.x, q.y, q.z});
}

} // namespace obscura::tools
