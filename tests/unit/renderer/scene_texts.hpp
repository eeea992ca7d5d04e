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

/// A scene with a camera of 64 x 64 pixels of 100 urad that vibrates by a model. `more`: lines of its
/// section.
inline std::string vibrating_camera_text(const std::string& vibration, const std::string& more = {}) {
    return R"(
[sun]
position_m = [-1.5e11, 0, 0]
[camera]
width = 64
height = 64
pixel_pitch_um = 10
focal_length_mm = 100
aperture_mm = 10
position_m = [0, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
psf_sigma_px = 0.7
vibration = )" +
           vibration + "\n" + more;
}

} // namespace obscura::test
