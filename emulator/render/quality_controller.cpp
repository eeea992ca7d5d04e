// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/quality_controller.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

/// Cost of the levels before they are known, over that of full rendering (the real-time scene of
/// config/realtime.toml).
constexpr std::array<double, quality_level_count> relative_cost{1, 0.9, 0.7, 0.7, 0.6, 0.2, 0.08, 0.08, 0, 0};

/// Powers of a measurement over its expectation by which the expectations follow: of the level measured, if
/// it took longer and if it did not; of the other levels, because the load has changed; and of the groups
/// measured over the others. After a stall all follow as the other levels do.
constexpr double longer_weight = 0.7;
constexpr double level_weight = 0.4;
constexpr double load_weight = 0.15;
constexpr double group_weight = 0.15;

/// The expected cost of levels that a frame does without falls by this factor: they are tried again now and
/// then, else nothing would correct an expectation that is too high.
constexpr double hope = 0.99;

/// A dark group costs as much as one of which this share is lit.
constexpr double dark_share = 0.02;

/// Expected times are multiplied by this.
constexpr double caution = 1.15;

/// Rendering stalled if it took more than so many times as long as expected, both by the groups and by their
/// work, and at least so much longer.
constexpr double stall_factor = 2;
constexpr double min_stall_ns = 1e6;

/// Share of the period for which rendering may stall before the sparse grid is late.
constexpr double stall_share = 0.2;

/// Share of the period that a frame may take beyond its first deadline: frames that are late catch up.
constexpr double fair_share = 0.9;

/// Square of the error of QualityLevel::quarter over that of QualityLevel::sixteenth: light with edges errs
/// with the root of the distance between the points (3.0 and 1.25 % on an asteroid).
constexpr double quarter_error2 = 0.2;

/// Weight of an error that was seen over what is known from before.
constexpr double error_weight = 0.2;

/// Levels of the optional part, best first. Those with fewer reflections are biased and are not chosen.
constexpr std::array optional_levels{QualityLevel::full, QualityLevel::goal, QualityLevel::instants,
                                     QualityLevel::grid, QualityLevel::quarter};

std::int64_t whole_number(double ns) {
    return static_cast<std::int64_t>(ns);
}

} // namespace

double QualityController::cost_ns(QualityLevel level, std::int32_t first,
                                  std::int32_t groups) const noexcept {
    double lit = 0;
    for (auto g = static_cast<std::size_t>(first); g < static_cast<std::size_t>(first + groups); ++g)
        lit += lit_share_[g] * density_[g];
    return lit * level_ns_[static_cast<std::size_t>(level)];
}

void QualityController::expect_frame_time(std::int64_t frame_ns, std::int32_t groups) noexcept {
    level_ns_ = relative_cost;
    for (double& ns : level_ns_)
        ns *= std::max(1.0, static_cast<double>(frame_ns)) / groups;
    known_ = true;
}

void QualityController::learn(QualityLevel level, std::int32_t first, std::int32_t groups,
                              std::int64_t elapsed_ns, bool stall) noexcept {
    const auto own = static_cast<std::size_t>(level);
    const double seen_ns = std::max(1.0, static_cast<double>(elapsed_ns));
    measured_[own] = true;
    if (!known_) {
        level_ns_ = relative_cost;
        const double scale = seen_ns / cost_ns(level, first, groups);
        for (double& ns : level_ns_)
            ns *= scale;
        known_ = true;
        return;
    }
    const double change = std::clamp(seen_ns / cost_ns(level, first, groups), 0.1, 10.0);
    const double own_weight = stall ? load_weight : change > 1 ? longer_weight : level_weight;
    for (std::size_t l = 0; l < level_ns_.size(); ++l)
        level_ns_[l] *= std::pow(change, l == own ? own_weight : load_weight);
    // A stall says nothing of these groups, nor do levels whose cost does not depend on what pixels show.
    if (stall || level == QualityLevel::sixteenth || level == QualityLevel::reprojected) return;
    for (auto g = static_cast<std::size_t>(first); g < static_cast<std::size_t>(first + groups); ++g)
        density_[g] = std::clamp(density_[g] * std::pow(change, group_weight), 0.1, 10.0);
}

bool QualityController::render(LevelWork& work, QualityLevel level, std::int32_t first,
                               std::int32_t groups) noexcept {
    const Time begin = work.now();
    const std::uint64_t work_before = work.work_done();
    const double expected_ns = known_ ? cost_ns(level, first, groups) : 0;
    if (!work.render(level, first, groups)) return false;
    const std::int64_t elapsed_ns = work.now() - begin;
    for (std::int32_t g = first; g < first + groups; ++g)
        if (const double share = work.lit_share(g); share >= 0)
            lit_share_[static_cast<std::size_t>(g)] = std::max(dark_share, share);
    const bool stall = was_stall(level, expected_ns, elapsed_ns, work.work_done() - work_before);
    stalled_ = stalled_ || stall;
    if (const double error2 = work.error2(level, first, groups);
        error2 >= 0 && (level == QualityLevel::sixteenth || level == QualityLevel::quarter)) {
        const double seen = level == QualityLevel::quarter ? error2 / quarter_error2 : error2;
        sixteenth_error2_ += (sixteenth_error2_ < 0 ? 1 : error_weight) * (seen - sixteenth_error2_);
    }
    learn(level, first, groups, elapsed_ns, stall);
    return true;
}

