// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_maker.hpp"
#include "models/kinds/timing_program.hpp"
#include "models/model/model.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

namespace frame_maker_test {

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

/// A sensor whose pixels feel what happens beside them.
/// Pixel after pixel, the right ones longer.
std::shared_ptr<const models::TimingProgram> scanning_pixels() {
    auto model = models::Model::parse(
        "t.tim",
        "scalar reset(scalar row, scalar column, scalar exposure) { return (row * columns + column) * 1e-6; }\n"
        "scalar read(scalar row, scalar column, scalar exposure)\n"
        "{ return reset(row, column, exposure) + exposure * (0.5 + column / columns); }\n");
    const models::ModelParameters parameters = models::default_parameters(*model);
    return std::make_shared<models::TimingProgram>(std::move(model), parameters);
}

SensorDescription leaky_sensor(Shutter shutter) {
    SensorDescription sensor = small_sensor();
    sensor.readout.shutter = shutter;
    sensor.detector.crosstalk_edge = 0.08;
    sensor.detector.crosstalk_corner = 0.02;
    sensor.detector.full_well_e = 6000; // so that bright pixels bloom
    sensor.detector.blooming = 0.3;
    sensor.pixel_pitch_m = 18e-6;
    sensor.detector.hit_flux_per_cm2_s = 1e6;
    sensor.detector.prnu_local = 0.02;
    sensor.detector.dark_nonuniformity_e_per_s = 3;
    return sensor;
}

void set_windows(CameraSettings& settings, const std::vector<CameraWindow>& windows) {
    settings.set_windows(windows);
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

TEST_CASE("charge that spreads between pixels does not see the bands") {
    for (const Shutter shutter : {Shutter::rolling, Shutter::global, Shutter::push_broom, Shutter::model}) {
        SensorDescription sensor = leaky_sensor(shutter);
        if (shutter == Shutter::model) sensor.readout.timing = scanning_pixels();
        if (shutter == Shutter::push_broom) sensor.detector.crosstalk_edge = sensor.detector.blooming = 0;
        if (shutter == Shutter::push_broom) sensor.detector.crosstalk_corner = 0;
        if (shutter == Shutter::global) sensor.detector.smear_row_ns = 2000;
        std::vector<std::uint16_t> expected;
        for (const std::int32_t band_rows : {30, 1, 2, 7, 64}) {
            MakerBench bench(sensor, band_rows);
            FrameOrder order = order_for(bench, 2);
            order.settings.exposure_ns = 20 * ns_per_ms;
            order.settings.gain_db = 0;
            if (shutter == Shutter::push_broom) order.settings.exposure_ns = 100'000;
            const FrameRef frame = bench.pool.acquire();
            REQUIRE(bench.maker.make(order, *frame).empty());
            if (expected.empty()) expected = pixels_of(*frame);
            CHECK((pixels_of(*frame) == expected));
            if (shutter != Shutter::push_broom) CHECK(frame->saturated_windows == 1);
        }
    }
}

TEST_CASE("a window shows what the whole array shows there, its edges included") {
    SensorDescription sensor = leaky_sensor(Shutter::global);
    sensor.detector.adc_bits = 14; // every electron shows
    sensor.detector.gain_dn_per_e = 1;
    for (const std::int64_t smear_ns : {0, 2000}) {
        sensor.detector.smear_row_ns = smear_ns;
        MakerBench bench(sensor, 7);
        FrameOrder order = order_for(bench, 2);
        order.settings.exposure_ns = 120 * ns_per_us; // few pixels are full
        order.settings.gain_db = 0;
        const FrameRef whole = bench.pool.acquire();
        REQUIRE(bench.maker.make(order, *whole).empty());
        for (const Region region : {Region{10, 5, 9, 12}, Region{0, 0, 4, 3}, Region{35, 26, 5, 4}}) {
            order.settings.region = region;
            const FrameRef part = bench.pool.acquire();
            REQUIRE(bench.maker.make(order, *part).empty());
            bool same = true;
            for (std::int32_t y = 0; y < region.height; ++y)
                same = same && std::equal(part->row(y).begin(), part->row(y).end(),
                                          whole->row(region.y + y).begin() + region.x);
            CHECK(same);
        }
    }
}

TEST_CASE("every window of a frame is rendered for its own rows and times") {
    for (const WindowMode mode : {WindowMode::sequential, WindowMode::interleaved}) {
        SensorDescription sensor = small_sensor();
        sensor.readout.window_mode = mode;
        MakerBench bench(sensor, 4);
        FrameOrder order = order_for(bench, 3);
        // The first two share columns and rows, the third is read three times without a reset.
        set_windows(order.settings, {{{4, 2, 12, 6}, 50'000},
                                     {{10, 5, 9, 7}, 120'000},
                                     {{30, 20, 5, 2}, 90'000, Sampling::non_destructive, 3},
                                     {{0, 28, 40, 2}, 70'000, Sampling::cds, 2}});
        const FrameRef frame = bench.pool.acquire();
        REQUIRE(bench.maker.make(order, *frame).empty());
        const FrameInfo& info = frame->info;
        REQUIRE(info.window_count == 6);
        CHECK(info.width == 40);
        CHECK(info.height == 6 + 7 + 3 * 2 + 2);
        CHECK(ImageSize{info.width, info.height} == composed_size(order.settings));

        sensors::ReadoutPlan plan;
        std::vector<sensors::WindowRequest> requests;
        for (std::size_t i = 0; i < 4; ++i) {
            const CameraWindow w = order.settings.window(i);
            requests.push_back({w.region, w.exposure_ns, w.sampling, w.reads});
        }
        REQUIRE(plan_readout(bench.sensor.readout, requests, order.scene_time, plan).empty());
        std::vector<float> light(40);
        std::vector<std::uint16_t> row(40);
        for (std::uint32_t w = 0; w < info.window_count; ++w) {
            const FrameWindow& window = info.windows[w];
            CHECK(window.exposure_requested_ns == order.settings.window(window.request).exposure_ns);
            CHECK(window.sensor == order.settings.window(window.request).region);
            for (std::int32_t r = 0; r < window.sensor.height; ++r) {
                const std::int32_t y = window.image_y + r;
                const RowTime& time = plan.rows[static_cast<std::size_t>(y)];
                for (std::int32_t x = 0; x < window.sensor.width; ++x)
                    light[static_cast<std::size_t>(x)] =
                        test_irradiance(window.sensor.x + x, window.sensor.y + r, time.mid().ns, 3);
                bench.detector.expose(plan, {y, 1, 40, light}, 3, 6, row);
                CHECK(std::equal(row.begin(), row.end(), frame->row(y).begin()));
                CHECK(std::all_of(frame->row(y).begin() + window.sensor.width, frame->row(y).end(),
                                  [](std::uint16_t dn) { return dn == 0; }));
                CHECK(time.exposure_ns() >= window.exposure_min_ns);
                CHECK(time.exposure_ns() <= window.exposure_max_ns);
            }
        }
        // Interleaved destructive windows that share rows cut each other's integration.
        const bool cut =
            std::any_of(info.windows.begin(), info.windows.begin() + info.window_count,
                        [](const FrameWindow& w) { return (w.flags & sensors::row_shared) != 0; });
        CHECK(cut == (mode == WindowMode::interleaved));
        if (cut) CHECK((frame->flags & frame_readout_clamped) != 0);
    }
}

TEST_CASE("push-broom looks at one row of the array at the times of its lines") {
    SensorDescription sensor = small_sensor();
    sensor.readout.shutter = Shutter::push_broom;
    MakerBench bench(sensor, 4);
    FrameOrder order = order_for(bench, 1);
    order.settings.region = {3, 17, 20, 30};
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *frame).empty());
    const sensors::ReadoutPlan plan = bench.maker.plan();
    std::vector<float> light(20);
    std::vector<std::uint16_t> row(20);
    for (std::int32_t y = 0; y < 30; ++y) {
        for (std::int32_t x = 0; x < 20; ++x)
            light[static_cast<std::size_t>(x)] =
                test_irradiance(3 + x, 17, plan.rows[static_cast<std::size_t>(y)].mid().ns, 1);
        bench.detector.expose(plan, {y, 1, 20, light}, 1, 6, row);
        CHECK(std::equal(row.begin(), row.end(), frame->row(y).begin()));
    }
}

TEST_CASE("a trigger that lands in a readout waits for the row grid, offline as well") {
    SensorDescription sensor = small_sensor();
    MakerBench bench(sensor), other(sensor);
    const std::int64_t row = bench.maker.plan().row_ns;
    FrameOrder first = order_for(bench, 1), second = order_for(bench, 2), third = order_for(bench, 3);
    for (FrameOrder* o : {&first, &second, &third})
        o->settings.exposure_ns = 30 * ns_per_us;
    const FrameRef a = bench.pool.acquire(), b = bench.pool.acquire(), c = bench.pool.acquire();
    first.scene_time = Time{};
    REQUIRE(bench.maker.make(first, *a).empty());
    const std::int64_t busy = bench.maker.busy_ns();
    CHECK(busy == bench.maker.plan().frame_period_ns);
    second.scene_time = Time{busy + 7};
    REQUIRE(bench.maker.overlaps(second.scene_time));
    REQUIRE(bench.maker.make(second, *b).empty());
    CHECK((b->info.windows[0].flags & sensors::trigger_deferred) != 0);
    CHECK((bench.maker.plan().trigger - Time{}) % row == 0);
    CHECK(bench.maker.busy_ns() == busy + (bench.maker.plan().trigger - second.scene_time));
    third.scene_time = second.scene_time + busy + row;
    REQUIRE(bench.maker.make(third, *c).empty());
    CHECK((c->info.windows[0].flags & sensors::trigger_deferred) != 0);

    // Without making the frames before: the same bytes and times.
    other.maker.skip(first);
    other.maker.skip(second);
    FrameRef d = other.pool.acquire();
    REQUIRE(other.maker.make(third, *d).empty());
    CHECK((pixels_of(*d) == pixels_of(*c)));
    CHECK(d->row_times()[0].reset == c->row_times()[0].reset);

    // Another acquisition knows nothing of that.
    third.frame_id = 1;
    d = other.pool.acquire();
    REQUIRE(other.maker.make(third, *d).empty());
    CHECK((d->info.windows[0].flags & sensors::trigger_deferred) == 0);
}

TEST_CASE("pixel truth is kept where the pool has room for it") {
    SensorDescription sensor = leaky_sensor(Shutter::rolling);
    MakerBench bench(sensor, 7);
    FramePool pool(1, 40 * 60, 60, {.pixels = true});
    FrameOrder order = order_for(bench, 5);
    set_windows(order.settings, {{{2, 3, 20, 10}, 20 * ns_per_ms},
                                 {{0, 15, 30, 12}, 5 * ns_per_ms, Sampling::non_destructive, 2}});
    const FrameRef frame = pool.acquire();
    REQUIRE(frame->pixel_truth() != nullptr);
    const FrameRef plain = bench.pool.acquire();
    CHECK(plain->pixel_truth() == nullptr);
    // 34 rows, and the sensor has 30.
    CHECK(bench.maker.answer(order.settings).refusal ==
          "the windows make an image of 30 x 34 pixels, 40 x 30 is allowed");
    CHECK(bench.maker.prepare(order, *plain) ==
          "the windows make an image of 30 x 34 pixels, for which there is no room");
    FrameMaker roomy(bench.renderer, bench.detector, sensor, bench.clock, {7, 60, 7, {}});
    REQUIRE(roomy.make(order, *frame).empty());
    const PixelTruth& truth = *frame->pixel_truth();

    const sensors::ReadoutPlan plan = roomy.plan();
    CHECK(truth.hits.size() == bench.detector.hits(plan, 5).size());
    CHECK(truth.hits.size() > 10);
    CHECK(truth.hits_left_out == 0);
    const auto width = static_cast<std::size_t>(plan.width);
    std::uint32_t saturated = 0;
    for (std::uint32_t w = 0; w < frame->info.window_count; ++w) {
        const FrameWindow& window = frame->info.windows[w];
        // The whole window at once, without the halo: equal inside.
        std::vector<float> light(static_cast<std::size_t>(window.sensor.area()));
        for (std::int32_t r = 0; r < window.sensor.height; ++r)
            for (std::int32_t x = 0; x < window.sensor.width; ++x)
                light[static_cast<std::size_t>(r * window.sensor.width + x)] =
                    test_irradiance(window.sensor.x + x, window.sensor.y + r,
                                    plan.rows[static_cast<std::size_t>(window.image_y + r)].mid().ns, 5);
        const std::size_t n = static_cast<std::size_t>(window.sensor.height) * width;
        std::vector<std::uint16_t> dn(n);
        std::vector<float> mean(n);
        std::vector<std::uint8_t> full(n);
        bench.detector.expose(plan, {window.image_y, window.sensor.height, window.sensor.width, light}, 5, 6,
                              dn, {mean, full});
        for (std::int32_t r = 2; r < window.sensor.height - 2; ++r)
            for (std::int32_t x = 2; x < window.sensor.width - 2; ++x) {
                const std::size_t i = static_cast<std::size_t>(r) * width + static_cast<std::size_t>(x);
                const std::size_t j = static_cast<std::size_t>(window.image_y) * width + i;
                REQUIRE(truth.mean_e[j] == mean[i]);
                REQUIRE(truth.saturated[j] == full[i]);
                REQUIRE(frame->pixels()[j] == dn[i]);
                if (full[i] != 0) saturated |= 1U << w;
            }
    }
    CHECK(saturated != 0);
    CHECK((frame->saturated_windows & saturated) == saturated);
    CHECK((frame->window_flags(0) & window_saturated) != 0);
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

TEST_CASE("every acquisition has a run word of its own, unless it is configured") {
    MakerBench bench;
    const FrameRef frame = bench.pool.acquire();
    for (const bool same_run : {false, true}) {
        FrameMaker maker(bench.renderer, bench.detector, bench.sensor, bench.clock,
                         {.band_rows = 8, .seed = 7, .run = 0xFFFFFFFF, .same_run = same_run});
        std::vector<std::uint32_t> words;
        std::vector<std::vector<std::uint16_t>> firsts;
        for (const std::uint64_t id : {1U, 2U, 1U, 2U, 3U, 1U}) {
            REQUIRE(maker.make(order_for(bench, id), *frame).empty());
            CHECK(maker.run() == frame->info.truth.run);
            words.push_back(frame->info.truth.run);
            if (id == 1) firsts.push_back(pixels_of(*frame));
        }
        constexpr std::uint32_t top = 0xFFFFFFFF;
        CHECK(words == (same_run ? std::vector<std::uint32_t>(6, top)
                                 : std::vector<std::uint32_t>{top, top, 0, 0, 0, 1}));
        CHECK((firsts[0] == firsts[1]) == same_run);
        CHECK((firsts[0] == firsts[2]) == same_run);
    }
}

TEST_CASE("a frame says when it lacks the image lag of the frame before") {
    SensorDescription sensor = small_sensor();
    for (const double lag : {0.0, 0.01}) {
        CAPTURE(lag);
        sensor.detector.lag = lag;
        MakerBench bench(sensor);
        const auto lacks = [&](std::uint64_t id, const std::atomic<bool>* cancel = nullptr) {
            const FrameRef frame = bench.pool.acquire();
            REQUIRE(bench.maker.prepare(order_for(bench, id), *frame).empty());
            bench.maker.fill(*frame, nullptr, cancel);
            return (frame->flags & frame_lag_unknown) != 0;
        };
        const bool there = lag > 0;
        CHECK(lacks(1) == there); // no frame before it is known
        CHECK_FALSE(lacks(2));
        CHECK_FALSE(lacks(3));
        bench.maker.skip(order_for(bench, 4));
        CHECK(lacks(5) == there); // frame 4 was read out, but not exposed
        const std::atomic<bool> cancel{true};
        CHECK_FALSE(lacks(6, &cancel));
        CHECK(lacks(7) == there); // frame 6 was given up
        CHECK_FALSE(lacks(8));
        CHECK(lacks(1) == there); // the next acquisition
    }
}

TEST_CASE("a scene whose camera has twice the aperture brings four times the light") {
    SensorDescription sensor = small_sensor();
    sensor.detector.read_noise_e = sensor.detector.dark_current_e_per_s = 0;
    MakerBench bench(sensor);
    scene::Scene wide = bench.scene;
    wide.camera.aperture_m = 2 * 0.025; // of the bench's detector
    REQUIRE(wide.camera.aperture_m != bench.scene.camera.aperture_m);
    const renderer::Renderer other(wide, {});
    const double before = bench.detector.electrons_per_s_per_w_m2()[0];
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(order_for(bench, 3), *frame).empty());
    CHECK(bench.detector.electrons_per_s_per_w_m2()[0] == before);
    bench.maker.replace_renderer(other);
    REQUIRE(bench.maker.make(order_for(bench, 4), *bench.pool.acquire()).empty());
    CHECK(std::abs(bench.detector.electrons_per_s_per_w_m2()[0] / before - 4) < 1e-12);
}

} // namespace frame_maker_test
