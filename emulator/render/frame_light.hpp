// SPDX-License-Identifier: Apache-2.0
// Render job of one frame: row blocks and row times.
#pragma once

#include "core/camera/frame.hpp"
#include "core/camera/frame_quality.hpp"
#include "core/camera/region.hpp"
#include "core/time.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace obscura::emulator {

class RenderFaults;

/// Rows of one window that are rendered together, with the halo that the detector needs.
struct RowBlock {
    std::size_t window = 0;
    std::int32_t first_row = 0, rows = 0; ///< rows of the composed image
    std::int32_t halo_above = 0, halo_below = 0, halo_left = 0, halo_right = 0;

    [[nodiscard]] bool operator==(const RowBlock&) const noexcept = default;
    /// Rows that are rendered.
    [[nodiscard]] std::int32_t lines() const noexcept { return halo_above + rows + halo_below; }
};

/// Everything that the irradiance of a frame depends on: equal frames have equal irradiance, byte for
/// byte, unless the scene takes poses from a stream. Copies allocate only if the target's vectors
/// lack capacity.
struct FrameLight {
    struct Window {
        Region sensor;            ///< in sensor pixels
        std::int32_t image_y = 0; ///< its first row in the composed image

        [[nodiscard]] bool operator==(const Window&) const noexcept = default;
    };

    const renderer::Renderer* renderer = nullptr;
    std::uint64_t frame_id = 0;
    bool live = false;       ///< poses come from a stream: what is rendered depends on when, too
    bool push_broom = false; ///< every row is the same row of the array at another time
    std::vector<Window> windows;
    std::vector<RowTime> rows; ///< of the composed image, in the time of the scene that is rendered
    std::vector<RowBlock> blocks;
    std::optional<Time> common_mid; ///< of `rows`
    /// Times of the pixels of each window, where they have their own; else empty.
    std::vector<renderer::PixelTimes> pixel_times;
    /// Levels of the groups of quality_group_rows rows (FrameQuality::group_rows_for()); empty: full.
    std::vector<QualityLevel> levels;
    renderer::ReprojectionSource* keep = nullptr; ///< keeps the light of the frame: see kept_window()
    /// Light of a frame that differs in its time or in poses only: source of the rows at the levels from
    /// reprojected on.
    renderer::ReprojectionSource* from = nullptr;

    RenderFaults* faults = nullptr; ///< notes what rendering throws; null: it is passed on

    // What decides about levels while a frame is rendered; its light depends on the levels alone.
    bool adapts = false;                       ///< rows have levels that keep them in time
    std::vector<Time> due;                     ///< of each block, planned time: by when its light is wanted
    std::int64_t period_ns = 0;                ///< from one trigger to the next, as expected; 0: not known
    std::int64_t from_plan_ns = unknown_clock; ///< scheduling clock minus planned time, as expected
    static constexpr std::int64_t unknown_clock = INT64_MAX;

    /// By how much all rows of this frame come later than those of `other`, ns, if the frames are equal
    /// otherwise.
    [[nodiscard]] std::optional<std::int64_t> later_than(const FrameLight& other) const noexcept;
    /// What is rendered of a window, halo included.
    [[nodiscard]] renderer::KeptWindow kept_window(std::size_t window) const noexcept;
    /// Middle of the exposure, half way between the first reset and the last read.
    [[nodiscard]] Time mid() const noexcept { return midpoint(rows.front().reset, rows.back().read); }
    [[nodiscard]] std::int32_t width(const RowBlock& block) const noexcept {
        return block.halo_left + windows[block.window].sensor.width + block.halo_right;
    }
    /// Floats of the irradiance of a block.
    [[nodiscard]] std::size_t floats(const RowBlock& block) const noexcept {
        return renderer->band_count() * static_cast<std::size_t>(block.lines()) *
               static_cast<std::size_t>(width(block));
    }
};

/// Times of the pixels of a plan's window, whose trigger is at the scene time `trigger`, by a clock that runs
/// at `rate`; none where rows have times.
[[nodiscard]] renderer::PixelTimes pixel_times_of(const sensors::ReadoutPlan& plan, std::size_t window,
                                                  Time trigger, double rate = 1) noexcept;

/// Renders blocks of a FrameLight. Thread-bound; real-time safe after construction.
class BlockRenderer {
public:
    /// For blocks of at most `lines` rows, halo included.
    explicit BlockRenderer(std::int32_t lines);

    /// Fills `light`, light.floats(block) floats: bands x lines x width. Returns false if `cancel` became
    /// true.
    [[nodiscard]] bool render(const FrameLight& light, const RowBlock& block, std::span<float> out,
                              const std::atomic<bool>* cancel) {
        return render(light, block, out, cancel, {});
    }
    /// Optional: render on the calling thread, and extra outputs.
    struct Extra {
        renderer::Workspace* alone = nullptr; ///< see renderer::RenderRequest::alone
        std::span<float> samples{};           ///< lines x width, see renderer::RenderRequest::samples
    };
    [[nodiscard]] bool render(const FrameLight& light, const RowBlock& block, std::span<float> out,
                              const std::atomic<bool>* cancel, const Extra& extra);
    /// Chooses the levels of the groups of rows from group `chosen` on that `block` needs, of a frame that is
    /// made of FrameLight::from: repeated where bodies have moved by no more than `tolerance_px`, reprojected
    /// where they have, full where the earlier frame cannot have them. `chosen` becomes the end of those
    /// groups. Returns as render().
    [[nodiscard]] bool choose_levels(FrameLight& light, const RowBlock& block, double tolerance_px,
                                     std::size_t& chosen, const std::atomic<bool>* cancel);

private:
    [[nodiscard]] renderer::RenderRequest request_for(const FrameLight& light, std::size_t window,
                                                      std::int32_t first_row, std::int32_t rows);

    std::vector<RowTime> times_;
    std::vector<QualityLevel> levels_;
    std::vector<float> row_px_, group_px_; ///< motion of rows and of groups
};

} // namespace obscura::emulator
