// SPDX-License-Identifier: Apache-2.0
// A ball comes nearer, ten pictures with depth. Build: c++ first.cpp $(pkg-config --cflags --libs
// obscura-client)
#include <obscura_client.hpp>

#include <cmath>
#include <cstdio>

int main() {
    auto camera = obscura::client::start();
    camera.set("camera", {{"width", 640}, {"height", 480}, {"focal_length_mm", 25}});
    camera.set("sun", {{"direction", {-1, -1, -2}}});
    camera.add("body", {{"name", "ball"}, {"shape", "ellipsoid"}, {"radii_m", {1, 1, 1}}, {"albedo", 0.3}});
    obscura::client::RenderOptions options;
    options.samples = 16;
    options.layers = {"depth_m"};
    for (int step = 0; step < 10; ++step) {
        camera.set("body", "ball", {{"position_m", {0, 0, 40 - step}}});
        const auto picture = camera.render(options);
        float nearest = INFINITY;
        for (const float depth : picture["depth_m"])
            nearest = std::fmin(nearest, depth);
        std::printf("nearest surface %.3f m\n", double{nearest});
    }
}
