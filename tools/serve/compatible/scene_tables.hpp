// SPDX-License-Identifier: Apache-2.0
// Tables of a scene file from the scene of a published client.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <string>
#include <string_view>

namespace obscura::tools::compatible {

class Door;

/// The scene of `door`, whose session folder gets files that the tables name.
[[nodiscard]] nlohmann::json scene_tables(Door& door);

/// Spectral band of a channel: red, green, blue as the colours of textures, and all of them; "from_nm",
/// "to_nm".
struct ChannelBand {
    double from_nm, to_nm;
};
constexpr std::array<ChannelBand, 4> channel_bands{{{600, 700}, {500, 600}, {400, 500}, {400, 700}}};

} // namespace obscura::tools::compatible
