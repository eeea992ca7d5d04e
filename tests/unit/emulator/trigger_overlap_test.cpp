// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/camera.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

namespace trigger_overlap_test {

using namespace obscura;
using namespace obscura::test;

TEST_CASE("trigger overlap says from when on the next edge is taken") {
    SensorDescription sensor = small_sensor();
    sensor.readout.overlapped = true;
    CameraBench bench(sensor, 1);
    CameraSettings s = bench.camera.settings();
    std::uint64_t id = 0;
    std::uint32_t frames = 0;
    const auto offer = [&](Time edge) { bench.camera.on_trigger({++id, edge, edge}); };
    for (const TriggerOverlap overlap :
         {TriggerOverlap::off, TriggerOverlap::readout, TriggerOverlap::previous_frame}) {
        CAPTURE(static_cast<int>(overlap));
        s.trigger_overlap = overlap;
        REQUIRE(bench.camera.apply(s));
        REQUIRE(bench.camera.acquisition_start());
        bench.wait_ready(); // the frame before may not have let go of the camera yet
        const std::uint64_t missed = bench.camera.counters().missed_triggers;
        const Time first = bench.clock.now();
        offer(first);
        bench.wait_ended(++frames);
        bench.wait_ready();
        const Time exposable = first + bench.maker.plan().frame_period_ns;
        const Time read_out = bench.camera.activity().frame_end;
        REQUIRE(exposable < read_out);
        offer(exposable - 1);
        if (overlap == TriggerOverlap::previous_frame) {
            bench.wait_ended(++frames); // remembered
            CHECK(bench.camera.activity().exposure_start >= exposable);
        } else {
            CHECK(bench.camera.counters().missed_triggers == missed + 1);
            offer(exposable);
            if (overlap == TriggerOverlap::off) {
                CHECK(bench.camera.counters().missed_triggers == missed + 2);
                offer(read_out);
            }
            bench.wait_ended(++frames);
        }
        CHECK(bench.camera.counters().frames == frames);
        bench.camera.acquisition_stop(false);
    }
    sensor.readout.overlapped = false; // a chip that cannot
    CameraBench plain(sensor);
    s.trigger_overlap = TriggerOverlap::readout;
    CHECK_FALSE(plain.camera.apply(s));
}

} // namespace trigger_overlap_test
