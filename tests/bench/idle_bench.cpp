// SPDX-License-Identifier: Apache-2.0
// Frames of the real-time scene without levels and at full level, for counting what the levels cost when they
// are not needed. Usage: idle_bench hold|adapt FRAMES; tests/bench/idle_cost.py counts its instructions.
#include "core/clock.hpp"
#include "emulator/render/adaptive_frame.hpp"
#include "renderer/scene_files/scene_file.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>

using namespace obscura;
using namespace obscura::emulator;

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: idle_bench hold|adapt FRAMES\n");
        return 64;
    }
    const bool adapts = std::strcmp(argv[1], "adapt") == 0;
    renderer::RenderSettings settings{2, 1, 1};
    settings.target_error = 0.02;
    const renderer::Renderer renderer(scene::load_scene(OBSCURA_SOURCE_DIR "/config/scenes/realtime.toml"),
                                      settings);
    const std::int32_t size = 1024;
    FrameLight light;
    light.renderer = &renderer;
    light.windows = {{{0, 0, size, size}, 0}};
    light.rows.assign(size, RowTime{});
    light.common_mid = renderer::common_mid(light.rows);
    const std::int32_t rows = adapts ? 64 : size;
    for (std::int32_t row = 0; row < size; row += rows)
        light.blocks.push_back({.first_row = row, .rows = rows});
    const FakeClock clock; // never moves: there is time for everything
    light.adapts = adapts;
    light.due.assign(light.blocks.size(), Time{ns_per_s});
    light.period_ns = ns_per_s;
    light.from_plan_ns = 0;

    const std::size_t pixels = static_cast<std::size_t>(size) * size;
    std::vector<float> image(renderer.band_count() * pixels);
    BlockRenderer blocks(size);
    AdaptiveFrame frame(image.size(), pixels, size, clock, [] {});
    QualityController controller;
    const std::atomic<bool> cancel{false};
    double sum = 0;
    for (int f = 1; f <= std::atoi(argv[2]); ++f) {
        light.frame_id = static_cast<std::uint64_t>(f);
        if (!adapts) {
            static_cast<void>(blocks.render(light, light.blocks[0], image, nullptr));
        } else {
            static_cast<void>(frame.begin(light));
            frame.claim(0);
            static_cast<void>(frame.render(controller, cancel));
            for (std::size_t b = 0; b < light.blocks.size(); ++b)
                frame.take(b, std::span(image).subspan(b * 64 * size * renderer.band_count(),
                                                       light.floats(light.blocks[b])));
            FrameQuality quality;
            frame.describe(quality, {1e10, 0.005, {5, 8}});
            sum += static_cast<double>(quality.level_share[0]);
        }
    }
    std::printf("%d frames, %.0f at full level\n", std::atoi(argv[2]), adapts ? sum : std::atof(argv[2]));
    return 0;
}
