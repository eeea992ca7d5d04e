// SPDX-License-Identifier: Apache-2.0
#include "core/camera/image_pattern.hpp"
#include "tests/support/catch.hpp"

#include <array>

namespace image_pattern_test {

using namespace obscura;

TEST_CASE("test patterns are what SFNC says, and the same in a window as on the whole sensor") {
    const auto row = [](ImagePattern pattern, std::uint64_t id, std::int32_t x, std::int32_t y) {
        std::array<std::uint16_t, 3> pixels{9, 9, 9};
        fill_pattern(pattern, id, x, y, 12, pixels);
        return pixels;
    };
    using Row = std::array<std::uint16_t, 3>;
    CHECK(row(ImagePattern::black, 5, 0, 0) == Row{0, 0, 0});
    CHECK(row(ImagePattern::white, 5, 0, 0) == Row{4095, 4095, 4095});
    CHECK(row(ImagePattern::horizontal_ramp, 5, 4094, 7) == Row{4094, 4095, 0});
    CHECK(row(ImagePattern::vertical_ramp, 5, 4, 4097) == Row{1, 1, 1});
    CHECK(row(ImagePattern::horizontal_ramp_moving, 5, 10, 0) == Row{15, 16, 17});
    CHECK(row(ImagePattern::vertical_ramp_moving, 5, 10, 20) == Row{25, 25, 25});
    CHECK(row(ImagePattern::frame_counter, 4096 + 77, 1, 2) == Row{77, 77, 77});
}

} // namespace image_pattern_test
