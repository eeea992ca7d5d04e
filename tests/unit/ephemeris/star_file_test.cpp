// SPDX-License-Identifier: Apache-2.0
// Star catalogue file against what was written, cones against all stars, and damaged files.
#include "core/error.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <erfa.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

namespace star_file_test {

using namespace obscura;
using namespace obscura::ephemeris;

namespace {

constexpr double mas = std::numbers::pi / (180 * 3600e3);

/// Stars over the whole sky, some at poles, corners and edges of the cube, with all kinds of numbers.
std::vector<CatalogueStar> some_stars(std::size_t count) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    std::vector<CatalogueStar> stars;
    for (const Vec3 special : {Vec3{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {1, 1, 1}, {-1, -1, 1}, {1, 0, -1}}) {
        CatalogueStar star;
        star.direction = normalized(special);
        stars.push_back(star);
    }
    while (stars.size() < count) {
        CatalogueStar star;
        star.direction = normalized(Vec3{normal(random), normal(random), normal(random)});
        star.motion_ra_mas_yr = 100 * normal(random);
        star.motion_dec_mas_yr = -3000 * normal(random);
        star.parallax_mas = 700 * uniform(random);
        star.magnitude_v = -1.5 + 12 * uniform(random);
        if (stars.size() % 3 != 0) star.colour_b_v = -0.4 + 2 * uniform(random);
        if (stars.size() % 2 != 0) {
            star.type_number = std::floor(700 * uniform(random)) / 100;
        }
        star.luminosity = static_cast<Luminosity>(stars.size() / 2 % 4);
        star.ids = static_cast<StarIds>(stars.size() % 5);
        star.id = random();
        stars.push_back(star);
    }
    return stars;
}

const CatalogueStar* nearest(const std::vector<CatalogueStar>& stars, Vec3 direction) {
    return &*std::min_element(stars.begin(), stars.end(), [&](const auto& a, const auto& b) {
        return length_squared(a.direction - direction) < length_squared(b.direction - direction);
    });
}

/// The refusal of the bytes as a file; empty: it is read.
std::string refusal(const std::vector<std::byte>& bytes) {
    try {
        const StarFile file(bytes, "stars");
        return {};
    } catch (const InputError& error) {
        return error.what();
    }
}

} // namespace

TEST_CASE("a star catalogue file gives back the stars that were written", "[stars]") {
    const std::vector<CatalogueStar> stars = some_stars(3000);
    const std::vector<std::byte> bytes = star_file_bytes(stars, "made by a test", 10.5);
    CHECK(bytes.size() / stars.size() <= 40);
    const test::TempFolder folder;
    const auto path = folder.path() / "test.obstars";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    CHECK(StarFile::is_one(path));
    const StarFile file{path};
    REQUIRE(file.size() == stars.size());
    CHECK(file.intact());
    CHECK(file.source() == "made by a test");
    CHECK(file.complete_v() == 10.5);
    double motion = 0;
    for (std::uint32_t i = 0; i < file.size(); ++i) {
        const CatalogueStar star = file.star(i);
        const CatalogueStar& was = *nearest(stars, star.direction);
        CHECK(length(star.direction - was.direction) < 0.071 * mas);
        CHECK(std::abs(length(star.direction) - 1) < 1e-15);
        CHECK(std::abs(star.motion_ra_mas_yr - was.motion_ra_mas_yr) < 0.000501);
        CHECK(std::abs(star.motion_dec_mas_yr - was.motion_dec_mas_yr) < 0.000501);
        CHECK(std::abs(star.parallax_mas - was.parallax_mas) < 0.000501);
        CHECK(std::abs(star.magnitude_v - was.magnitude_v) < 0.000501);
        CHECK(std::isnan(star.colour_b_v) == std::isnan(was.colour_b_v));
        CHECK(!(std::abs(star.colour_b_v - was.colour_b_v) > 0.000501));
        CHECK(std::isnan(star.type_number) == std::isnan(was.type_number));
        CHECK(!(std::abs(star.type_number - was.type_number) > 1e-9));
        CHECK(star.luminosity == was.luminosity);
        CHECK(star.ids == was.ids);
        CHECK(star.id == was.id);
        motion = std::max(motion, std::hypot(was.motion_ra_mas_yr, was.motion_dec_mas_yr));
        CHECK(file.brightest_v() <= star.magnitude_v);
        CHECK(file.faintest_v() >= star.magnitude_v);
    }
    CHECK(file.largest_motion_mas_yr() >= motion);
    CHECK(file.largest_motion_mas_yr() < motion + 0.002);
}

TEST_CASE("a cone finds the stars that a look at all of them finds", "[stars]") {
    const std::vector<CatalogueStar> stars = some_stars(30000);
    const StarFile file(star_file_bytes(stars, "", {}), "stars");
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::vector<std::uint32_t> found(stars.size());
    std::vector<Vec3> axes{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {1, 1, 1}, {-1, 1, -1}, {0, 1, 1}};
    for (int i = 0; i < 40; ++i)
        axes.push_back({normal(random), normal(random), normal(random)});
    for (const Vec3 axis : axes)
        for (const double half_deg : {0.0, 0.01, 0.5, 3.0, 10.0, 45.0, 89.0, 130.0, 179.9, 180.0})
            for (const double limit_v : {4.0, 40.0}) {
                const SkyCells::Cone cone{normalized(axis), half_deg * std::numbers::pi / 180};
                const std::size_t count = file.find(cone, limit_v, found);
                std::vector<std::uint32_t> seen(found.begin(),
                                                found.begin() + static_cast<std::ptrdiff_t>(count));
                std::sort(seen.begin(), seen.end());
                std::vector<std::uint32_t> wanted;
                for (std::uint32_t i = 0; i < file.size(); ++i)
                    if (file.magnitude_v(i) <= limit_v &&
                        std::atan2(length(cross(cone.axis, file.direction(i))),
                                   dot(cone.axis, file.direction(i))) <= cone.half_angle_rad)
                        wanted.push_back(i);
                // At the very edge the two sums may differ.
                std::vector<std::uint32_t> differ;
                std::set_symmetric_difference(seen.begin(), seen.end(), wanted.begin(), wanted.end(),
                                              std::back_inserter(differ));
                for (const std::uint32_t i : differ)
                    CHECK(std::abs(std::atan2(length(cross(cone.axis, file.direction(i))),
                                              dot(cone.axis, file.direction(i))) -
                                   cone.half_angle_rad) < 2e-6);
            }
    // A buffer that is too short gets the first ones; the count is that of all.
    const SkyCells::Cone cone{{1, 0, 0}, 0.5};
    const std::size_t count = file.find(cone, 40, found);
    std::vector<std::uint32_t> few(10);
    CHECK(file.find(cone, 40, few) == count);
    CHECK(std::equal(few.begin(), few.end(), found.begin()));
}

TEST_CASE("proper motion and parallax of stars agree with ERFA", "[stars]") {
    for (const double ra : {0.1, 2.0, 5.5})
        for (const double dec : {-1.4, -0.3, 0.0, 1.2}) {
            CatalogueStar star;
            star.direction = direction_of(ra, dec);
            star.motion_ra_mas_yr = -3775.4;
            star.motion_dec_mas_yr = 10328.1;
            double moved[3] = {};
            double no_observer[3] = {};
            // Light travel time to the observer is 0 here; ERFA's rate of right ascension is without cosine.
            eraPmpx(ra, dec, star.motion_ra_mas_yr * mas / std::cos(dec), star.motion_dec_mas_yr * mas, 0, 0,
                    26.5, no_observer, moved);
            CHECK(length(direction_at(star, 26.5, {}) - Vec3{moved[0], moved[1], moved[2]}) < 1e-3 * mas);
            star.motion_ra_mas_yr = star.motion_dec_mas_yr = 0;
            star.parallax_mas = 768;
            double observer[3] = {0.3, -0.9, 0.4};
            eraPmpx(ra, dec, 0, 0, star.parallax_mas * 1e-3, 0, 0, observer, moved);
            CHECK(length(direction_at(star, 0, {0.3, -0.9, 0.4}) - Vec3{moved[0], moved[1], moved[2]}) <
                  1e-3 * mas);
        }
}

TEST_CASE("a star catalogue file that is cut or changed is refused or gives finite numbers", "[stars]") {
    const std::vector<std::byte> good = star_file_bytes(some_stars(300), "x", {});
    REQUIRE(refusal(good).empty());
    for (std::size_t size = 0; size < good.size(); size += size < 600 ? 1 : 97)
        CHECK_THAT(refusal({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}),
                   Catch::Matchers::StartsWith("stars: byte "));
    const std::size_t index_end = 256 + 4 * (6 * 4 * 4 + 1);
    std::mt19937 random(7);
    for (std::size_t at = 0; at < good.size(); at += at < index_end ? 1 : 11) {
        std::vector<std::byte> bad = good;
        bad[at] ^= static_cast<std::byte>(1 + random() % 255);
        if (at < index_end && (at < 60 || at >= 64)) CHECK(!refusal(bad).empty());
        if (!refusal(bad).empty()) continue;
        const StarFile file(bad, "stars");
        CHECK(!file.intact());
        for (std::uint32_t i = 0; i < file.size(); ++i) {
            const CatalogueStar star = file.star(i);
            CHECK(is_finite(direction_at(star, 30, {1, 0, 0})));
            CHECK(std::isfinite(star.magnitude_v));
            CHECK(!(star.type_number < 0));
            CHECK(!(star.type_number >= 7));
        }
    }
    CHECK_THAT(refusal(std::vector<std::byte>(1000)), Catch::Matchers::Contains("begins with \"OBSTARS\""));
}

TEST_CASE("stars that a record cannot hold are refused by their place", "[stars]") {
    std::vector<CatalogueStar> stars(3);
    stars[2].magnitude_v = 33;
    CHECK_THROWS_WITH(star_file_bytes(stars, "", {}), Catch::Matchers::StartsWith("star 3: V 33"));
    stars[2].magnitude_v = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(star_file_bytes(stars, "", {}), InputError);
    stars[2].magnitude_v = 3;
    stars[1].direction = {0, 0, 0};
    CHECK_THROWS_WITH(star_file_bytes(stars, "", {}), Catch::Matchers::StartsWith("star 2: "));
}

} // namespace star_file_test
