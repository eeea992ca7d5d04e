// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/scene_epoch.hpp"

#include "core/error.hpp"
#include "ephemeris/time/time_text.hpp"

#include <fmt/format.h>

namespace obscura::scene {

std::optional<ephemeris::Epoch> SceneEpoch::get() const {
    if (given || text.empty()) return given;
    return ephemeris::read_time(text, ephemeris::system_leap_seconds());
}

ephemeris::Epoch SceneEpoch::required(const std::string& dated) const {
    std::optional<ephemeris::Epoch> epoch;
    try {
        epoch = get();
    } catch (const ConfigError&) {
        return {};
    }
    if (!epoch) throw ConfigError(fmt::format("{}: has dates: the scene needs the key \"epoch\"", dated));
    return *epoch;
}

} // namespace obscura::scene
