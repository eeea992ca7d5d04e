// SPDX-License-Identifier: Apache-2.0
// Tables of a scene file from the scene of a published client.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <string>
#include <string_view>

namespace obscura::serve::compatible {

class ClientState;

/// The scene of `client_state`, whose session folder gets files that the tables name.
[[nodiscard]] nlohmann::json scene_tables(ClientState& client_state);

} // namespace obscura::serve::compatible