/// A body that comes into view costs more, and has more work: no stall.
bool QualityController::was_stall(QualityLevel level, double expected_ns, std::int64_t elapsed_ns,
                                  std::uint64_t work) noexcept {
    if (work == 0) return false;
    double& work_ns = work_ns_[static_cast<std::size_t>(level)];
    const auto seen_ns = static_cast<double>(elapsed_ns);
    const double by_work_ns = work_ns * static_cast<double>(work);
    const double max_expected_ns = std::max(expected_ns, by_work_ns);
    const double change = by_work_ns > 0 ? std::clamp(seen_ns / by_work_ns, 0.1, 10.0) : 1;
    work_ns = by_work_ns > 0 ? work_ns * std::pow(change, level_weight) : seen_ns / static_cast<double>(work);
    return by_work_ns > 0 &&
           seen_ns > std::max(stall_factor * max_expected_ns, max_expected_ns + min_stall_ns);
}

bool QualityController::short_of_time(const LevelWork& work, const Frame& frame, std::int32_t group,
                                      std::int32_t slab) const noexcept {
    const Time due = work.due(group);
    if (due == never_due) return false;
    if (!known_) return true;
    const double needed_ns = caution * (cost_ns(QualityLevel::full, group, slab) +
                                        cost_ns(QualityLevel::sixteenth, group, frame.groups - group)) +
                             stall_share * static_cast<double>(frame.period_ns);
    return work.now() + whole_number(needed_ns) > due;
}

QualityLevel QualityController::choose(const LevelWork& work, const Frame& frame, Time begin,
                                       std::int32_t group, std::int32_t slab) const noexcept {
    const Time due = work.due(group);
    if (due == never_due || !known_) return QualityLevel::full;
    Time end = work.due(frame.groups - 1);
    if (frame.period_ns > 0)
        end =
            std::min(end, std::max(work.due(0),
                                   begin + whole_number(fair_share * static_cast<double>(frame.period_ns))));
    const Time now = work.now();
    for (const QualityLevel level : optional_levels) {
        if (!work.has_level(level)) continue;
        if (now + whole_number(caution * cost_ns(level, group, slab)) <= due &&
            now + whole_number(caution * cost_ns(level, group, frame.groups - group)) <= end)
            return moves(work, level, group, slab) ? QualityLevel::reprojected : level;
    }
    const Time moved = now + whole_number(caution * cost_ns(QualityLevel::reprojected, group, slab));
    return moved <= due && moves(work, QualityLevel::sixteenth, group, slab) ? QualityLevel::reprojected
                                                                             : QualityLevel::sixteenth;
}

/// Whether groups are reprojected instead of rendered at a level.
bool QualityController::moves(const LevelWork& work, QualityLevel instead_of, std::int32_t group,
                              std::int32_t slab) const noexcept {
    if (!may_move_ || instead_of < QualityLevel::quarter) return false;
    const double moved2 = work.error2(QualityLevel::reprojected, group, slab);
    double sparse2 = work.error2(QualityLevel::sixteenth, group, slab);
    if (sparse2 < 0) sparse2 = sixteenth_error2_;
    if (moved2 < 0 || sparse2 < 0) return false;
    return moved2 < (instead_of == QualityLevel::quarter ? quarter_error2 : 1) * sparse2;
}

QualityController::Outcome QualityController::run(LevelWork& work, const Frame& frame) noexcept {
    Outcome outcome;
    outcome.begin = work.now();
    stalled_ = false;
    measured_ = {};
    if (!known_) outcome.reasons |= quality_unknown_scene;
    may_move_ = moved_ || !ever_moved_ || outcome.begin - moving_since_ >= bias_period_ns;
    bool sparse = false, moved = false;
    for (std::int32_t group = 0; group < frame.groups;) {
        const std::int32_t slab = std::min(frame.slab, frame.groups - group);
        if (!sparse && short_of_time(work, frame, group, slab)) {
            if (!render(work, QualityLevel::sixteenth, group, frame.groups - group)) return outcome;
            sparse = true;
        }
        QualityLevel level = choose(work, frame, outcome.begin, group, slab);
        if (level >= QualityLevel::sixteenth && !sparse) {
            if (!render(work, QualityLevel::sixteenth, group, frame.groups - group)) return outcome;
            sparse = true;
            level = choose(work, frame, outcome.begin, group, slab);
        }
        if (level != QualityLevel::full) outcome.reasons |= quality_budget | quality_predicted;
        if (level != QualityLevel::sixteenth && !render(work, level, group, slab)) return outcome;
        moved = moved || level == QualityLevel::reprojected;
        // The trigger came while its edge was not expected yet: begin with the mandatory part after all.
        bool cut = false;
        for (std::int32_t g = group; g < group + slab; ++g)
            cut = cut || !work.improved(g);
        if (cut && !sparse) {
            if (!render(work, QualityLevel::sixteenth, group, frame.groups - group)) return outcome;
            sparse = true;
            continue;
        }
        if (cut) outcome.reasons |= quality_budget;
        group += slab;
    }
    if (outcome.reasons != 0)
        for (std::size_t l = 0; l < level_ns_.size(); ++l)
            if (!measured_[l]) level_ns_[l] *= hope;
    if (moved && !moved_) moving_since_ = outcome.begin;
    ever_moved_ = ever_moved_ || moved;
    moved_ = moved;
    if (stalled_) outcome.reasons |= quality_stall;
    outcome.end = work.now();
    outcome.complete = true;
    return outcome;
}

} // namespace obscura::emulator
