// SPDX-License-Identifier: Apache-2.0
#include "emulator/quality_controller.hpp"

#include <algorithm>

namespace obscura::emulator {
namespace {

/// Cost of the levels before they are known, over that of full rendering (the real-time scene of
/// config/realtime.toml).
constexpr std::array<double, quality_level_count> relative_cost{1, 0.9, 0.7, 0.7, 0.6, 0.2, 0.08, 0, 0, 0};

/// Weight of a new measurement of a level, and of one of another level, by the ratio of the above.
constexpr double own_weight = 0.3;
constexpr double other_weight = 0.05;

/// Expected times are multiplied by this.
constexpr double caution = 1.15;

/// Share of the period for which rendering may stall before the sparse grid is late.
constexpr double stall_share = 0.2;

/// Share of the period that a frame may take beyond its first deadline: frames that are late catch up.
constexpr double fair_share = 0.9;

/// Levels of the optional part, best first. Those with fewer reflections are biased and are not chosen.
constexpr std::array optional_levels{QualityLevel::full, QualityLevel::goal, QualityLevel::instants,
                                     QualityLevel::grid, QualityLevel::quarter};

std::int64_t whole(double ns) {
    return static_cast<std::int64_t>(ns);
}

} // namespace

void QualityController::learn(QualityLevel level, std::int32_t groups, std::int64_t elapsed_ns) noexcept {
    const double group_ns = static_cast<double>(elapsed_ns) / groups;
    const auto own = static_cast<std::size_t>(level);
    for (std::size_t l = 0; l < cost_ns_.size(); ++l) {
        const double seen_ns = group_ns * relative_cost[l] / relative_cost[own];
        const double weight = !known_ ? 1 : l == own ? own_weight : other_weight;
        cost_ns_[l] += weight * (seen_ns - cost_ns_[l]);
    }
    known_ = true;
}

bool QualityController::render(LevelWork& work, QualityLevel level, std::int32_t first,
                               std::int32_t groups) noexcept {
    const Time begin = work.now();
    if (!work.render(level, first, groups)) return false;
    learn(level, groups, work.now() - begin);
    return true;
}

bool QualityController::short_of_time(const LevelWork& work, const Frame& frame, std::int32_t group,
                                      std::int32_t slab) const noexcept {
    const Time due = work.due(group);
    if (due == never_due) return false;
    if (!known_) return true;
    const double needed_ns = caution * (cost_ns(QualityLevel::full) * slab +
                                        cost_ns(QualityLevel::sixteenth) * (frame.groups - group)) +
                             stall_share * static_cast<double>(frame.period_ns);
    return work.now() + whole(needed_ns) > due;
}

QualityLevel QualityController::choose(const LevelWork& work, const Frame& frame, Time begin,
                                       std::int32_t group, std::int32_t slab) const noexcept {
    const Time due = work.due(group);
    if (due == never_due || !known_) return QualityLevel::full;
    Time end = work.due(frame.groups - 1);
    if (frame.period_ns > 0)
        end = std::min(
            end, std::max(work.due(0), begin + whole(fair_share * static_cast<double>(frame.period_ns))));
    const Time now = work.now();
    for (const QualityLevel level : optional_levels) {
        if (!work.has_level(level)) continue;
        const double group_ns = caution * cost_ns(level);
        if (now + whole(group_ns * slab) <= due && now + whole(group_ns * (frame.groups - group)) <= end)
            return level;
    }
    return QualityLevel::sixteenth;
}

QualityController::Outcome QualityController::run(LevelWork& work, const Frame& frame) noexcept {
    Outcome outcome;
    outcome.begin = work.now();
    if (!known_) outcome.reasons |= quality_unknown_scene;
    bool sparse = false;
    for (std::int32_t group = 0; group < frame.groups;) {
        const std::int32_t slab = std::min(frame.slab, frame.groups - group);
        if (!sparse && short_of_time(work, frame, group, slab)) {
            if (!render(work, QualityLevel::sixteenth, group, frame.groups - group)) return outcome;
            sparse = true;
        }
        QualityLevel level = choose(work, frame, outcome.begin, group, slab);
        if (level == QualityLevel::sixteenth && !sparse) {
            if (!render(work, level, group, frame.groups - group)) return outcome;
            sparse = true;
            level = choose(work, frame, outcome.begin, group, slab);
        }
        if (level != QualityLevel::full) outcome.reasons |= quality_budget | quality_predicted;
        if (level != QualityLevel::sixteenth && !render(work, level, group, slab)) return outcome;
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
    outcome.end = work.now();
    outcome.complete = true;
    return outcome;
}

} // namespace obscura::emulator
