// SPDX-License-Identifier: Apache-2.0
// Quality controller under simulated loads: rows are in time, and quality follows the time that there is.
#include "emulator/render/quality_controller.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/simulated_load.hpp"

#include <vector>

namespace quality_controller_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

TEST_CASE("rows are in time under drifting loads and stalls") {
    QualityController controller;
    SimulatedSeries series(7, 125e6, 60e6);
    constexpr int frames = 100'000;
    int late = 0;
    int full = 0;
    for (int f = 0; f < frames; ++f) {
        QualityController::Outcome outcome;
        const SimulatedFrame frame = series.next(controller, &outcome);
        CHECK(outcome.complete);
        late += frame.late > 0 ? 1 : 0;
        full += frame.is_full() ? 1 : 0;
        if (!frame.is_full()) CHECK(outcome.reasons != 0);
    }
    INFO(late << " frames of " << frames << " late, " << full << " full");
    CHECK(late <= frames / 100'000);
    CHECK(full > frames / 10);
}

TEST_CASE("with the frame time of the machine the first frame is in time and as good as there is time for") {
    // The simulation, not the controller, says what a frame costs: half of the period, and six of them.
    for (const double full_ns : {50e6, 600e6}) {
        CAPTURE(full_ns);
        QualityController controller;
        controller.expect_frame_time(static_cast<std::int64_t>(full_ns), simulated_groups);
        SimulatedFrame frame(0, Time{0});
        frame.full_ns = full_ns;
        const auto outcome = controller.run(frame, simulated_frame);
        CHECK((outcome.reasons & quality_unknown_scene) == 0);
        CHECK(frame.late == 0);
        CHECK(frame.is_full() == (full_ns < 100e6));
    }
}

TEST_CASE("costs of levels and of parts of the frame are learnt, also after a busy time") {
    QualityController controller;
    Time free{0};
    int full = 0, late = 0;
    for (int f = 0; f < 400; ++f) {
        SimulatedFrame frame(f, free);
        frame.full_ns = f < 100 ? 300e6 : 92e6;
        // Sparse grids save less than the controller begins with.
        frame.ratio = {1, 0.95, 0.9, 0.9, 0.85, 0.45, 0.15, 0, 0, 0};
        frame.middle = 4;
        static_cast<void>(controller.run(frame, simulated_frame));
        free = frame.clock;
        if (f < 20) continue;
        late += frame.late > 0 ? 1 : 0;
        full += f >= 200 && frame.is_full() ? 1 : 0;
    }
    CHECK(late == 0);
    CHECK(full >= 180);
}

TEST_CASE("a stall is told from work that the scene brought") {
    QualityController controller;
    Time free{0};
    int f = 0;
    const auto stalled = [&](double full_ns, std::int64_t stall_ns) {
        SimulatedFrame frame(f++, free);
        frame.full_ns = full_ns;
        frame.stall_ns = stall_ns;
        frame.stall_at = stall_ns > 0 ? 30 : -1;
        const auto outcome = controller.run(frame, simulated_frame);
        free = frame.clock;
        return (outcome.reasons & quality_stall) != 0;
    };
    while (f < 50)
        CHECK_FALSE(stalled(80e6, 0));
    CHECK(stalled(80e6, 60'000'000));
    CHECK_FALSE(stalled(80e6, 0));
    // A body comes into view.
    CHECK_FALSE(stalled(400e6, 0));
    CHECK_FALSE(stalled(400e6, 0));
}

TEST_CASE("full quality where there is time, and less error with more time") {
    double before = 10;
    for (const double load : {8.0, 5.0, 3.0, 2.0, 1.6, 1.3, 1.1, 0.9, 0.7, 0.5}) {
        QualityController controller;
        Time free{0};
        double sum = 0;
        for (int f = 0; f < 100; ++f) {
            SimulatedFrame frame(f, free);
            frame.full_ns = load * static_cast<double>(simulated_period_ns);
            static_cast<void>(controller.run(frame, simulated_frame));
            free = frame.clock;
            if (f >= 50) sum += frame.mean_error() / 50;
        }
        INFO("full rendering takes " << load << " periods: error " << sum);
        CHECK(sum <= before + 1e-9);
        if (load <= 0.7) CHECK(sum == Approx(SimulatedFrame::error[0]));
        before = sum;
    }
}

TEST_CASE("biased levels change every other second at most under a square wave of load") {
    QualityController controller;
    Time free{0};
    constexpr int frames = 1200; // 2 minutes at 10 Hz
    int changes = 0, biased = 0, full = 0, late = 0;
    bool before = false;
    for (int f = 0; f < frames; ++f) {
        SimulatedFrame frame(f, free);
        frame.moved_error = 0.78;
        frame.full_ns = f % 10 < 5 ? 350e6 : 50e6; // 1 Hz
        static_cast<void>(controller.run(frame, simulated_frame));
        free = frame.clock;
        changes += frame.is_biased() != before ? 1 : 0;
        before = frame.is_biased();
        biased += before ? 1 : 0;
        full += frame.is_full() ? 1 : 0;
        late += frame.late > 0 ? 1 : 0;
    }
    INFO(changes << " changes in " << frames / 10 << " s, " << biased << " frames biased, " << full
                 << " full");
    CHECK(changes <= frames / 10 / 2);
    CHECK(changes >= frames / 10 / 4);
    CHECK(biased > 0);
    CHECK(full > frames / 4);
    CHECK(late == 0);
}

TEST_CASE("an earlier frame is reprojected where that errs by less than a sparse grid, and only there") {
    const auto levels_of = [](double moved_error, double load) {
        QualityController controller;
        Time free{0};
        std::array<int, quality_level_count> count{};
        double error = 0;
        for (int f = 0; f < 100; ++f) {
            SimulatedFrame frame(f, free);
            frame.moved_error = moved_error;
            frame.full_ns = load * static_cast<double>(simulated_period_ns);
            static_cast<void>(controller.run(frame, simulated_frame));
            free = frame.clock;
            if (f < 50) continue;
            for (const QualityLevel l : frame.level)
                ++count[static_cast<std::size_t>(l)];
            for (const QualityLevel l : frame.level)
                error += l == QualityLevel::reprojected ? moved_error
                                                        : SimulatedFrame::error[static_cast<std::size_t>(l)];
        }
        return std::pair(count, error);
    };
    constexpr auto moved = static_cast<std::size_t>(QualityLevel::reprojected);
    constexpr auto quarter = static_cast<std::size_t>(QualityLevel::quarter);
    constexpr auto sixteenth = static_cast<std::size_t>(QualityLevel::sixteenth);
    for (const double load : {3.0, 6.0}) {
        const auto [without, error_without] = levels_of(-1, load);
        CHECK(without[moved] == 0);
        CHECK(without[quarter] + without[sixteenth] > 0);
        // Worse than a sixteenth of the points, and better than a quarter of them.
        CHECK(levels_of(4, load).first == without);
        const auto [with, error_with] = levels_of(0.78, load);
        CHECK(with[moved] > 0);
        CHECK(with[quarter] + with[sixteenth] < without[quarter] + without[sixteenth]);
        CHECK(error_with < error_without);
        // Between the two.
        const auto [between, error_between] = levels_of(2, load);
        CHECK(between[sixteenth] <= without[sixteenth]);
        CHECK(error_between <= error_without);
    }
    // None is biased that can be full.
    CHECK(levels_of(0.78, 0.5).first[moved] == 0);
}

} // namespace quality_controller_test
