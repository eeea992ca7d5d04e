// SPDX-License-Identifier: Apache-2.0
// Times of rows and pixels in SuMoL, and scanning devices, by the published client.
#include "tests/unit/tools/compatible_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace compatible_timing_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr const char* rolling =
    "parameter line 0.001;\n"
    "scalar reset(scalar row, scalar exposure) { return row * line; }\n"
    "scalar read(scalar row, scalar exposure) { return reset(row, exposure) + exposure; }\n";
constexpr const char* scan =
    "parameter pixel 1e-4;\n"
    "scalar reset(scalar row, scalar column, scalar exposure) { return (row * columns + column) * pixel; }\n"
    "scalar read(scalar row, scalar column, scalar exposure) { return reset(row, column, exposure) + exposure; }\n";

void moving_ball(Client& client) {
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 2, {-0.6, 0, -20});
    client.size(64, 64);
    client.fov_deg(20, 20);
    client.samples(16);
    client.call("setIntegrationTime", {{"integration_time", 0.002}});
    client.call("setObjectMotion",
                {{"object_name", "ball"}, {"motion", List{List{2.0, 0, 0}, List{0, 0, 0}}}});
    client.call("enableTimeMapping", {{"b_enable", true}});
}

} // namespace

TEST_CASE("times in SuMoL that are those of a rolling shutter make its picture", "[serve]") {
    Client client;
    moving_ball(client);
    client.write("rolling.tim", rolling);
    client.call("loadTimeSamplingModel",
                {{"filename", "rolling_shutter"}, {"parameters", Fields{{"line_addressing_time", 0.01}}}});
    client.call("render");
    const std::vector<float> gray = client.numbers("getImageGray32F"), times = client.numbers("getTimeMap");
    client.call("loadTimeSamplingModel",
                {{"filename", "rolling.tim"}, {"parameters", Fields{{"line", 0.01}}}});
    client.call("render");
    CHECK(client.numbers("getImageGray32F") == gray);
    const std::vector<float> own = client.numbers("getTimeMap");
    REQUIRE(own.size() == times.size());
    for (std::size_t i = 0; i < own.size(); ++i)
        REQUIRE_THAT(own[i], WithinAbs(static_cast<double>(times[i]), 1e-6));
    client.call("loadTimeSamplingModel", {{"filename", ""}, {"parameters", Fields{}}});
    client.call("render");
    CHECK(client.numbers("getImageGray32F") != gray);
    CHECK(client.numbers("getTimeMap").front() == 0.001F);
}

TEST_CASE("pixels of a scanned picture are lit at the times of the time map", "[serve]") {
    Client client;
    moving_ball(client);
    client.write("scan.tim", scan);
    client.call("loadTimeSamplingModel", {{"filename", "scan.tim"}, {"parameters", Fields{}}});
    client.call("render");
    const std::vector<float> gray = client.numbers("getImageGray32F"), times = client.numbers("getTimeMap");
    const double f_px = 32 / std::tan(10 * pi / 180);
    for (const std::size_t row : {26U, 32U, 38U}) {
        const auto begin = (63 - row) * 64;
        for (std::size_t column = 0; column < 64; ++column)
            REQUIRE_THAT(static_cast<double>(times[begin + column]),
                         WithinAbs(0.001 + 1e-4 * static_cast<double>(row * 64 + column), 1e-6));
        const auto from = gray.begin() + static_cast<std::ptrdiff_t>(begin);
        const Light seen = light_of({from, from + 64}, 64);
        // Where the middle of the ball is when its pixel is lit: at t = (row 64 + c) dt.
        const double v = 2 * f_px / 20, dt = 1e-4;
        const double c =
            (31.5 - f_px * 0.6 / 20 + v * (0.001 + dt * static_cast<double>(row * 64))) / (1 - v * dt);
        CHECK_THAT(seen.column, WithinAbs(c + 0.5, 0.12));
    }
}

