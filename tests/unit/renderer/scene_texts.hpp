// SPDX-License-Identifier: Apache-2.0
// Scenes of a test as texts: loaded in a folder of their own, or refused with a message.
#pragma once

#include "core/error.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tests/support/temp_folder.hpp"

#include <string>

namespace obscura::test {

struct SceneTexts : TempFolder {
    [[nodiscard]] scene::Scene scene(const std::string& text) const {
        return scene::load_scene(write("s.toml", text));
    }
    /// Message without the folder's path; "accepted" if there is none.
    [[nodiscard]] std::string refusal(const std::string& text) const {
        try {
            (void)scene(text);
        } catch (const Error& error) {
            std::string what = error.what();
            const std::string prefix = path().string() + "/";
            while (what.find(prefix) != std::string::npos)
                what.erase(what.find(prefix), prefix.size());
            return what;
        }
        return "accepted";
    }
};

} // namespace obscura::test
