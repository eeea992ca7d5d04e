// SPDX-License-Identifier: Apache-2.0
// Light of one frame at levels that keep its rows in time.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "core/time.hpp"
#include "emulator/render/frame_light.hpp"
#include "emulator/render/kept_frames.hpp"
#include "emulator/render/quality_controller.hpp"
#include "renderer/render_work.hpp"
#include "renderer/renderer.hpp"
#include "sensors/pixel_noise.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace obscura {
class Clock;
}

namespace obscura::emulator {

/// What the light of a frame becomes, for the record of its quality.
struct LightUse {
    double electrons_per_s_per_w_m2 = 0; ///< sum over the spectral bands
    double exposure_s = 0;
    sensors::PixelNoise noise{};
};

/// Store for a frame of one window whose groups of rows have levels. A render thread fills it by a
/// QualityController; the thread that makes the frame takes its blocks. At its deadline a block is taken at
/// the best quality reached; work on its groups stops. Every pixel is that of its group's level, whenever it
/// was rendered. Groups without any light at their deadline are made from an earlier frame by the thread that
/// takes them, reprojected or, if even that is too late, repeated. Real-time safe after construction; a
/// function says which thread calls it.
class AdaptiveFrame final : private LevelWork, private renderer::RowGate {
public:
    /// For areas of at most `floats` of irradiance and `pixels` pixels, in `rows` rows. `changed` is called
    /// when groups have got light; on render threads. `alone`: memory of the maker, with which it makes
    /// groups from an earlier frame; null: it makes none.
    AdaptiveFrame(std::size_t floats, std::size_t pixels, std::size_t rows, const Clock& clock,
                  std::function<void()> changed, renderer::Workspace* alone = nullptr);

    /// Maker, before the work on the frame begins: whether its rows can have levels: one window, for which
    /// there is room. `earlier`: frame that rows can be made of.
    [[nodiscard]] bool begin(const FrameLight& light, const KeptFrames::Earlier& earlier = {}) noexcept;
    /// Maker: the trigger has come, rows are due at the planned times plus `from_plan_ns`.
    void claim(std::int64_t from_plan_ns) noexcept {
        from_plan_ns_ = from_plan_ns;
        claimed_ = true;
    }
    /// Render thread: renders the frame. False if `cancel` became true.
    [[nodiscard]] bool render(QualityController& controller, const std::atomic<bool>& cancel) noexcept;
    /// Maker: whether render() has ended.
    [[nodiscard]] bool rendered() const noexcept { return rendered_.load(std::memory_order_acquire); }

    /// Maker: whether all blocks have been taken, and none was made from the earlier frame for it.
    [[nodiscard]] bool all_taken() const noexcept;
    /// Maker, when render() has ended: whether all its rows were rendered, at the levels of its record.
    [[nodiscard]] bool is_whole() const noexcept;

    /// Maker: by when block `index` is wanted.
    [[nodiscard]] Time block_due(std::size_t index) const noexcept;
    /// Maker: whether block `index` is as good as it will get, or as good as it can be now; false while it
    /// has no light.
    [[nodiscard]] bool block_final(std::size_t index) const noexcept;
    [[nodiscard]] bool block_lit(std::size_t index) const noexcept;
    /// Maker: by when making block `index` from the earlier frame must begin, so that it and all that follow
    /// are in time; never_due: there is none.
    [[nodiscard]] Time last_resort_due(std::size_t index) const noexcept;
    /// Maker: makes the groups of block `index` that have no light from the earlier frame.
    void take_earlier(std::size_t index) noexcept;
    /// Maker, once all blocks have been taken: tries how long that takes, unless it is known.
    void try_last_resort() noexcept;
    /// Maker: settles the levels of the groups of block `index`: work on them ends.
    void settle(std::size_t index) noexcept;
    /// Maker: copies the light of block `index` and settles the levels of its groups.
    void take(std::size_t index, std::span<float> out) noexcept;
    /// Maker, when all blocks have been taken: the quality of the frame, without what the terrains lack.
    void describe(FrameQuality& quality, const LightUse& use) const noexcept;

private:
    /// Sums over the lit pixels of a row; their light is the mean of the bands.
    struct RowSums {
        double light = 0, light2 = 0, variance = 0, samples = 0;
        std::int32_t lit = 0, unknown = 0;
        float min_samples = 0;
        std::uint32_t instants = 0;
        bool full = false; ///< whatever the level
    };
    struct Group {
        std::int32_t first_row = 0, rows = 0; ///< of the area
        std::atomic<std::int32_t> rows_done{0};
        std::atomic<bool> sparse{false};  ///< has light of the mandatory part
        std::atomic<bool> better{false};  ///< has light of the optional part
        std::atomic<bool> settled{false}; ///< its level is final
        bool optional_begun = false;
        QualityLevel level = QualityLevel::missing; ///< of the optional part, where there is light of it
        std::array<Time, 3> ended{}; ///< when the mandatory and the optional part had been rendered
    };

