// SPDX-License-Identifier: Apache-2.0
// Frames with levels, of the real renderer on a machine of known speed.
#pragma once

#include "emulator/render/adaptive_frame.hpp"
#include "emulator/render/kept_frames.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/machine_clock.hpp"
#include "tests/unit/renderer/support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

namespace obscura::test {

using namespace emulator;

inline constexpr std::int32_t size = 256, block_rows = 32;
inline constexpr std::size_t pixels = static_cast<std::size_t>(size) * size;
/// Electrons for a W/m2 and second that give the asteroid some 5,000 of them.
inline constexpr double electrons_per_j_m2 = 2e10;
inline constexpr sensors::PixelNoise noise{0, 8};

inline scene::Scene level_asteroid() {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 90, size);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 1, 5};
    return s;
}

inline renderer::RenderSettings settings_of(std::uint32_t threads) {
    renderer::RenderSettings settings{2, threads, 5};
    settings.target_error = 0.02;
    return settings;
}

struct Shot {
    std::vector<float> image;
    FrameQuality quality;
};

/// A render thread, the frame that it works on and the maker that takes its blocks, in one thread.
class Rig {
public:
    explicit Rig(const scene::Scene& scene, std::int64_t exposure_ns = 0, std::uint32_t threads = 1)
        : renderer(scene, settings_of(threads)),
          clock(renderer),
          alone(renderer, size, size),
          frame(
              renderer.band_count() * pixels, pixels, size, clock, [this] { take_what_is_due(); }, &alone),
          exposure_ns_(exposure_ns) {
        // The maker waits for the next deadline, too.
        clock.on_read = [this] { take_what_is_due(); };
        light.renderer = &renderer;
        light.windows = {{{0, 0, size, size}, 0}};
        expose_at(Time{});
        for (std::int32_t row = 0; row < size; row += block_rows)
            light.blocks.push_back({.first_row = row, .rows = block_rows});
    }
    /// From now on frames keep their light, and rows may be made of earlier ones.
    void keep_frames() {
        kept = KeptFrames(
            [this] { return std::make_unique<renderer::ReprojectionSource>(renderer, size, size); });
    }
    /// Middle of the exposure of the frames that follow.
    void expose_at(Time mid) {
        light.rows.assign(size, RowTime{mid - exposure_ns_ / 2, mid + exposure_ns_ / 2});
        light.common_mid = renderer::common_mid(light.rows);
    }

    /// The image without levels.
    std::vector<float> full(std::uint64_t id) {
        light.frame_id = id;
        light.levels.clear();
        light.keep = light.from = nullptr;
        return in_blocks();
    }
    /// The image with the levels of a record.
    std::vector<float> again(std::uint64_t id, const FrameQuality& quality) {
        light.frame_id = id;
        light.levels.assign(quality.group_level.begin(), quality.group_level.begin() + quality.groups);
        light.from = kept.earlier(light).light;
        light.keep = kept.begin(light);
        if (light.from != nullptr) light.from->begin_reprojection();
        std::vector<float> image = in_blocks();
        if (quality.level_max < QualityLevel::reprojected) kept.accept(light, 0);
        return image;
    }
    /// A frame whose first rows are due after `budget_ns`, the others in the course of another tenth of it.
    Shot shot(std::uint64_t id, std::int64_t budget_ns) {
        light.frame_id = id;
        light.levels.clear();
        light.adapts = true;
        light.due.clear();
        const Time begin = clock.now();
        for (std::size_t b = 0; b < light.blocks.size(); ++b)
            light.due.push_back(begin + budget_ns +
                                budget_ns / 10 * static_cast<std::int64_t>(b) /
                                    static_cast<std::int64_t>(light.blocks.size()));
        light.from_plan_ns = 0;
        light.period_ns = budget_ns;
        shot_.image.assign(pixels, -1.0F);
        REQUIRE(frame.begin(light, kept.earlier(light)));
        light.keep = kept.begin(light);
        frame.claim(0);
        taken_ = 0;
        const std::atomic<bool> cancel{false};
        REQUIRE(frame.render(controller, cancel));
        for (; taken_ < light.blocks.size(); ++taken_)
            take(taken_);
        shot_.quality = {};
        frame.describe(shot_.quality, {electrons_per_j_m2, 1, noise});
        if (frame.is_whole()) kept.accept(light, static_cast<double>(shot_.quality.error_rms));
        frame.try_last_resort();
        light.adapts = false;
        return shot_;
    }

    renderer::Renderer renderer;
    MachineClock clock;
    renderer::Workspace alone;
    AdaptiveFrame frame;
    QualityController controller;
    FrameLight light;
    KeptFrames kept;

private:
    std::vector<float> in_blocks() {
        std::vector<float> image(pixels);
        BlockRenderer blocks(block_rows);
        for (const RowBlock& block : light.blocks)
            REQUIRE(blocks.render(light, block, std::span(image).subspan(at(block), count(block)), nullptr));
        return image;
    }
    static std::size_t at(const RowBlock& block) { return static_cast<std::size_t>(block.first_row) * size; }
    static std::size_t count(const RowBlock& block) { return static_cast<std::size_t>(block.rows) * size; }
    void take(std::size_t index) {
        const RowBlock& block = light.blocks[index];
        frame.take(index, std::span(shot_.image).subspan(at(block), count(block)));
    }
    void take_what_is_due() {
        const Time now = clock.now(); // takes some, too
        for (; taken_ < light.blocks.size(); ++taken_) {
            const bool due = now >= light.due[taken_] && frame.block_lit(taken_);
            const bool last_resort = !frame.block_lit(taken_) && now >= frame.last_resort_due(taken_);
            if (!due && !last_resort && !frame.block_final(taken_)) return;
            if (last_resort) frame.take_earlier(taken_);
            take(taken_);
        }
    }

    std::int64_t exposure_ns_;
    Shot shot_;
    std::size_t taken_ = SIZE_MAX;
};

} // namespace obscura::test
