// SPDX-License-Identifier: Apache-2.0
// Frames on a simulated machine whose clock moves only by work: costs that drift and jump, stalls, busy
// phases.
#pragma once

#include "emulator/render/quality_controller.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>

namespace obscura::test {

inline constexpr std::int32_t simulated_groups = 64;
inline constexpr std::int64_t simulated_period_ns = 100'000'000;
inline constexpr emulator::QualityController::Frame simulated_frame{simulated_groups, simulated_period_ns, 8};

/// One frame. Its rows are due from 18 to 105 ms after its edge, and rendering begins a period before it.
struct SimulatedFrame final : emulator::LevelWork {
    /// Cost of each level relative to a frame in full quality, by the table of the real-time scene.
    static constexpr std::array<double, quality_level_count> cost{1,   0.9,  0.7,  0.7, 0.6,
                                                                  0.2, 0.08, 0.08, 0,   0};
    static constexpr std::array<double, quality_level_count> error{0.6,  0.7, 0.75, 0.8, 0.9,
                                                                   1.25, 3,   0.78, 0,   0};

    Time clock, first_due, last_due;
    double full_ns = 80e6; ///< cost of a frame in full quality
    std::array<double, quality_level_count> ratio = cost;
    double work = 0; ///< done so far
    /// Error of an earlier frame, reprojected, in the unit of `error`; negative: there is none.
    double moved_error = -1;
    double middle = 1;          ///< cost of the middle third of the groups over that of the others
    std::int64_t stall_ns = 0;  ///< somewhere in the frame
    std::int32_t stall_at = -1; ///< group
    std::array<QualityLevel, simulated_groups> level{};
    std::int32_t late = 0; ///< groups without light at their time

    /// The `number`-th frame, on a machine that is free from `free` on.
    SimulatedFrame(int number, Time free) {
        level.fill(QualityLevel::missing);
        const Time edge{(number + 1) * simulated_period_ns};
        first_due = edge + 18'000'000;
        last_due = first_due + 87'000'000;
        clock = std::max(free, edge - simulated_period_ns);
    }
    [[nodiscard]] Time now() const noexcept override { return clock; }
    [[nodiscard]] Time due(std::int32_t group) const noexcept override {
        return first_due + (last_due - first_due) * group / (simulated_groups - 1);
    }
    bool render(QualityLevel l, std::int32_t first, std::int32_t count) noexcept override {
        for (std::int32_t g = first; g < first + count; ++g) {
            QualityLevel& own = level[static_cast<std::size_t>(g)];
            // A group that has light is settled when its time comes.
            if (own != QualityLevel::missing && clock >= due(g)) continue;
            const bool is_middle = g >= simulated_groups / 3 && g < 2 * simulated_groups / 3;
            const double share = (is_middle ? middle : 1.0) / (2 + middle) * 3;
            const double cost_ns = full_ns * share * ratio[static_cast<std::size_t>(l)] / simulated_groups;
            clock += static_cast<std::int64_t>(cost_ns);
            work += cost_ns / 100;
            if (g == stall_at) {
                clock += stall_ns;
                stall_at = -1;
            }
            if (own == QualityLevel::missing && clock > due(g)) ++late;
            if (own == QualityLevel::missing || clock <= due(g)) own = l;
        }
        return true;
    }
    [[nodiscard]] bool improved(std::int32_t group) const noexcept override {
        const QualityLevel own = level[static_cast<std::size_t>(group)];
        return own < QualityLevel::sixteenth || own == QualityLevel::reprojected;
    }
    [[nodiscard]] double error2(QualityLevel l, std::int32_t first,
                                std::int32_t count) const noexcept override {
        if (l == QualityLevel::reprojected) return moved_error < 0 ? -1 : moved_error * moved_error;
        if (l != QualityLevel::quarter && l != QualityLevel::sixteenth) return -1;
        const auto begin = level.begin() + first;
        const bool lit = std::all_of(begin, begin + count, [&](QualityLevel own) { return own == l; });
        return lit ? std::pow(error[static_cast<std::size_t>(l)], 2) : -1;
    }
    [[nodiscard]] bool is_biased() const {
        return std::any_of(level.begin(), level.end(), [](QualityLevel l) { return obscura::is_biased(l); });
    }
    [[nodiscard]] bool has_level(QualityLevel l) const noexcept override {
        return l != QualityLevel::bounces;
    }
    [[nodiscard]] double lit_share(std::int32_t /*group*/) const noexcept override { return -1; }
    [[nodiscard]] std::uint64_t work_done() const noexcept override {
        return static_cast<std::uint64_t>(work);
    }
    [[nodiscard]] double mean_error() const {
        double sum = 0;
        for (const QualityLevel l : level)
            sum += error[static_cast<std::size_t>(l)] / simulated_groups;
        return sum;
    }
    [[nodiscard]] bool is_full() const {
        return std::all_of(level.begin(), level.end(),
                           [](QualityLevel l) { return l == QualityLevel::full; });
    }
};

/// A series of frames at 10 Hz whose cost is a random walk with jumps, on a machine that stalls for 5 ms and
/// more every 20 s and is half as fast for 3 s a minute.
class SimulatedSeries {
public:
    SimulatedSeries(unsigned seed, double max_full_ns, double max_stall_ns)
        : random_(seed), max_full_ns_(max_full_ns), max_stall_ns_(max_stall_ns) {}

    /// Renders the next frame by the controller.
    SimulatedFrame next(emulator::QualityController& controller,
                        emulator::QualityController::Outcome* outcome = nullptr) {
        SimulatedFrame frame(number_++, free_);
        if (uniform_(random_) < 0.001) full_ns_ *= 0.5 + 1.5 * uniform_(random_);
        full_ns_ = std::clamp(full_ns_ * std::exp(step_(random_)), 20e6, max_full_ns_);
        if (uniform_(random_) < 1.0 / 600) slow_until_ = number_ + 30;
        frame.full_ns = full_ns_ * (number_ < slow_until_ ? 2 : 1);
        if (uniform_(random_) < 0.005) {
            frame.stall_at = static_cast<std::int32_t>(uniform_(random_) * simulated_groups);
            frame.stall_ns = static_cast<std::int64_t>(5e6 + (max_stall_ns_ - 5e6) * uniform_(random_));
        }
        const auto result = controller.run(frame, simulated_frame);
        if (outcome != nullptr) *outcome = result;
        free_ = frame.clock;
        return frame;
    }

private:
    std::mt19937 random_;
    std::normal_distribution<double> step_{0, 0.03};
    std::uniform_real_distribution<double> uniform_{0, 1};
    double max_full_ns_, max_stall_ns_;
    double full_ns_ = 80e6;
    int number_ = 0, slow_until_ = 0;
    Time free_{0};
};

} // namespace obscura::test
