// SPDX-License-Identifier: Apache-2.0
// Quality controller under simulated loads: rows are in time, and quality follows the time that there is.
#include "emulator/quality_controller.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <random>
#include <vector>

using namespace obscura;
using namespace obscura::emulator;

namespace {

constexpr std::int32_t groups = 64;
constexpr std::int64_t period_ns = 100'000'000;
/// Of a frame in full quality, by the table of the real-time scene.
constexpr std::array<double, quality_level_count> cost{1, 0.9, 0.7, 0.7, 0.6, 0.2, 0.08, 0, 0, 0};
constexpr std::array<double, quality_level_count> error{0.6, 0.7, 0.75, 0.8, 0.9, 1.25, 3, 0, 0, 0};

/// One frame of a machine whose clock moves only by work.
struct Simulated final : LevelWork {
    Time clock, first_due, last_due;
    double full_ns = 80e6; ///< cost of a frame in full quality
    std::array<double, quality_level_count> ratio = cost;
    double middle = 1;          ///< cost of the middle third of the groups over that of the others
    std::int64_t stall_ns = 0;  ///< somewhere in the frame
    std::int32_t stall_at = -1; ///< group
    std::array<QualityLevel, groups> level{};
    std::int32_t late = 0; ///< groups without light at their time

    Simulated() { level.fill(QualityLevel::missing); }
    [[nodiscard]] Time now() const noexcept override { return clock; }
    [[nodiscard]] Time due(std::int32_t group) const noexcept override {
        return first_due + (last_due - first_due) * group / (groups - 1);
    }
    bool render(QualityLevel l, std::int32_t first, std::int32_t count) noexcept override {
        for (std::int32_t g = first; g < first + count; ++g) {
            QualityLevel& own = level[static_cast<std::size_t>(g)];
            // A group that has light is settled when its time comes.
            if (own != QualityLevel::missing && clock >= due(g)) continue;
            const double share = (g >= groups / 3 && g < 2 * groups / 3 ? middle : 1.0) / (2 + middle) * 3;
            clock += static_cast<std::int64_t>(full_ns * share * ratio[static_cast<std::size_t>(l)] / groups);
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
        return level[static_cast<std::size_t>(group)] < QualityLevel::sixteenth;
    }
    [[nodiscard]] bool has_level(QualityLevel l) const noexcept override {
        return l != QualityLevel::bounces;
    }
    [[nodiscard]] double mean_error() const {
        double sum = 0;
        for (const QualityLevel l : level)
            sum += error[static_cast<std::size_t>(l)] / groups;
        return sum;
    }
};

} // namespace

TEST_CASE("rows are in time under drifting loads and stalls") {
    std::mt19937 random(7);
    std::normal_distribution<double> step(0, 0.03);
    std::uniform_real_distribution<double> uniform(0, 1);
    QualityController controller;
    constexpr int frames = 100'000;
    double full_ns = 80e6;
    Time clock{0};
    int late = 0;
    int full = 0;
    for (int f = 0; f < frames; ++f) {
        Simulated work;
        const Time edge{(f + 1) * period_ns};
        work.first_due = edge + 18'000'000;
        work.last_due = work.first_due + 87'000'000;
        // Rendering begins a period ahead at the earliest, and after the frame before.
        work.clock = std::max(clock, edge - period_ns);
        full_ns = std::clamp(full_ns * std::exp(step(random)), 20e6, 300e6);
        work.full_ns = full_ns;
        if (uniform(random) < 0.005) {
            work.stall_at = static_cast<std::int32_t>(uniform(random) * groups);
            work.stall_ns = static_cast<std::int64_t>((5 + 35 * uniform(random)) * 1e6);
        }
        const auto outcome = controller.run(work, {groups, period_ns, 8});
        CHECK(outcome.complete);
        clock = work.clock;
        bool all = true;
        for (const QualityLevel l : work.level)
            all = all && l == QualityLevel::full;
        late += work.late > 0 ? 1 : 0;
        full += all ? 1 : 0;
        if (!all) CHECK(outcome.reasons != 0);
    }
    INFO(late << " frames of " << frames << " late, " << full << " full");
    CHECK(late <= frames / 10'000);
    CHECK(full > frames / 10);
}

TEST_CASE("costs of levels and of parts of the frame are learnt, also after a busy time") {
    QualityController controller;
    Time clock{0};
    int full = 0, late = 0;
    for (int f = 0; f < 400; ++f) {
        Simulated work;
        const Time edge{(f + 1) * period_ns};
        work.first_due = edge + 18'000'000;
        work.last_due = work.first_due + 87'000'000;
        work.clock = std::max(clock, edge - period_ns);
        work.full_ns = f < 100 ? 300e6 : 92e6;
        // Sparse grids save less than the controller begins with.
        work.ratio = {1, 0.95, 0.9, 0.9, 0.85, 0.45, 0.15, 0, 0, 0};
        work.middle = 4;
        static_cast<void>(controller.run(work, {groups, period_ns, 8}));
        clock = work.clock;
        if (f < 20) continue;
        late += work.late > 0 ? 1 : 0;
        bool all = true;
        for (const QualityLevel l : work.level)
            all = all && l == QualityLevel::full;
        full += f >= 200 && all ? 1 : 0;
    }
    CHECK(late == 0);
    CHECK(full >= 180);
}

TEST_CASE("full quality where there is time, and less error with more time") {
    double before = 10;
    for (const double load : {8.0, 5.0, 3.0, 2.0, 1.6, 1.3, 1.1, 0.9, 0.7, 0.5}) {
        QualityController controller;
        Time clock{0};
        double sum = 0;
        for (int f = 0; f < 100; ++f) {
            Simulated work;
            const Time edge{(f + 1) * period_ns};
            work.first_due = edge + 18'000'000;
            work.last_due = work.first_due + 87'000'000;
            work.clock = std::max(clock, edge - period_ns);
            work.full_ns = load * static_cast<double>(period_ns);
            static_cast<void>(controller.run(work, {groups, period_ns, 8}));
            clock = work.clock;
            if (f >= 50) sum += work.mean_error() / 50;
        }
        INFO("full rendering takes " << load << " periods: error " << sum);
        CHECK(sum <= before + 1e-9);
        if (load <= 0.7) CHECK(sum == Approx(error[0]));
        before = sum;
    }
}
