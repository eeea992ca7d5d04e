// SPDX-License-Identifier: Apache-2.0
// Plans whose times are those of a model written in SuMoL.
#include "has2.hpp"
#include "models/kinds/timing_program.hpp"
#include "models/model/model.hpp"
#include "sensors/readout/sequencer.hpp"
#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>

namespace modelled_readout_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::StartsWith;
using test::has2;

namespace {

std::shared_ptr<const models::TimingProgram>
timing_of(const std::string& text, models::NativeTarget target = models::native_target()) {
    auto model = models::Model::parse("t.tim", text);
    models::ModelParameters parameters = models::default_parameters(*model);
    parameters.target = target;
    return std::make_shared<models::TimingProgram>(std::move(model), parameters);
}

ReadoutSettings modelled(const std::string& text) {
    ReadoutSettings s = has2();
    s.shutter = Shutter::model;
    s.timing = timing_of(text);
    return s;
}

ReadoutPlan planned(const ReadoutSettings& s, const std::vector<WindowRequest>& windows,
                    Time trigger = {1'000'000}) {
    ReadoutPlan plan;
    REQUIRE(plan_readout(s, windows, trigger, plan) == "");
    return plan;
}

/// The reset pointer runs ahead of the read pointer by whole row slots.
constexpr const char* rolling = R"(
parameter line_us 212.8;
parameter sample_to_reset_us 2;
scalar reset(scalar row, scalar exposure) { return row * line_us * 1e-6; }
scalar read(scalar row, scalar exposure)
{
    scalar slots = ceil((exposure * 1e6 + sample_to_reset_us) / line_us - 1e-9);
    return reset(row, exposure) + (slots * line_us - sample_to_reset_us) * 1e-6;
}
)";

bool same(const FrameWindow& a, const FrameWindow& b) {
    return a.sensor == b.sensor && a.image_y == b.image_y && a.request == b.request && a.flags == b.flags &&
           a.exposure_requested_ns == b.exposure_requested_ns && a.exposure_min_ns == b.exposure_min_ns &&
           a.exposure_max_ns == b.exposure_max_ns;
}

void check_same(const ReadoutPlan& a, const ReadoutPlan& b) {
    CHECK(a.trigger == b.trigger);
    CHECK(a.width == b.width);
    CHECK(a.height == b.height);
    CHECK(std::equal(a.windows.begin(), a.windows.end(), b.windows.begin(), b.windows.end(), same));
    CHECK(a.rows == b.rows);
    CHECK(a.sensor_row == b.sensor_row);
    CHECK(a.release == b.release);
    CHECK(a.row_ns == b.row_ns);
    CHECK(a.cycle_ns == b.cycle_ns);
    CHECK(a.cycle_start == b.cycle_start);
    CHECK(a.readout_ns == b.readout_ns);
    CHECK(a.frame_period_ns == b.frame_period_ns);
}

} // namespace

TEST_CASE("a rolling shutter as a model plans what the built-in one plans") {
    for (const bool overlapped : {true, false})
        for (const std::int64_t exposure_ns : {210'800, 66'000'000, 310 * 212'800 - 2000, 400'000'000}) {
            CAPTURE(overlapped, exposure_ns);
            ReadoutSettings built_in = has2(), own = modelled(rolling);
            built_in.overlapped = own.overlapped = overlapped;
            const std::vector<WindowRequest> window{{{0, 0, 1024, 1024}, exposure_ns}};
            check_same(planned(own, window), planned(built_in, window));
        }
    // A window has its own rows.
    const std::vector<WindowRequest> small{{{0, 300, 1024, 64}, 1'000'000}};
    check_same(planned(modelled(rolling), small), planned(has2(), small));
}

TEST_CASE("rows that are read out of order leave in order") {
    const ReadoutPlan plan = planned(modelled(R"(
scalar place(scalar row) { return fmod(row, 2) == 0 ? row / 2 : ceil(rows / 2) + (row - 1) / 2; }
scalar reset(scalar row, scalar exposure) { return place(row) * 1e-3; }
scalar read(scalar row, scalar exposure) { return reset(row, exposure) + exposure; }
)"),
                                     {{{0, 0, 1024, 5}, 1'000'000}});
    const std::int64_t after_ns = 212'800 - 2000;
    const std::array<std::int64_t, 5> place{0, 3, 1, 4, 2};
    std::int64_t last = 0;
    for (std::size_t r = 0; r < place.size(); ++r) {
        last = std::max(last, place[r]);
        CHECK(plan.rows[r].reset.ns == 1'000'000 + place[r] * 1'000'000);
        CHECK(plan.rows[r].exposure_ns() == 1'000'000);
        CHECK(plan.release[r].ns == 2'000'000 + last * 1'000'000 + after_ns);
    }
    CHECK(plan.windows[0].flags == 0);
}

