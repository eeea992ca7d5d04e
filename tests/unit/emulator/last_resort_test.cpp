// SPDX-License-Identifier: Apache-2.0
// Rows whose time comes before anything of them is rendered are made from an earlier frame, and say so.
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <vector>

namespace last_resort_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

/// Time that passes twenty times as slowly, so that threads that wake late are in time.
class SlowClock final : public Clock {
public:
    [[nodiscard]] Time now() const noexcept override {
        return Time{begin_.ns + (clock_.now() - begin_) / 20};
    }
    bool sleep_until(Time t) noexcept override { return clock_.sleep_until(begin_ + 20 * (t - begin_)); }
    void interrupt() noexcept override { clock_.interrupt(); }
    void rearm() noexcept override { clock_.rearm(); }
    [[nodiscard]] std::int64_t tai_offset_ns() const noexcept override { return clock_.tai_offset_ns(); }

private:
    MonotonicClock clock_;
    Time begin_ = clock_.now();
};

/// A maker whose frames adapt to their deadlines.
struct AdaptiveBench {
    AdaptiveBench()
        : maker(renderer, detector, sensor, clock,
                {.band_rows = 16, .seed = 7, .adapts = true, .floor = 0.1, .enter_render = [] {}}) {
        frames_are_kept = true;
    }
    ~AdaptiveBench() {
        render_gate().open();
        frames_are_kept = false;
    }

    /// A frame whose trigger comes `in_ns` from now.
    FrameRef make(std::int64_t in_ns) {
        FrameOrder order;
        order.frame_id = order.trigger_id = ++id;
        order.scene_time = Time{static_cast<std::int64_t>(id) * 100 * ns_per_ms};
        order.trigger_edge = clock.now() + in_ns;
        order.settings = whole_sensor(sensor);
        FrameRef frame = pool.acquire();
        REQUIRE(maker.make(order, *frame).empty());
        return frame;
    }

    SlowClock clock;
    SensorDescription sensor = small_sensor(48, 64);
    scene::Scene scene;
    renderer::Renderer renderer{scene, {}};
    sensors::Detector detector{sensor, std::array{SpectralBand{}}, 0.025, 7};
    FrameMaker maker;
    FramePool pool{6, 48 * 64, 64};
    std::uint64_t id = 0;
};

} // namespace

TEST_CASE("rows without light at their time are reprojected, or repeated when that is too late") {
    AdaptiveBench bench;
    for (int i = 0; i < 4; ++i) { // each store learns what the last resort takes
        const FrameRef frame = bench.make(20 * ns_per_ms);
        CHECK(frame->info.quality.level_max < QualityLevel::reprojected);
        CHECK((frame->flags.load() & frame_biased) == 0);
    }
    struct Case {
        std::int64_t in_ns;
        QualityLevel level;
    };
    for (const Case& c :
         {Case{20 * ns_per_ms, QualityLevel::reprojected}, Case{-ns_per_s, QualityLevel::repeated}}) {
        const FrameRef frame = [&] {
            render_gate().close();
            FrameRef made = bench.make(c.in_ns);
            render_gate().open();
            return made;
        }();
        REQUIRE(frame->complete());
        const FrameQuality& quality = frame->info.quality;
        CHECK(quality.level_max == c.level);
        CHECK(quality.level_share[static_cast<std::size_t>(c.level)] == Approx(1));
        CHECK(quality.rows_degraded == 64);
        CHECK(quality.rows_reprojected == (c.level == QualityLevel::reprojected ? 64 : 0));
        CHECK(quality.rows_repeated == (c.level == QualityLevel::repeated ? 64 : 0));
        CHECK((quality.reasons & quality_budget) != 0);
        CHECK((frame->flags.load() & frame_biased) != 0);
        CHECK((frame->flags.load() & frame_degraded) != 0);
        CHECK(bench.maker.quality_counters().worst[static_cast<std::size_t>(c.level)] == 1);
        // The next is itself again.
        CHECK(bench.make(20 * ns_per_ms)->info.quality.level_max < QualityLevel::reprojected);
    }
}

TEST_CASE("without an earlier frame rows wait for their light") {
    AdaptiveBench bench;
    frames_are_kept = false;
    const FrameRef first = bench.make(-ns_per_s);
    CHECK(first->complete());
    CHECK(first->info.quality.level_max < QualityLevel::reprojected);
}

} // namespace last_resort_test
