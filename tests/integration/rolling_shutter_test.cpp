// SPDX-License-Identifier: Apache-2.0
// A star field that turns before a rolling shutter: every star where the time of its row puts it.
#include "emulator/config/daemon_config.hpp"
#include "emulator/unit/assemble.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace rolling_shutter_test {

using namespace obscura;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double rate_rad_s = 1 * degree;
constexpr double focal_px = 47.7e-3 / 18e-6; // the optics of the HAS2's star tracker heads
constexpr std::int32_t size = 1024;

struct Point {
    double x, y; ///< pixels, from the outer corner of pixel (0, 0)
};

/// Where the camera sees, at `seconds`, what stood at `at_zero` at time 0: it turns about its y axis.
Point seen_at(Point at_zero, double seconds) {
    const double x = (at_zero.x - size / 2.0) / focal_px, y = (at_zero.y - size / 2.0) / focal_px;
    const double c = std::cos(rate_rad_s * seconds), s = std::sin(rate_rad_s * seconds);
    const double z = c + s * x;
    return {size / 2.0 + focal_px * (c * x - s) / z, size / 2.0 + focal_px * y / z};
}

/// 144 stars over the field, none in step with the pixels.
std::vector<Point> star_places() {
    std::vector<Point> places;
    for (int row = 0; row < 12; ++row)
        for (int column = 0; column < 12; ++column)
            places.push_back({60.3 + 79.17 * column + 1.37 * row, 45.1 + 84.53 * row + 0.73 * column});
    return places;
}

/// Without what would pull at a centroid by itself: fixed patterns, dark current, particles. All timing, and
/// the crosstalk, are the HAS2's.
std::filesystem::path write_bench(const test::TempFolder& folder) {
    std::string stars = "ra_deg,dec_deg,v_mag,b_v\n";
    for (const Point& p : star_places()) {
        const double x = (p.x - size / 2.0) / focal_px, y = (p.y - size / 2.0) / focal_px;
        stars += fmt::format("{:.9f},{:.9f},4.5,0.6\n", std::fmod(std::atan2(y, x) / degree + 360, 360.0),
                             std::atan2(1, std::hypot(x, y)) / degree);
    }
    folder.write("stars.csv", stars);
    std::string turn = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n";
    for (int i = -2; i <= 8; ++i) {
        const double half = rate_rad_s * 0.25 * i / 2;
        turn += fmt::format("{},0,0,0,{:.17g},0,{:.17g},0\n", 0.25 * i, std::cos(half), std::sin(half));
    }
    folder.write("turn.csv", turn);
    folder.write("scene.toml", R"(
[sun]
direction = [0, 0, -1]
distance_au = 1
[stars]
catalogue = "stars.csv"
limiting_magnitude = 6
[camera]
focal_length_mm = 47.7
aperture_mm = 34
psf_sigma_px = 0.8
trajectory = "turn.csv"
)");
    return folder.write("c.toml", fmt::format(R"(
[scene]
file = "scene.toml"
[camera]
exposure_us = 66000
[gige]
enabled = false
[sensor]
file = "{}/config/sensors/has2.toml"
[sensor.detector]
prnu_local = 0
prnu_global = 0
dark_current_e_per_s = 0
dark_nonuniformity_e_per_s = 0
hot_fraction = 0
rts_fraction = 0
hit_flux_per_cm2_s = 0
dead_fraction = 0
stuck_fraction = 0
)",
                                              OBSCURA_SOURCE_DIR));
}

Point centroid(const FrameRef& frame, Point near) {
    constexpr int reach = 6;
    const auto cx = static_cast<int>(near.x), cy = static_cast<int>(near.y);
    double sum = 0, x_sum = 0, y_sum = 0;
    for (int y = cy - reach; y <= cy + reach; ++y)
        for (int x = cx - reach; x <= cx + reach; ++x) {
            const double e =
                double{frame->pixel_truth()
                           ->mean_e[static_cast<std::size_t>(y) * size + static_cast<std::size_t>(x)]};
            sum += e;
            x_sum += e * (x + 0.5);
            y_sum += e * (y + 0.5);
        }
    REQUIRE(sum > 1000);
    return {x_sum / sum, y_sum / sum};
}

} // namespace

TEST_CASE("a star field that turns at 1 deg/s is skewed as the times of the rows say") {
    const test::TempFolder folder;
    emulator::Imaging imaging(emulator::load_config(write_bench(folder)), 1, {}, {.pixels = true});
    const FrameRef frame = imaging.pool->acquire();
    REQUIRE(imaging.maker->make(imaging.nominal_order(1), *frame).empty());
    const auto rows = frame->row_times();
    REQUIRE(rows[1023].read - rows[0].read == 1023 * 212'800);

    constexpr int bands = 8;
    double worst[bands] = {}, unskewed[bands] = {};
    int stars[bands] = {};
    const double frame_mid_s = to_seconds(midpoint(rows[0].reset, rows[1023].read).ns);
    for (const Point& place : star_places()) {
        // The row decides the time and the time the row: two steps are more than enough.
        Point predicted = place;
        for (int i = 0; i < 3; ++i) {
            const auto row = static_cast<std::size_t>(predicted.y);
            predicted = seen_at(place, to_seconds(rows[row].mid().ns));
        }
        const Point found = centroid(frame, predicted);
        const Point frozen = seen_at(place, frame_mid_s);
        const int band = static_cast<int>(predicted.y) * bands / size;
        worst[band] = std::max(worst[band], std::hypot(found.x - predicted.x, found.y - predicted.y));
        unskewed[band] = std::max(unskewed[band], std::abs(found.x - frozen.x));
        ++stars[band];
    }
    for (int band = 0; band < bands; ++band) {
        CAPTURE(band, stars[band], unskewed[band]);
        REQUIRE(stars[band] >= 12);
        CHECK(worst[band] < 0.05);
    }
    // Ten pixels from the first row to the last: without the row times the outer bands would be far off.
    CHECK(unskewed[0] > 3.5);
    CHECK(unskewed[bands - 1] > 3.5);
}

} // namespace rolling_shutter_test