TEST_CASE("a sensor that scans its pixels releases a row with its last pixel") {
    const ReadoutPlan plan = planned(modelled(R"(
scalar reset(scalar row, scalar column, scalar exposure) { return (row * columns + column) * 2e-6; }
scalar read(scalar row, scalar column, scalar exposure) { return reset(row, column, exposure) + exposure; }
)"),
                                     {{{0, 0, 100, 3}, 5'000}});
    for (std::size_t r = 0; r < 3; ++r) {
        const auto first_ns = static_cast<std::int64_t>(r) * 200'000;
        // That of the middle pixel.
        CHECK(plan.rows[r].reset.ns == 1'000'000 + first_ns + 50 * 2'000);
        CHECK(plan.rows[r].exposure_ns() == 5'000);
        CHECK(plan.release[r].ns == 1'000'000 + first_ns + 99 * 2'000 + 5'000);
    }
    CHECK(plan.frame_period_ns == 300 * 2'000 - 2'000);
}

TEST_CASE("a window's pixels count from its corner, and windows follow one another") {
    ReadoutSettings s = modelled(R"(
scalar reset(scalar row, scalar exposure) { return row * 1e-3; }
scalar read(scalar row, scalar exposure) { return reset(row, exposure) + exposure; }
)");
    s.window_overhead_ns = 100;
    const ReadoutPlan plan = planned(s, {{{0, 10, 1024, 2}, 1'000'000}, {{8, 500, 100, 2}, 2'000'000}});
    const std::int64_t first_ns = plan.release[1].ns - 1'000'000 + s.reset_instant_ns + 100;
    CHECK(plan.rows[1].reset.ns == 2'000'000);
    CHECK(plan.rows[2].reset.ns == 1'000'000 + first_ns);
    CHECK(plan.rows[3].read.ns == 1'000'000 + first_ns + 3'000'000);
    CHECK(plan.sensor_row == std::vector<std::int32_t>{10, 11, 500, 501});
}

TEST_CASE("times that cannot be are refused with row and reason") {
    const auto reason = [](const std::string& reset, const std::string& read) {
        ReadoutPlan plan;
        const std::vector<WindowRequest> window{{{0, 0, 1024, 1024}, 1'000'000}};
        return plan_readout(modelled("scalar reset(scalar row, scalar exposure) { return " + reset +
                                     "; }\nscalar read(scalar row, scalar exposure) { return " + read +
                                     "; }\n"),
                            window, Time{}, plan);
    };
    CHECK(reason("row * 1e-3", "row * 1e-3 + exposure") == "");
    CHECK_THAT(reason("row * 1e-3", "0.7"), StartsWith("t.tim:2:8: read() is 0.7 s at row 700"));
    CHECK_THAT(reason("0.001 - row * 1e-3", "1"), ContainsSubstring("before the trigger"));
    CHECK_THAT(reason("0", "row"), ContainsSubstring("at row 0"));
    CHECK_THAT(reason("0", "row + 1"), ContainsSubstring("at most 1000 s are allowed"));
    CHECK_THAT(reason("0", "1 / (row - 9)"), ContainsSubstring("at row 0"));
    CHECK_THAT(reason("0", "1 / max(0, 9 - row)"), ContainsSubstring("read() is not finite at row 9"));
    CHECK_THAT(reason("0.2e-9", "0.6e-9"), !ContainsSubstring("tim"));
    CHECK_THAT(reason("0.2e-9", "0.4e-9"), ContainsSubstring("at least 1 ns later"));
    ReadoutPlan plan;
    ReadoutSettings none = has2();
    none.shutter = Shutter::model;
    const std::vector<WindowRequest> window{{{0, 0, 8, 8}, 1'000'000}};
    CHECK_THAT(plan_readout(none, window, Time{}, plan), ContainsSubstring("shutter = { model"));
    CHECK_THROWS_WITH(timing_of("scalar reset(scalar row, scalar exposure) { return 0; }\n"
                                "scalar read(scalar row, scalar column, scalar exposure) { return 1; }\n"),
                      ContainsSubstring("t.tim:2:8: reset() and read() must have the same arguments"));
    CHECK_THROWS_WITH(timing_of("scalar reset(scalar row) { return 0; }\n"
                                "scalar read(scalar row, scalar exposure) { return 1; }\n"),
                      ContainsSubstring("'reset' must be scalar reset(scalar row, scalar exposure), or"));
    CHECK_THROWS_WITH(timing_of("scalar reset(scalar row, scalar exposure) { return 0; }\n"),
                      ContainsSubstring("the function scalar read(scalar row"));
}

TEST_CASE("times are the same with machine code and without") {
    const std::string text = R"(
scalar reset(scalar row, scalar column, scalar exposure)
{
    return 1e-3 + 3.7e-7 * (row * columns + (fmod(row, 2) == 0 ? column : columns - 1 - column)) * sqrt(1 + row);
}
scalar read(scalar row, scalar column, scalar exposure) { return reset(row, column, exposure) + exposure; }
)";
    const auto native = timing_of(text), interpreted = timing_of(text, models::NativeTarget::none);
    const models::TimedFrame frame{300, 333, 1'234'567};
    std::vector<RowTime> a(333), b(333), alone(1);
    for (std::int32_t row = 0; row < frame.rows; ++row) {
        REQUIRE(!native->fill_pixels(frame, row, 0, a));
        REQUIRE(!interpreted->fill_pixels(frame, row, 0, b));
        REQUIRE(a == b);
        REQUIRE(!native->fill_pixels(frame, row, row, alone));
        REQUIRE(alone[0] == a[static_cast<std::size_t>(row)]);
    }
}

TEST_CASE("a trigger in a readout begins the times of a model at once") {
    ReadoutSettings s = modelled(rolling);
    s.overlapped = true;
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const std::vector<WindowRequest> window{{{0, 0, 1024, 16}, 300'000}};
    REQUIRE(sequencer.next(s, window, Time{0}, plan) == TriggerVerdict::accepted);
    const std::int64_t period_ns = plan.frame_period_ns;
    REQUIRE(sequencer.next(s, window, Time{period_ns - 1}, plan) == TriggerVerdict::over_trigger);
    REQUIRE(sequencer.next(s, window, Time{period_ns + 17}, plan) == TriggerVerdict::accepted);
    CHECK(plan.rows[0].reset.ns == period_ns + 17);
}

} // namespace modelled_readout_test