TEST_CASE("a scanning device sees with one pixel, at the time of each pixel of its picture", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    const double distance_m = 20, towards = 0.1, radius_m = 1;
    client.ball("ball", radius_m, {distance_m * std::sin(towards), 0, -distance_m * std::cos(towards)});
    client.size(40, 5);
    client.fov_deg(0.01, 0.01);
    client.samples(4);
    client.write("sky.txt", "1\n0 0 -1 1 1 1 1\n");
    client.call("setBackground", {{"background", "sky.txt"}});
    client.write("scan.tim", scan);
    client.call("loadTimeSamplingModel",
                {{"filename", "scan.tim"}, {"parameters", Fields{{"pixel", 0.005}}}});
    // The camera turns to the right by 0.2 rad in a second.
    client.write("turn.csv", fmt::format("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n"
                                         "1,0,0,0,{:.17g},0,{:.17g},0\n",
                                         std::cos(0.1), std::sin(0.1)));
    client.call("loadMotionModel", {{"filename", "turn.csv"}, {"parameters", Fields{}}});
    client.call("setIntegrationTime", {{"integration_time", 1e-6}});
    client.call("enableTimeMapping", {{"b_enable", true}});
    client.call("enableScanningDeviceMode", {{"enable", true}});
    client.call("render");
    const std::vector<float> gray = client.numbers("getImageGray32F"), times = client.numbers("getTimeMap");
    const std::vector<double> depth = client.numbers<double>("getDepthMap");
    REQUIRE(gray.size() == 200);
    int lit = 0;
    for (std::size_t row = 0; row < 5; ++row)
        for (std::size_t column = 0; column < 40; ++column) {
            const std::size_t i = (4 - row) * 40 + column;
            const double t = 0.005 * static_cast<double>(row * 40 + column);
            CAPTURE(row, column);
            REQUIRE_THAT(static_cast<double>(times[i]), WithinAbs(t + 0.5e-6, 1e-7));
            const double off = 0.2 * (t + 0.5e-6) - towards;
            const double across_m = distance_m * std::sin(off);
            REQUIRE((gray[i] > 0) == (std::abs(across_m) < radius_m));
            if (std::abs(across_m) >= radius_m) {
                REQUIRE(std::isinf(depth[i]));
                continue;
            }
            ++lit;
            REQUIRE_THAT(depth[i], WithinRel(distance_m * std::cos(off) -
                                                 std::sqrt(radius_m * radius_m - across_m * across_m),
                                             1e-6));
        }
    CHECK(lit > 95);
    CHECK(*client.ask("getScanningDeviceMode", "enable").as<bool>());
    // The same detector on the star: it is left out.
    client.call("loadMotionModel", {{"filename", ""}, {"parameters", Fields{}}});
    client.call("render");
    const std::vector<float> dark = client.numbers("getImageGray32F");
    CHECK(std::all_of(dark.begin(), dark.end(), [](float v) { return v == 0; }));
    client.call("enableScanningDeviceMode", {{"enable", false}});
    client.irradiance(true);
    client.call("render");
    const std::vector<float> star = client.numbers("getImageGray32F");
    CHECK(*std::max_element(star.begin(), star.end()) > 0);
}

TEST_CASE("mistakes in times are told by the call that brings them", "[serve]") {
    Client client;
    client.size(16, 16);
    client.write("bad.tim", "scalar reset(scalar row, scalar exposure) { return 0; }\n");
    client.refuse("loadTimeSamplingModel", {{"filename", "bad.tim"}, {"parameters", Fields{}}},
                  "the function scalar read(scalar row");
    client.write("rolling.tim", rolling);
    client.refuse("loadTimeSamplingModel", {{"filename", "other.lua"}, {"parameters", Fields{}}},
                  "files that end in .tim");
    client.call("loadTimeSamplingModel",
                {{"filename", "rolling.tim"}, {"parameters", Fields{{"line", 100.0}}}});
    client.refuse("render", {}, "at most 1000 s");
}

} // namespace compatible_timing_test
