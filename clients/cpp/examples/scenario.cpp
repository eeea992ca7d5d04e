// SPDX-License-Identifier: Apache-2.0
// One picture of a ball, whose bytes are the same in every language: prints their SHA-256.
//
// Usage: scenario ADDRESS
#include "../../c/examples/sha256.h"

#include <obscura_client.hpp>

#include <cstdio>
#include <exception>

using obscura::client::Map;

int main(int argc, char* argv[]) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: scenario ADDRESS\n");
        return 64;
    }
    try {
        auto camera = obscura::client::connect(argv[1]);
        camera.load_scene({{"camera", Map{{"width", 64},
                                          {"height", 48},
                                          {"focal_length_mm", 25},
                                          {"pixel_pitch_um", 20},
                                          {"boresight", {0, 0, 1}},
                                          {"up", {0, -1, 0}}}},
                           {"sun", Map{{"direction", {-1, -1, -2}}}}});
        camera.add("body", {{"name", "ball"},
                            {"shape", "ellipsoid"},
                            {"radii_m", {1, 1, 1}},
                            {"albedo", 0.3},
                            {"position_m", {0, 0, 40}}});
        camera.set("body", "ball", {{"position_m", {0.25, -0.5, 20}}});
        obscura::client::RenderOptions options;
        options.time_s = 2.5;
        options.samples = 4;
        options.seed = 7;
        options.layers = {"depth_m"};
        const auto picture = camera.render(options);
        for (const auto& array : picture.arrays()) {
            sha256 digest = sha256_begin();
            char hex[65];
            sha256_add(&digest, array.data(), array.bytes());
            sha256_end(&digest, hex);
            std::printf("%.*s %s\n", static_cast<int>(array.name().size()), array.name().data(), hex);
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "scenario: %s\n", error.what());
        return 1;
    }
}
