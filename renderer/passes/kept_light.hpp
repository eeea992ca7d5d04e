// SPDX-License-Identifier: Apache-2.0
// Kept light of a frame's windows and their motion since: what a ReprojectionSource holds.
#pragma once

#include "renderer/reprojection/kept_image.hpp"
#include "renderer/reprojection/kept_window.hpp"
#include "renderer/reprojection/motion_grid.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// See ReprojectionSource, which owns it. Thread-bound but for the passes; real-time safe after construction.
struct KeptLight {
    struct Window {
        KeptImage image;
        MotionGrid motion;
    };
    KeptLight(std::size_t width, std::size_t rows, std::size_t max_windows, std::size_t channels,
              std::size_t bodies)
        : channel_capacity(channels),
          images(width, rows, max_windows, channels, bodies),
          motions(width, rows, max_windows),
          windows(max_windows) {
        placed.reserve(max_windows);
        motion_jobs.reserve(rows / MotionGrid::cell_px + 3);
    }

    /// See ReprojectionSource::begin_frame().
    bool begin_frame(std::span<const KeptWindow> of) noexcept {
        kept_by = 0;
        placed.clear();
        images.clear();
        motions.clear();
        if (of.size() > windows.size()) return false;
        for (std::size_t w = 0; w < of.size(); ++w)
            if (Window& to = windows[w];
                !to.image.place(of[w], channel_capacity, images) || !to.motion.place(of[w], motions))
                return false;
        placed.assign(of.begin(), of.end());
        return true;
    }

    /// Windows of the frame begun last.
    [[nodiscard]] std::span<Window> placed_windows() noexcept {
        return std::span(windows).first(placed.size());
    }

    std::size_t channel_capacity;
    KeptMemory images;
    MotionGrid::Memory motions;
    std::vector<Window> windows;           ///< as many as are `placed`, and unused ones
    std::vector<KeptWindow> placed;        ///< see ReprojectionSource::windows()
    std::uint64_t kept_by = 0;             ///< number of the renderer of the light; 0: none yet
    std::vector<std::int32_t> motion_jobs; ///< rows of cells to be done
};

} // namespace obscura::renderer
