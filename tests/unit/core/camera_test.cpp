// SPDX-License-Identifier: Apache-2.0
#include "core/camera/camera.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace camera_test {

using namespace obscura;

TEST_CASE("settings outside the limits are named with what is allowed") {
    CameraLimits limits;
    limits.sensor_width = 1024;
    limits.sensor_height = 512;
    limits.width_step = 8;
    limits.width_min = 16;
    CameraSettings good;
    good.region = {8, 0, 64, 64};
    CHECK(explain_invalid(good, limits).empty());

    const auto complaint = [&](auto change) {
        CameraSettings s = good;
        change(s);
        return explain_invalid(s, limits);
    };
    CHECK(complaint([](auto& s) { s.region.width = 2048; }) ==
          "Width 2048: allowed 16 to 1024 in steps of 8");
    CHECK(complaint([](auto& s) { s.region.width = 63; }) == "Width 63: allowed 16 to 1024 in steps of 8");
    CHECK(complaint([](auto& s) { s.region.height = 0; }) == "Height 0: allowed 1 to 512 in steps of 1");
    CHECK(complaint([](auto& s) { s.region.x = 968; }) == "OffsetX 968: allowed 0 to 960 in steps of 8");
    CHECK(complaint([](auto& s) { s.region.y = -1; }) == "OffsetY -1: allowed 0 to 448 in steps of 1");
    CHECK(complaint([](auto& s) { s.exposure_ns = 0; }) == "ExposureTime 0 us: allowed 1 to 3600000000");
    CHECK(complaint([](auto& s) { s.gain_db = NAN; }) == "Gain nan dB: allowed 0 to 24");
    CHECK(complaint([](auto& s) { s.frame_rate_hz = 1e9; }) ==
          "AcquisitionFrameRate 1000000000 Hz: allowed 0.01 to 1000");
    CHECK(complaint([](auto& s) { s.trigger_delay_ns = -1; }) ==
          "TriggerDelay -0.001 us: allowed 0 to 10000000");
    CHECK(complaint([](auto& s) { s.acquisition_frame_count = 0; }) ==
          "AcquisitionFrameCount 0: allowed 1 to 4294967295");
}

TEST_CASE("a sequencer set replaces its own features and no others") {
    CameraSettings settings;
    settings.region = {8, 16, 64, 32};
    settings.gain_db = 3;
    Sequence sequence;
    sequence.steps[2] = {5 * ns_per_ms, 6, 100, 24, 40, 0};
    sequence.features = sequenced_exposure | sequenced_offset_x | sequenced_offset_y;
    const CameraSettings changed = with_step(settings, sequence, 2);
    CHECK(changed.exposure_ns == 5 * ns_per_ms);
    CHECK(changed.region == Region{24, 40, 64, 32});
    CHECK(changed.gain_db == 3);
    CHECK(changed.black_level_dn == settings.black_level_dn);
    sequence.features = sequenced_gain | sequenced_black_level;
    CHECK(with_step(settings, sequence, 2).gain_db == 6);
    CHECK(with_step(settings, sequence, 2).black_level_dn == 100);
    CHECK(with_step(settings, sequence, 2).region == settings.region);
}

TEST_CASE("a sequence is checked along the sets that it reaches") {
    CameraLimits limits;
    limits.sensor_width = limits.sensor_height = 64;
    CameraSettings settings;
    settings.region = {0, 0, 32, 32};
    Sequence sequence;
    sequence.steps[2].gain_db = 99;
    sequence.start = 8;
    CHECK(explain_invalid(sequence, settings, limits).empty()); // not enabled
    sequence.enabled = true;
    CHECK(explain_invalid(sequence, settings, limits) == "SequencerSetStart 8: allowed 0 to 7");
    sequence.start = 0;
    sequence.steps[0].next = 1;
    sequence.features = sequenced_gain | sequenced_offset_x;
    CHECK(explain_invalid(sequence, settings, limits).empty()); // set 2 is out of reach
    sequence.steps[1].next = 2;
    CHECK(explain_invalid(sequence, settings, limits) == "sequencer set 2: Gain 99 dB: allowed 0 to 24");
    sequence.steps[2].gain_db = 3;
    sequence.steps[2].next = 8;
    CHECK(explain_invalid(sequence, settings, limits) == "SequencerSetNext 8 of set 2: allowed 0 to 7");
    sequence.steps[2].next = 0;
    sequence.steps[2].offset_x = 32;
    sequence.steps[2].exposure_ns = 1;
    CHECK(explain_invalid(sequence, settings, limits).empty());
    const CameraSettings stepped = with_step(settings, sequence, 2);
    CHECK(stepped.gain_db == 3);
    CHECK(stepped.region.x == 32);
    CHECK(stepped.exposure_ns == settings.exposure_ns); // not a sequenced feature
}

TEST_CASE("several windows are checked one by one and together") {
    CameraLimits limits;
    limits.sensor_width = 64;
    limits.sensor_height = 48;
    limits.windows_max = 4;
    CameraSettings s;
    const auto complaint = [&](std::vector<CameraWindow> windows) {
        s.set_windows(windows);
        return explain_invalid(s, limits);
    };
    const CameraWindow good{{4, 6, 20, 10}, 2'000'000};
    CHECK(complaint({good, good, {{0, 0, 64, 4}, 5'000'000, Sampling::cds, 3}}).empty());
    CHECK(s.window_count() == 3);
    CHECK(s.window(0) == good);
    CHECK(s.region == good.region);
    CHECK(s.window(2).reads == 3);
    CHECK(composed_size(s) == ImageSize{64, 24});
    CHECK(complaint({good, {{60, 0, 5, 5}}}) == "window 1: OffsetX 60: allowed 0 to 59 in steps of 1");
    CHECK(complaint({good, {{0, 0, 5, 0}}}) == "window 1: Height 0: allowed 1 to 48 in steps of 1");
    CHECK(complaint({good, {{0, 0, 5, 5}, -1}}) ==
          "window 1: ExposureTime -0.001 us: allowed 1 to 3600000000");
    CHECK(complaint({{{0, 0, 5, 5}, 1'000'000, Sampling::destructive, 2}}) == "reads 2: allowed 1 to 1");
    CHECK(complaint({good, {{0, 0, 5, 5}, 1'000'000, Sampling::ramp, 1}}) ==
          "window 1: reads 1: allowed 2 to 64");
    CHECK(complaint({good, good, good, good, good}) == "5 windows: allowed 1 to 4");
    CHECK(complaint({good, {{0, 0, 5, 20}, 1'000'000, Sampling::non_destructive, 2}}) ==
          "the windows have 50 rows together: allowed 1 to 48");
    limits.rows_max = 50;
    CHECK(explain_invalid(s, limits).empty());
    // A chip that crops takes windows that reach over the edge.
    CHECK_FALSE(complaint({{{60, 40, 10, 10}, 1'000'000}}).empty());
    limits.strict = false;
    CHECK(explain_invalid(s, limits).empty());
    // Fewer windows leave nothing behind that would count in a comparison.
    CameraSettings one;
    one.set_windows(std::array{good});
    s.set_windows(std::array{good, good});
    s.set_windows(std::array{good});
    CHECK(s == one);
}

} // namespace camera_test
