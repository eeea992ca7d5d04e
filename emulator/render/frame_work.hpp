// SPDX-License-Identifier: Apache-2.0
// What making one frame cost, by parts.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "renderer/render_work.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

namespace obscura::emulator {

/// Written by the threads that make the frame, before its last row is reported; read after that.
struct FrameWork {
    renderer::RenderWork render;       ///< of this frame
    std::int64_t detector_wait_ns = 0; ///< rendering waited for a buffer that the detector still used
    std::int64_t detector_ns = 0;      ///< the detector thread was at work
    /// Largest apparent motion from what was rendered ahead to what the frame should show: rows within the
    /// tolerance show it, others are reprojected.
    double ahead_error_px = 0;
    std::int64_t ahead_ns = 0; ///< rendering had ended this long before the trigger; 0: it had not
};

/// Sets what terrains and giant textures lacked in a frame, and what shapes of users left in doubt.
inline void set_lod_deficit(FrameQuality& quality, const renderer::RenderWork& work) noexcept {
    quality.lod_deficit_share = work.surface_hits > 0 ? static_cast<float>(work.surface_coarser[0]) /
                                                            static_cast<float>(work.surface_hits)
                                                      : 0;
    quality.lod_deficit_worst = 0;
    for (std::size_t k = 0; k < work.surface_coarser.size(); ++k)
        if (work.surface_coarser[k] > 0) quality.lod_deficit_worst = static_cast<float>(1U << k);
    const auto count = [](std::uint64_t n) {
        return static_cast<std::uint32_t>(
            std::min<std::uint64_t>(n, std::numeric_limits<std::uint32_t>::max()));
    };
    quality.tiles_missing = count(work.tiles_missed);
    quality.rays_doubtful = count(work.rays_doubtful);
}

/// Sets the levels of the groups of a frame of `height` rows, and what follows from them.
inline void describe_levels(FrameQuality& quality, std::span<const QualityLevel> levels,
                            std::int32_t height) noexcept {
    quality.group_rows = FrameQuality::group_rows_for(height);
    quality.groups = static_cast<std::uint32_t>(levels.size());
    quality.level_share.fill(0);
    quality.level_max = QualityLevel::full;
    quality.rows_degraded = quality.rows_reprojected = quality.rows_repeated = 0;
    std::int32_t first = 0;
    for (std::size_t g = 0; g < levels.size(); ++g, first += quality.group_rows) {
        const QualityLevel level = levels[g];
        const std::int32_t rows = std::min(quality.group_rows, height - first);
        quality.group_level[g] = level;
        quality.level_max = std::max(quality.level_max, level);
        quality.level_share[static_cast<std::size_t>(level)] +=
            static_cast<float>(rows) / static_cast<float>(height);
        if (level != QualityLevel::full) quality.rows_degraded += rows;
        if (level == QualityLevel::reprojected) quality.rows_reprojected += rows;
        if (level == QualityLevel::repeated) quality.rows_repeated += rows;
    }
}

/// What the chip and the acquisition say of a frame.
struct FrameFacts {
    std::uint32_t acquisition = 1;  ///< number of the acquisition, counted from 1
    std::int64_t min_period_ns = 0; ///< the chip takes the next frame no earlier after this one
};

/// Settings that decide what a frame costs; constant while the daemon runs.
struct RenderFacts {
    std::uint32_t samples_per_pixel = 0;
    double target_error = 0;
    std::uint32_t max_instants = 0;
    std::uint32_t threads = 0; ///< render threads
    std::uint32_t cores = 0;   ///< cores that rendering may use
};

} // namespace obscura::emulator
