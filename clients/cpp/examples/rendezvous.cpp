// SPDX-License-Identifier: Apache-2.0
// A chaser approaches a target and its arm unfolds: 100 frames with depth maps, a light spot on the target.
//
// The arm is a tree: each link hangs on the one before by a hinge, so that a frame only sets angles. Prints
// one line a frame and writes the last scene.
//
// Usage: rendezvous [FRAMES [FOLDER]]
// Build: c++ -std=c++17 rendezvous.cpp $(pkg-config --cflags --libs obscura-client)
#include "../../c/src/sha256.h"

#include <obscura_client.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <numeric>
#include <string>

using obscura::client::Map;

namespace {

/// A boom of 2 m, hinged at its parent's end.
Map boom(const char* name, const char* parent) {
    return {{"name", name},
            {"parent", parent},
            {"position_m", {0, 0, 2}},
            {"shape", "cone"},
            {"bottom_radius_m", 0.08},
            {"top_radius_m", 0.08},
            {"height_m", 2},
            {"albedo", 0.6},
            {"joint", "hinge"},
            {"joint_axis", {0, 1, 0}},
            {"joint_angle_deg", 0}};
}

Map scene() {
    return {{"sun", Map{{"direction", {-0.6, -0.5, -1}}}},
            {"camera", Map{{"width", 256},
                           {"height", 256},
                           {"focal_length_mm", 25},
                           {"pixel_pitch_um", 20},
                           {"aperture_mm", 10},
                           {"look_at", "target"}}},
            {"lamp",
             {Map{{"name", "spot"},
                  {"beam", "gaussian"},
                  {"half_angle_deg", 2},
                  {"intensity_w_sr", {5e5}},
                  {"look_at", "target"}}}},
            {"body",
             {Map{{"name", "target"},
                  {"shape", "box"},
                  {"size_m", {3, 3, 4}},
                  {"albedo", 0.3},
                  {"spin_axis", {0, 0, 1}},
                  {"spin_rate_deg_per_s", 0.5}},
              boom("upper arm", "target"), boom("forearm", "upper arm")}}};
}

void fly(int frames, const std::string& folder) {
    auto camera = obscura::client::start();
    camera.load_scene(scene());
    sha256 digest = sha256_begin();
    obscura::client::RenderOptions options;
    options.samples = 4;
    options.layers = {"depth_m"};
    options.truth = true;
    for (int frame = 0; frame < frames; ++frame) {
        const double along = static_cast<double>(frame) / std::max(frames - 1, 1), rest = 1 - 0.6 * along;
        camera.set("camera", {{"position_m", {6.0 * rest, -3.0 * rest, -60.0 * rest}}});
        camera.set("lamp", "spot", {{"position_m", {6.0 * rest + 0.5, -3.0 * rest, -60.0 * rest}}});
        camera.set("body", "upper arm", {{"joint_angle_deg", 70 * along}});
        camera.set("body", "forearm", {{"joint_angle_deg", 40 * along}});
        options.time_s = frame;
        options.frame = frame + 1;
        const auto picture = camera.render(options);
        const auto light = picture["irradiance"], depth = picture["depth_m"];
        float nearest = INFINITY;
        for (const float each : depth)
            nearest = std::fmin(nearest, each);
        sha256_add(&digest, light.data(), light.bytes());
        std::printf("frame %3d: nearest surface %7.3f m, light %.4e W/m2\n", frame + 1, double{nearest},
                    std::accumulate(light.begin(), light.end(), 0.0));
    }
    std::ofstream file(folder + "/rendezvous.toml");
    if (!(file << camera.export_toml()).flush()) throw std::runtime_error(folder + "/rendezvous.toml");
    char hex[65];
    sha256_end(&digest, hex);
    std::printf("sha256 of all pictures: %s\n", hex);
}

} // namespace

int main(int argc, char* argv[]) {
    try {
        fly(argc > 1 ? std::atoi(argv[1]) : 100, argc > 2 ? argv[2] : ".");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rendezvous: %s\n", error.what());
        return 1;
    }
}
