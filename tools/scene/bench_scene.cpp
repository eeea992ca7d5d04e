// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/bench_scene.hpp"

#include "core/philox.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/procedural_body.hpp"

#include <cmath>
#include <numbers>

namespace obscura::tools {

emulator::DaemonConfig bench_config() {
    emulator::DaemonConfig config;
    config.source = "(built in)";
    config.sensor.readout.width = config.sensor.readout.height = 1024;
    config.sensor.readout.pixel_clock_hz = 53e6;
    config.sensor.pixel_pitch_m = 5.5e-6;

    scene::Scene& scene = config.scene;
    scene.name = "bench";
    scene.camera.width = scene.camera.height = 1024;
    scene.camera.pixel_pitch_m = 5.5e-6;
    scene.camera.focal_length_m = 0.05;
    scene.camera.aperture_m = 0.025;
    scene.camera.psf_sigma_px = 0.7;
    // The boresight is +x of the inertial frame; the asteroid's disc of 340 px radius fills 35 % of the
    // field.
    const Pose camera{{-26'700, 0, 0}, look_along({1, 0, 0}, {0, 0, 1})};
    scene.camera.motion.samples = {{0, camera}};
    const double au_m = 149'597'870'700.0;
    scene.sun.position_m = normalized(Vec3{-0.6, -0.7, 0.4}) * (2.5 * au_m);

    scene::Body body;
    body.name = "asteroid";
    body.shape = renderer::ProceduralBodyParameters{1000, {1.0, 0.9, 0.85}, 7, 7};
    body.material = renderer::LommelSeeligerParameters{0.12};
    body.motion.spin_rate_rad_s = 1e-3;
    scene.bodies.push_back(body);
    for (std::uint32_t i = 0; i < 200; ++i) {
        const auto r = philox4x32({i, 0, 0, 0}, {2026, 0});
        scene::Star star;
        star.right_ascension_rad = (uniform_double(r[0]) - 0.5) * 0.112; // field of view: 6.5 degrees
        star.declination_rad = (uniform_double(r[1]) - 0.5) * 0.112;
        if (star.right_ascension_rad < 0) star.right_ascension_rad += 2 * std::numbers::pi;
        star.magnitude_v = 3 + 5 * uniform_double(r[2]);
        star.colour_b_v = -0.2 + 1.6 * uniform_double(r[3]);
        scene.stars.push_back(star);
    }
    return config;
}

} // namespace obscura::tools
