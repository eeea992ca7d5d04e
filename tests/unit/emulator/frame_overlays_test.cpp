// SPDX-License-Identifier: Apache-2.0
// Times of a frame's scene, and hot pixels.
#include "emulator/camera/frame_overlays.hpp"
#include "sensors/fixed_pattern.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <vector>

namespace frame_overlays_test {

using namespace obscura;
using emulator::PixelPlace;

TEST_CASE("time of the scene follows the frame's clock and rate", "[emulator][truth]") {
    emulator::FrameScene scene;
    scene.origin.scene_to_clock_ns = 5'000;
    scene.origin.shown = {Time{100}, Time{70'000}, 0.5};
    CHECK(scene.at(Time{5'100}) == Time{70'000});
    CHECK(scene.at(Time{7'100}) == Time{71'000});
}

TEST_CASE("hot pixels are the stuck and those of high dark current, the hottest first", "[emulator][truth]") {
    SensorDescription d;
    d.readout.width = 120;
    d.readout.height = 90;
    d.detector.dark_current_e_per_s = 4;
    d.detector.dark_nonuniformity_e_per_s = 1;
    d.detector.hot_fraction = 0.01;
    d.detector.hot_current_e_per_s = 200;
    d.detector.stuck_fraction = 0.001;
    const sensors::FixedPattern pattern(d);
    const std::vector<PixelPlace> all = emulator::hot_pixels(pattern, d.detector, 100'000);
    const auto stuck = [&](const PixelPlace& at) {
        const auto row = pattern.stuck.row(at.y);
        return std::any_of(row.begin(), row.end(),
                           [&at](const sensors::StuckPixel& p) { return p.x == at.x && p.dn >= 2048; });
    };
    const auto dark = [&](const PixelPlace& at) { return *pattern.row_of(pattern.dark_e_per_s, at.y, at.x); };
    std::size_t wanted = 0, wanted_stuck = 0;
    for (std::int32_t y = 0; y < 90; ++y)
        for (std::int32_t x = 0; x < 120; ++x) {
            const PixelPlace at{x, y};
            const auto row = pattern.stuck.row(y);
            const bool low =
                !stuck(at) && std::any_of(row.begin(), row.end(), [x](const auto& p) { return p.x == x; });
            const bool is_stuck = stuck(at), hot = is_stuck || (dark(at) >= 40 && !low);
            wanted += hot ? 1 : 0;
            wanted_stuck += is_stuck ? 1 : 0;
            CHECK((std::find(all.begin(), all.end(), at) != all.end()) == hot);
        }
    CHECK(wanted_stuck > 0);
    CHECK(all.size() == wanted);
    CHECK(std::all_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(wanted_stuck), stuck));
    for (std::size_t i = wanted_stuck + 1; i < all.size(); ++i)
        CHECK(dark(all[i - 1]) >= dark(all[i]));
    const std::vector<PixelPlace> few = emulator::hot_pixels(pattern, d.detector, 12);
    CHECK(few == std::vector<PixelPlace>(all.begin(), all.begin() + 12));
    CHECK(emulator::hot_pixels(sensors::FixedPattern(SensorDescription{}), DetectorSettings{}, 10).empty());
}

} // namespace frame_overlays_test
