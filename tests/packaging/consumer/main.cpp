// SPDX-License-Identifier: Apache-2.0
// A program outside the tree, built on the installed libraries: renders the shipped scene, or that of its
// argument.
#include "renderer/renderer.hpp"
#include "renderer/scene_files/scene_file.hpp"

#include <cstdio>
#include <vector>

int main(int argc, char** argv) {
    using namespace obscura;
    const scene::Scene scene = scene::load_scene(argc > 1 ? argv[1] : "/usr/share/obscura/scenes/demo.toml");
    renderer::RenderSettings settings;
    settings.samples_per_pixel = 1;
    const renderer::Renderer renderer(scene, settings);
    renderer::RenderRequest request;
    request.window = {0, 0, 640, 512};
    request.rows = 512;
    const std::vector<RowTime> times(512);
    request.row_times = times;
    std::vector<float> irradiance(renderer.band_count() * 640 * 512);
    if (!renderer.render(request, irradiance)) return 1;
    double sum = 0;
    for (const float value : irradiance)
        sum += value;
    std::printf("%.3e W/m2\n", sum);
    return sum > 0 ? 0 : 1;
}
