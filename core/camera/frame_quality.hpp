// SPDX-License-Identifier: Apache-2.0
// Quality record of a frame: how good its light is, and why it is no better.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace obscura {

/// How well the light of a group of rows was rendered. The light depends on the level, not on when it was
/// reached (renderer/renderer.hpp). Stars and bodies smaller than pixels are complete at every level that
/// renders.
enum class QualityLevel : std::uint8_t {
    full,        ///< as the settings ask
    goal,        ///< fewer samples: the target error is not reached
    instants,    ///< those, at fewer instants of the exposure
    bounces,     ///< those, with fewer reflections; biased
    grid,        ///< one ray for each pixel
    quarter,     ///< one ray for 4 pixels, interpolated
    sixteenth,   ///< one ray for 16 pixels, interpolated
    reprojected, ///< an earlier frame, moved to where things are now; biased
    repeated,    ///< an earlier frame; biased
    missing,     ///< not rendered in time: the late policy decides
};
constexpr std::size_t quality_level_count = 10;
constexpr auto enum_names(QualityLevel /*type*/) {
    return std::array{
        EnumName{QualityLevel::full, "full"},           EnumName{QualityLevel::goal, "goal"},
        EnumName{QualityLevel::instants, "instants"},   EnumName{QualityLevel::bounces, "bounces"},
        EnumName{QualityLevel::grid, "grid"},           EnumName{QualityLevel::quarter, "quarter"},
        EnumName{QualityLevel::sixteenth, "sixteenth"}, EnumName{QualityLevel::reprojected, "reprojected"},
        EnumName{QualityLevel::repeated, "repeated"},   EnumName{QualityLevel::missing, "missing"}};
}

/// Whether the mean over many frames of that level differs from that of full ones.
[[nodiscard]] constexpr bool is_biased(QualityLevel level) noexcept {
    return level == QualityLevel::bounces || level == QualityLevel::reprojected ||
           level == QualityLevel::repeated;
}

/// Why a frame is not full, as bits.
enum QualityReason : std::uint32_t {
    quality_budget = 1U << 0,     ///< the time until the rows' deadlines was too short for full rendering
    quality_stall = 1U << 1,      ///< other programs took the cores: elapsed time far above that of the work
    quality_predicted = 1U << 2,  ///< a lower level was begun with because the cost of a better one was known
    quality_page_fault = 1U << 3, ///< rendering waited for memory from disk
    quality_unknown_scene = 1U << 4, ///< nothing was known of this scene's cost
};

/// Groups of rows that a record has a level for.
constexpr std::size_t max_quality_groups = 256;
/// Rows of a group, unless the frame has more than max_quality_groups of them.
constexpr std::int32_t quality_group_rows = 16;

/// Quality of one frame. Part of FrameInfo; final before the last row is published. The fields from
/// `lod_deficit_share` on are filled from the work of the renderer (RenderWork), all others by the thread
/// that makes the frame (emulator/camera/frame_maker.hpp). Errors are those of rendering only, without the
/// detector's noise; 0: not known, or none.
struct FrameQuality {
    QualityLevel level_max = QualityLevel::full;           ///< worst of all groups
    std::array<float, quality_level_count> level_share{1}; ///< of the rows, by level
    std::uint32_t reasons = 0;                             ///< QualityReason
    float error_rms = 0;         ///< over the lit pixels, over their root mean square
    float error_worst_group = 0; ///< largest of a group of rows, of the same unit
    float error_goal = 0;        ///< that the settings ask of each pixel; 0: none
    float noise_ratio_p95 = 0;   ///< error over the detector's noise, 95th percentile of the lit groups
    float unknown_share = 0;     ///< of the lit pixels, without an estimate
    float samples_mean = 0, samples_median = 0, samples_min = 0; ///< rays per lit pixel
    std::uint32_t bounces = 0, bounces_asked = 0; ///< reflections after the first, least of all groups
    std::uint32_t instants = 0; ///< of the exposure at which the row with the fewest was sampled
    std::int32_t rows_degraded = 0, rows_reprojected = 0, rows_repeated = 0;
    /// Rendering: from its begin to the last deadline, time that it took, and from the end of a group to its
    /// deadline, of the group where that was least.
    std::int64_t budget_us = 0, spent_us = 0, margin_us = 0;
    std::int32_t group_rows = quality_group_rows;
    std::uint32_t groups = 0; ///< 0: the frame was rendered without levels, all of it full
    std::array<QualityLevel, max_quality_groups> group_level{};

    float lod_deficit_share = 0;     ///< of the hits on terrains, on cells wider than asked for
    float lod_deficit_worst = 0;     ///< factor by which the widest of those is wider, at least; 0: none
    std::uint32_t tiles_missing = 0; ///< look-ups of tiles that were not there
    std::uint32_t rays_doubtful =
        0; ///< to shapes of users: what they hit, or that they hit nothing, is not sure

    /// Rows of each group for an image of `height` rows.
    [[nodiscard]] static constexpr std::int32_t group_rows_for(std::int32_t height) noexcept {
        std::int32_t rows = quality_group_rows;
        while ((height + rows - 1) / rows > static_cast<std::int32_t>(max_quality_groups))
            rows *= 2;
        return rows;
    }
    [[nodiscard]] constexpr QualityLevel level_of_row(std::int32_t row) const noexcept {
        return groups == 0 ? QualityLevel::full : group_level[static_cast<std::size_t>(row / group_rows)];
    }
};

} // namespace obscura
