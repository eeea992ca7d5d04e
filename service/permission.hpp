// SPDX-License-Identifier: Apache-2.0
// Permissions of a connection, each with those before it.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::service {

/// What a call needs, and a connection has.
enum class Permission : std::uint8_t {
    view,    ///< state and descriptions
    operate, ///< the camera: trigger, step, streams
    scene,   ///< poses, materials, pictures
    admin,   ///< files and configuration
};
constexpr auto enum_names(Permission /*type*/) {
    return std::array{EnumName{Permission::view, "view"}, EnumName{Permission::operate, "operate"},
                      EnumName{Permission::scene, "scene"}, EnumName{Permission::admin, "admin"}};
}

} // namespace obscura::service
