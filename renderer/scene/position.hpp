// SPDX-License-Identifier: Apache-2.0
// Position of a part of a scene in its file, put before messages about that part.
#pragma once

#include "core/error.hpp"

#include <cerrno>
#include <string>
#include <utility>

namespace obscura::scene {

/// "position: text", or `text` alone if `position` is empty or `text` begins with it.
[[nodiscard]] inline std::string placed(const std::string& position, const std::string& text) {
    return position.empty() || text.starts_with(position) ? text : position + ": " + text;
}

/// Returns what `build` returns, which makes a part of a scene. `position` ("file:line:column", or empty) is
/// put before the text of a ConfigError or InputError that it throws.
template<typename Build>
decltype(auto) at_position(const std::string& position, Build&& build) {
    try {
        return std::forward<Build>(build)();
    } catch (const ConfigError& error) {
        throw ConfigError(placed(position, error.what()));
    } catch (const InputError& error) {
        throw InputError(placed(position, error.what()), error.status() == exit_no_permission ? EACCES : 0);
    }
}

} // namespace obscura::scene
