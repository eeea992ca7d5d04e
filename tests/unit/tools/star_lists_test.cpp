// SPDX-License-Identifier: Apache-2.0
// Star lists: matching, rms and zero point of lists made from known offsets, and bad tables.
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/pictures/star_lists.hpp"

#include <fmt/format.h>

#include <cmath>

namespace star_lists_test {

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;

namespace {

StarList read(std::string_view text, const StarListChoice& choice = {}) {
    const test::TempFolder folder;
    return read_star_list(folder.write("list.csv", text), choice);
}

} // namespace

TEST_CASE("star lists are matched, and give the shift, rms and zero point that they were made with",
          "[stars]") {
    // Shift (0.3, -0.2) px, every other star by 0.1 px more and less to the right; fluxes 2.5 mag below.
    std::string a = "x_px,y_px,V\n", b = "id,x,y,flux\n";
    constexpr int stars = 100;
    for (int i = 0; i < stars; ++i) {
        const double x = 10.0 * (i % 10), y = 10.0 * (i / 10), mag = 3 + 0.05 * i;
        const double wobble = i % 2 == 0 ? 0.1 : -0.1;
        a += fmt::format("{},{},{}\n", x, y, mag);
        b += fmt::format("{},{},{},{}\n", i, x + 0.3 + wobble, y - 0.2,
                         std::pow(10, -0.4 * (mag - 2.5 + (i % 4 < 2 ? 0.05 : -0.05))));
    }
    b += "100,55,55.5,1\n"; // no partner
    const StarAgreement found = compare_star_lists(read(a), read(b), 3);
    CHECK(found.pairs.size() == stars);
    CHECK(found.with_mag == stars);
    CHECK_THAT(found.shift_right, WithinAbs(0.3, 1e-12));
    CHECK_THAT(found.shift_down, WithinAbs(-0.2, 1e-12));
    CHECK_THAT(found.rms, WithinAbs(std::sqrt(0.3 * 0.3 + 0.1 * 0.1 + 0.2 * 0.2), 1e-12));
    CHECK_THAT(found.rms_shifted, WithinAbs(0.1, 1e-12));
    CHECK_THAT(found.largest, WithinAbs(std::hypot(0.4, 0.2), 1e-12));
    CHECK_THAT(found.zero_point, WithinAbs(-2.5, 1e-9));
    CHECK_THAT(found.zero_point_rms, WithinAbs(0.05, 1e-9));
}

TEST_CASE("each star has one partner, the nearest pairs first", "[stars]") {
    const StarAgreement found = compare_star_lists(read("x,y\n0,0\n1,0\n"), read("x,y\n0.9,0\n1.6,0\n"), 2);
    REQUIRE(found.pairs.size() == 2);
    CHECK(found.pairs[0].star == 1); // the other one is nearer to the second star
    CHECK(found.pairs[1].star == 0);
    CHECK(found.with_mag == 0);
    CHECK(compare_star_lists(read("x,y\n0,0\n"), read("x,y\n0,2.5\n"), 2).pairs.empty());
}

TEST_CASE("star lists on the sky are matched across right ascension 0, in arc seconds", "[stars]") {
    const StarAgreement found = compare_star_lists(read("ra_deg,dec_deg\n359.9999,60\n"),
                                                   read("ra_deg,dec_deg\n0.0001,60.0001\n"), 3);
    REQUIRE(found.pairs.size() == 1);
    CHECK_THAT(found.shift_right, WithinAbs(0.0002 * 3600 * 0.5, 1e-9));
    CHECK_THAT(found.shift_down, WithinAbs(0.36, 1e-9));
    CHECK_THROWS_AS(compare_star_lists(read("ra_deg,dec_deg\n1,2\n"), read("x,y\n1,2\n"), 3), InputError);
}

TEST_CASE("rows and the column of brightness are chosen", "[stars]") {
    const std::string table = "frame,kind,x_px,y_px,magnitude_v,signal_e\n"
                              "3,star,1,2,4.5,100\n3,body,5,5,,\n4,star,7,8,5,0\n";
    const StarList all = read(table);
    CHECK(all.brightness == "magnitude_v");
    CHECK(all.stars.size() == 3);
    CHECK(!all.stars[1].mag);
    const StarList one = read(table, {"signal_e", {"frame=3", "kind=star", "colour=blue"}});
    REQUIRE(one.stars.size() == 1);
    CHECK_THAT(one.stars[0].mag.value(), WithinAbs(-5, 1e-12));
    CHECK(!read(table, {"signal_e", {"frame=4"}}).stars.at(0).mag);
}

TEST_CASE("bad star lists are refused by file and line", "[stars]") {
    CHECK_THROWS_WITH(read("x,y\n1,2\nnan,4\n"), Contains("list.csv:3: no position: \"nan\""));
    CHECK_THROWS_WITH(read("x,y\n1\n"), Contains("list.csv:2: 1 fields, the heading has 2"));
    CHECK_THROWS_WITH(read("a,b\n1,2\n"), Contains("list.csv:1: no columns x_px and y_px"));
    CHECK_THROWS_WITH(read("ra_deg,dec_deg\n1,91\n"), Contains("list.csv:2: 1, 91 deg is no position"));
    CHECK_THROWS_WITH(read("x,y\n1,2\n", {"flux", {}}), Contains("no column flux, allowed x, y"));
    CHECK_THROWS_AS(read(""), InputError);
    CHECK_THROWS_AS(read_star_list("/nonexistent", {}), InputError);
    CHECK(!is_star_list("/nonexistent"));
}

} // namespace star_lists_test
