// SPDX-License-Identifier: Apache-2.0
// Scenes by which estimates of the error are judged: an asteroid, a limb, a box of many reflections,
// planetshine.
#pragma once

#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"

#include <cmath>
#include <string>

namespace obscura::test {

/// A scene and the part of its frame that is looked at.
struct Subject {
    std::string name;
    scene::Scene scene;
    Region window;
    std::int64_t exposure_ns = 0;
};

inline Subject asteroid() {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 90, 256);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 1, 5};
    return {"asteroid", s, {40, 96, 144, 40}};
}

/// Sky, limb, terminator and night of a body whose pixels share a sample grid with a target error.
inline Subject limb() {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 300, 672);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.9, 0.8}, 3, 6};
    return {"limb", s, {10, 300, 640, 16}};
}

/// Light of an area light and of many reflections in seven bands.
inline Subject cornell() {
    scene::Scene s = scene::load_scene(OBSCURA_SOURCE_DIR "/config/scenes/cornell.toml");
    s.camera.pixel_pitch_m *= 512.0 / 256;
    s.camera.width = s.camera.height = 256;
    return {"cornell", s, {64, 64, 96, 16}};
}

/// The night side of a moon in the light of its planet, `radius_px` in radius.
inline Subject planetshine(double radius_px) {
    scene::Scene s;
    s.sun.position_m = {0, 0, -astronomical_unit_m};
    const renderer::LambertParameters grey{0.3};
    s.bodies.push_back({"moon", renderer::EllipsoidParameters{{100, 100, 100}}, grey, {}});
    s.bodies.push_back({"planet", renderer::EllipsoidParameters{{600, 600, 600}}, grey, {}});
    s.bodies[1].motion.samples[0].pose.position_m = {0, 0, 900};
    s.max_bounces = 1;
    const auto size = static_cast<std::int32_t>(2.1 * radius_px);
    s.camera = camera_at({400, 0, 300}, size, std::asin(100.0 / 500) / radius_px);
    return {"planetshine", s, {size / 8, size / 3, size * 3 / 4, 16}};
}

} // namespace obscura::test