    // LevelWork, on the render thread.
    [[nodiscard]] Time now() const noexcept override;
    [[nodiscard]] Time due(std::int32_t group) const noexcept override;
    bool render(QualityLevel level, std::int32_t first_group, std::int32_t groups) noexcept override;
    [[nodiscard]] bool improved(std::int32_t group) const noexcept override {
        const Group& g = groups_[static_cast<std::size_t>(group)];
        return g.better.load(std::memory_order_acquire) || g.settled.load(std::memory_order_acquire);
    }
    [[nodiscard]] bool has_level(QualityLevel level) const noexcept override {
        return light_->renderer->has_level(level);
    }
    [[nodiscard]] double error2(QualityLevel level, std::int32_t first_group,
                                std::int32_t groups) const noexcept override;
    // RowGate, on render threads.
    bool wants(std::int32_t r) noexcept override;
    void done(std::int32_t r, const renderer::RenderedRow& how) noexcept override;
    [[nodiscard]] double lit_share(std::int32_t group) const noexcept override;
    [[nodiscard]] std::uint64_t work_done() const noexcept override {
        return light_->renderer->rays_traced() + light_->renderer->samples_taken();
    }

    /// Request for rows of the area, without the outputs of their quality.
    [[nodiscard]] renderer::RenderRequest request_for(std::int32_t first_row, std::int32_t rows,
                                                      std::span<const QualityLevel> levels) const noexcept;
    /// Sums of a row of a part.
    void sum_row(std::size_t part, std::int32_t row, const renderer::RenderedRow& how) noexcept;
    void make_earlier(const Group& group, QualityLevel level) noexcept;
    /// What is known of the error of rows that were reprojected just now, beyond that of the earlier frame.
    void learn_moved_error(std::size_t part, std::int32_t first_row, std::int32_t rows) noexcept;
    /// Thread that makes rows from the earlier frame: one only, since the motion field is shared.
    enum class Mover : std::uint8_t { none, maker, render_thread };
    [[nodiscard]] bool becomes_mover(Mover who) noexcept;
    /// Keeps the light of the mandatory part of groups whose optional part was begun in vain.
    void keep_settled() noexcept;
    [[nodiscard]] std::uint32_t reasons() const noexcept;
    [[nodiscard]] bool same_as_full(const Group& group, std::size_t part) const noexcept;
    [[nodiscard]] std::size_t group_of(std::int32_t area_row) const noexcept;
    [[nodiscard]] std::pair<std::size_t, std::size_t> groups_of_block(std::size_t index) const noexcept;

    const Clock& clock_;
    std::function<void()> changed_;
    const FrameLight* light_ = nullptr;
    renderer::FrameSamples samples_kept_;
    /// Bands x rows, of the mandatory and of the optional part, and of what is made from the earlier frame.
    std::array<std::vector<float>, 3> floats_;
    /// Buffers of the first two parts, one of which is being rendered, and of the third.
    std::array<std::vector<float>, 2> variance_, samples_;
    std::array<std::vector<RowSums>, 3> sums_; ///< by row of the area
    std::vector<RowTime> times_;               ///< by row of the area
    std::vector<QualityLevel> levels_;         ///< by row of the area, of the part that is being rendered
    std::array<Group, max_quality_groups> groups_;
    std::array<QualityLevel, max_quality_groups> settled_{}; ///< levels of the settled groups
    std::array<std::size_t, max_quality_groups> part_of_{};  ///< which their light is from
    std::int32_t group_count_ = 0, group_rows_ = quality_group_rows;
    std::int32_t area_rows_ = 0, area_width_ = 0, halo_above_ = 0;

    // The part that is being rendered.
    bool optional_ = false;
    QualityLevel level_ = QualityLevel::full;
    bool cut_when_due_ = false;  ///< it ends when the trigger comes, since it was not expected
    std::int32_t first_row_ = 0; ///< of the request, in the area
    bool sparse_begun_ = false;  ///< of the frame
    const std::atomic<bool>* cancel_ = nullptr;

    // Maker's.
    renderer::Workspace* const alone_;
    KeptFrames::Earlier earlier_;
    std::vector<QualityLevel> earlier_levels_; ///< by row of a group
    double earlier_row_ns_ = 0;                ///< time that a reprojected row takes; 0: not known
    bool used_earlier_ = false;                ///< in this frame

    std::atomic<Mover> mover_{Mover::none};
    /// Squared error of reprojected rows beyond that of the earlier frame, over the squared light, and how
    /// old that frame was; negative: not known.
    std::atomic<double> moved_error2_{-1}, moved_age_ns_{0};

    std::atomic<std::int64_t> from_plan_ns_{FrameLight::unknown_clock};
    std::atomic<bool> claimed_{false};
    QualityController::Outcome outcome_;
    Time begin_;                       ///< of render()
    renderer::RenderWork work_before_; ///< of the renderer
    renderer::RenderWork work_;        ///< of the frame, once rendered
    std::atomic<bool> rendered_{false};
};

} // namespace obscura::emulator
