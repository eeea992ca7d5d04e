// SPDX-License-Identifier: Apache-2.0
#include "emulator/quality_controller.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

/// Cost of the levels before they are known, over that of full rendering (the real-time scene of
/// config/realtime.toml).
constexpr std::array<double, quality_level_count> relative_cost{1, 0.9, 0.7, 0.7, 0.6, 0.2, 0.08, 0, 0, 0};

/// Powers of a measurement over its expectation by which the expectations follow: of the groups measured, of
/// the level measured unless that is full, and of the groups not measured, because the load has changed.
constexpr double group_weight = 0.3;
constexpr double level_weight = 0.2;
constexpr double load_weight = 0.05;

/// The expected cost of full rendering falls by this factor with each frame that is not full: it is tried
/// again now and then, else nothing would correct an expectation that is too high.
constexpr double hope = 0.99;

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

double QualityController::cost_ns(QualityLevel level, std::int32_t first,
                                  std::int32_t groups) const noexcept {
    double full_ns = 0;
    for (std::int32_t g = first; g < first + groups; ++g)
        full_ns += full_ns_[static_cast<std::size_t>(g)];
    return full_ns * ratio_[static_cast<std::size_t>(level)];
}

void QualityController::learn(QualityLevel level, std::int32_t first, std::int32_t groups,
                              std::int64_t elapsed_ns) noexcept {
    const auto own = static_cast<std::size_t>(level);
    const double seen_ns = std::max(1.0, static_cast<double>(elapsed_ns));
    if (!known_) {
        ratio_ = relative_cost;
        full_ns_.fill(seen_ns / groups / relative_cost[own]);
        known_ = true;
        return;
    }
    const double change = std::clamp(seen_ns / cost_ns(level, first, groups), 0.1, 10.0);
    const double measured = std::pow(change, group_weight), others = std::pow(change, load_weight);
    for (std::int32_t g = 0; g < static_cast<std::int32_t>(full_ns_.size()); ++g)
        full_ns_[static_cast<std::size_t>(g)] *= g >= first && g < first + groups ? measured : others;
    if (level != QualityLevel::full)
        ratio_[own] = std::clamp(ratio_[own] * std::pow(change, level_weight), 0.01, 1.0);
}

bool QualityController::render(LevelWork& work, QualityLevel level, std::int32_t first,
                               std::int32_t groups) noexcept {
    const Time begin = work.now();
    if (!work.render(level, first, groups)) return false;
    learn(level, first, groups, work.now() - begin);
    return true;
}

bool QualityController::short_of_time(const LevelWork& work, const Frame& frame, std::int32_t group,
                                      std::int32_t slab) const noexcept {
    const Time due = work.due(group);
    if (due == never_due) return false;
    if (!known_) return true;
    const double needed_ns = caution * (cost_ns(QualityLevel::full, group, slab) +
                                        cost_ns(QualityLevel::sixteenth, group, frame.groups - group)) +
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
        if (now + whole(caution * cost_ns(level, group, slab)) <= due &&
            now + whole(caution * cost_ns(level, group, frame.groups - group)) <= end)
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
    if (outcome.reasons != 0)
        for (double& ns : full_ns_)
            ns *= hope;
    outcome.end = work.now();
    outcome.complete = true;
    return outcome;
}

} // namespace obscura::emulator
