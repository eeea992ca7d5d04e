#include "emulator/frame_maker.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

FrameOrder order_for(const MakerBench& bench, std::uint64_t id) {
    FrameOrder order;
    order.frame_id = id;
    order.trigger_id = id + 5;
    order.trigger_edge = Time{9'000'000'000 + static_cast<std::int64_t>(id)};
    order.seen = order.trigger_edge + 11;
    order.scene_time = Time{static_cast<std::int64_t>(id) * 100 * ns_per_ms};
    order.tai_offset_ns = 37;
    order.settings = whole_sensor(bench.sensor);
    order.settings.gain_db = 6;
    return order;
}

std::vector<std::uint16_t> pixels_of(const Frame& frame) {
    return {frame.pixels().begin(), frame.pixels().end()};
}

} // namespace

TEST_CASE("a frame holds what renderer and detector make of its rows, one by one") {
    MakerBench bench;
    const FrameRef frame = bench.pool.acquire();
    const FrameOrder order = order_for(bench, 3);
    REQUIRE(bench.maker.make(order, *frame).empty());
    REQUIRE(frame->complete());

    // The same by hand: plan, light in closed form, detector, one row at a time.
    sensors::ReadoutPlan plan;
    const sensors::WindowRequest window{order.settings.region, order.settings.exposure_ns};
    REQUIRE(plan_readout(bench.sensor.readout, {&window, 1}, order.scene_time, plan).empty());
    std::vector<float> light(40);
    std::vector<std::uint16_t> row(40);
    bool varied = false;
    for (std::int32_t y = 0; y < 30; ++y) {
        const auto at = static_cast<std::size_t>(y);
        for (std::int32_t x = 0; x < 40; ++x)
            light[static_cast<std::size_t>(x)] = test_irradiance(x, y, plan.rows[at].mid().ns, 3);
        bench.detector.expose(plan, {y, 1, 40, light}, 3, 6, row);
        CHECK(std::equal(row.begin(), row.end(), frame->row(y).begin()));
        varied = varied || row.front() != row.back();
        CHECK(frame->row_times()[at].read - frame->info.trigger_edge ==
              plan.rows[at].read - order.scene_time);
        CHECK(frame->row_times()[at].reset - frame->info.trigger_edge ==
              plan.rows[at].reset - order.scene_time);
    }
    CHECK(varied);
    CHECK(frame->info.frame_id == 3);
    CHECK(frame->info.trigger_id == 8);
    CHECK(frame->info.trigger_edge == order.trigger_edge);
    CHECK(frame->info.seen == order.seen);
    CHECK(frame->info.tai_offset_ns == 37);
    CHECK(frame->info.bits_per_pixel == 12);
    CHECK(frame->info.truth.seed == 7);
    const Time mid = midpoint(plan.rows.front().reset, plan.rows.back().read);
    CHECK(frame->info.truth.camera.position_m.x == to_seconds(mid.ns));
    CHECK(frame->info.truth.mid_exposure - order.trigger_edge == mid - order.scene_time);
    CHECK(frame->info.render_begin <= frame->info.render_end);
    CHECK(frame->info.render_end <= frame->info.detector_end);
}

TEST_CASE("neither the size of the bands nor the trigger's instant changes a pixel") {
    MakerBench reference(small_sensor(), 8);
    const FrameRef expected = reference.pool.acquire();
    REQUIRE(reference.maker.make(order_for(reference, 2), *expected).empty());
    for (const std::int32_t band_rows : {1, 7, 29, 30, 64}) {
        MakerBench bench(small_sensor(), band_rows);
        FrameOrder order = order_for(bench, 2);
        order.trigger_edge += 123'456'789;
        const FrameRef frame = bench.pool.acquire();
        REQUIRE(bench.maker.make(order, *frame).empty());
        CHECK((pixels_of(*frame) == pixels_of(*expected)));
    }
}

TEST_CASE("the trigger delay moves exposure and scene together") {
    MakerBench bench;
    FrameOrder order = order_for(bench, 1);
    const FrameRef plain = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *plain).empty());
    order.settings.trigger_delay_ns = 3 * ns_per_ms;
    const FrameRef delayed = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *delayed).empty());
    CHECK(delayed->row_times()[0].reset - plain->row_times()[0].reset == 3 * ns_per_ms);
    CHECK(delayed->info.truth.mid_exposure - plain->info.truth.mid_exposure == 3 * ns_per_ms);
    CHECK((pixels_of(*delayed) != pixels_of(*plain)));
}

TEST_CASE("an impossible window is refused with a reason") {
    MakerBench bench;
    FrameOrder order = order_for(bench, 1);
    order.settings.region = {30, 0, 20, 10};
    const FrameRef frame = bench.pool.acquire();
    CHECK_FALSE(bench.maker.prepare(order, *frame).empty());
    order.settings.region = {30, 0, 10, 10};
    CHECK(bench.maker.make(order, *frame).empty());
}

TEST_CASE("a cancelled frame ends at a band and leaves the maker ready") {
    MakerBench bench;
    const std::atomic<bool> cancel{true};
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.prepare(order_for(bench, 1), *frame).empty());
    CHECK_FALSE(bench.maker.fill(*frame, nullptr, &cancel));
    CHECK(frame->rows_ready() == 0);
    const FrameRef next = bench.pool.acquire();
    REQUIRE(bench.maker.make(order_for(bench, 2), *next).empty());
    CHECK(next->complete());
}

TEST_CASE("the black level lifts every number, and a test pattern replaces them") {
    MakerBench bench;
    FrameOrder order = order_for(bench, 1);
    const FrameRef frame = bench.pool.acquire(), lifted = bench.pool.acquire(), ramp = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *frame).empty());
    order.settings.black_level_dn += 100;
    REQUIRE(bench.maker.make(order, *lifted).empty());
    for (std::size_t i = 0; i < frame->pixels().size(); ++i)
        if (frame->pixels()[i] > 0 && lifted->pixels()[i] < 4095)
            REQUIRE(std::abs(lifted->pixels()[i] - frame->pixels()[i] - 100) <= 1); // rounding in float
    order.settings.test_pattern = ImagePattern::horizontal_ramp;
    order.settings.region = {5, 3, 20, 10};
    REQUIRE(bench.maker.make(order, *ramp).empty());
    for (std::int32_t y = 0; y < 10; ++y)
        for (std::int32_t x = 0; x < 20; ++x)
            REQUIRE(ramp->row(y)[static_cast<std::size_t>(x)] == 5 + x);
}

TEST_CASE("the answer to settings is what the next frame gets") {
    MakerBench bench;
    FrameOrder order = order_for(bench, 1);
    order.settings.region = {0, 4, 40, 12};
    order.settings.exposure_ns = 123'456;
    const ReadoutAnswer answer = bench.maker.answer(order.settings);
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *frame).empty());
    REQUIRE(answer.refusal.empty());
    REQUIRE(answer.window_count == 1);
    CHECK(answer.windows[0].sensor == frame->info.windows[0].sensor);
    CHECK(answer.windows[0].exposure_min_ns == frame->info.windows[0].exposure_min_ns);
    CHECK(answer.windows[0].exposure_max_ns == frame->row_times()[0].exposure_ns());
    CHECK(answer.frame_period_ns == bench.maker.plan().frame_period_ns);
}
