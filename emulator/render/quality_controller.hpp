// SPDX-License-Identifier: Apache-2.0
// Quality controller: at which level each part of a frame is rendered, so that every row is there in time.
#pragma once

#include "core/camera/frame_quality.hpp"
#include "core/time.hpp"

#include <array>
#include <cstdint>

namespace obscura::emulator {

/// The frame that a QualityController works on, by groups of rows.
class LevelWork {
public:
    virtual ~LevelWork() = default;
    [[nodiscard]] virtual Time now() const noexcept = 0;
    /// By when a group must be there; never_due: not known yet.
    [[nodiscard]] virtual Time due(std::int32_t group) const noexcept = 0;
    /// Renders groups at a level, those whose time is over excepted. Returns false if the frame was
    /// cancelled.
    virtual bool render(QualityLevel level, std::int32_t first_group, std::int32_t groups) noexcept = 0;
    /// Whether a group has light of the optional part.
    [[nodiscard]] virtual bool improved(std::int32_t group) const noexcept = 0;
    [[nodiscard]] virtual bool has_level(QualityLevel level) const noexcept = 0;
    /// Share of a group's pixels that are lit; negative: it has no light yet.
    [[nodiscard]] virtual double lit_share(std::int32_t group) const noexcept = 0;
    /// Square of the error of groups at a level, over that of their light: of QualityLevel::sixteenth and
    /// QualityLevel::quarter once they have it, of QualityLevel::reprojected as expected. Negative: not
    /// known, or they cannot have it.
    [[nodiscard]] virtual double error2(QualityLevel level, std::int32_t first_group,
                                        std::int32_t groups) const noexcept = 0;
    /// Work done so far, in any unit: tells groups that cost more from time that others took.
    [[nodiscard]] virtual std::uint64_t work_done() const noexcept = 0;
};
constexpr Time never_due{INT64_MAX};

/// Imprecise computation with a mandatory and an optional part (Liu et al., Computer 24(5), 1991). The
/// mandatory part is a sparse grid over the whole frame, made first; where so much time is left that it would
/// still be in time after a stall, full rendering begins without it, from the top down, and the sparse grid
/// follows for what remains as soon as the time runs short. The levels of the optional part come from the
/// measured cost of each, by the elapsed time, so that they follow the load of the machine; how it is spread
/// over the groups comes from their lit pixels, as of the frame's own sparse grid. Groups for which no more
/// than a grid sparser than the pixels is left are reprojected instead if that is expected to err by less;
/// this is biased, and begins every bias_period_ns at most. Thread-bound; real-time safe.
class QualityController {
public:
    /// From one begin of a series of biased frames to the next.
    static constexpr std::int64_t bias_period_ns = 4'000'000'000;

    QualityController() noexcept {
        lit_share_.fill(1);
        density_.fill(1);
    }

    struct Frame {
        std::int32_t groups = 0;
        std::int64_t period_ns = 0; ///< from one trigger to the next; 0: not known
        std::int32_t slab = 8;      ///< groups that are rendered at a time
    };
    /// What became of a frame.
    struct Outcome {
        std::uint32_t reasons = 0; ///< QualityReason
        Time begin, end;
        bool complete = false; ///< false: the frame was cancelled
    };
    /// Before the first frame: what a frame of so many groups takes at full quality on this machine.
    void expect_frame_time(std::int64_t frame_ns, std::int32_t groups) noexcept;
    /// Renders a frame.
    Outcome run(LevelWork& work, const Frame& frame) noexcept;
    /// Expected time of groups at a level, by the elapsed time; 0: nothing is known.
    [[nodiscard]] double cost_ns(QualityLevel level, std::int32_t first, std::int32_t groups) const noexcept;

private:
    bool render(LevelWork& work, QualityLevel level, std::int32_t first, std::int32_t groups) noexcept;
    void learn(QualityLevel level, std::int32_t first, std::int32_t groups, std::int64_t elapsed_ns,
               bool stall) noexcept;
    [[nodiscard]] bool was_stall(QualityLevel level, double expected_ns, std::int64_t elapsed_ns,
                                 std::uint64_t work) noexcept;
    [[nodiscard]] bool short_of_time(const LevelWork& work, const Frame& frame, std::int32_t group,
                                     std::int32_t slab) const noexcept;
    [[nodiscard]] QualityLevel choose(const LevelWork& work, const Frame& frame, Time begin,
                                      std::int32_t group, std::int32_t slab) const noexcept;

    [[nodiscard]] bool moves(const LevelWork& work, QualityLevel instead_of, std::int32_t group,
                             std::int32_t slab) const noexcept;

    /// Expected time of a group that is lit all over.
    std::array<double, quality_level_count> level_ns_{};
    /// Share of a group's pixels that were lit when last seen, and what they cost over that of others.
    std::array<double, max_quality_groups> lit_share_{}, density_{};
    std::array<double, quality_level_count> work_ns_{}; ///< of a unit of LevelWork::work_done(), by level
    std::array<bool, quality_level_count> measured_{};  ///< levels rendered in this frame
    bool stalled_ = false;                              ///< in this frame
    bool known_ = false;
    double sixteenth_error2_ = -1; ///< LevelWork::error2(), mean over the frames so far; negative: not known
    bool may_move_ = false;        ///< in this frame
    bool moved_ = false;           ///< some group of the last frame was
    bool ever_moved_ = false;
    Time moving_since_{}; ///< begin of the last series of such frames
};

} // namespace obscura::emulator
