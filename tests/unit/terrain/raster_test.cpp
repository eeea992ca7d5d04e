// SPDX-License-Identifier: Apache-2.0
// Rasters on a body: across seam and poles, over footprints, at holes and edges, and their bounds.
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/maps/raster.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace raster_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr float no_data = std::numeric_limits<float>::quiet_NaN();

class Random {
public:
    double number() { return uniform_(engine_); }
    /// Uniform over the sphere.
    Vec3 direction() {
        const double z = 2 * number() - 1, turn = 2 * pi * number(), rho = std::sqrt(1 - z * z);
        return {rho * std::cos(turn), rho * std::sin(turn), z};
    }

private:
    std::mt19937_64 engine_{7};
    std::uniform_real_distribution<double> uniform_{0, 1};
};

Vec3 direction(double longitude_deg, double latitude_deg) {
    return {std::cos(latitude_deg * degree) * std::cos(longitude_deg * degree),
            std::cos(latitude_deg * degree) * std::sin(longitude_deg * degree),
            std::sin(latitude_deg * degree)};
}

/// Raster of a function of the direction.
template<typename F>
Raster raster_of(const MapFrame& frame, F&& f) {
    std::vector<float> samples;
    for (std::int64_t j = 0; j < frame.height(); ++j)
        for (std::int64_t i = 0; i < frame.width(); ++i)
            samples.push_back(
                static_cast<float>(f(frame.position({static_cast<double>(i), static_cast<double>(j)}))));
    return {std::make_shared<const MemoryPyramid>(frame.width(), frame.height(), std::move(samples)), frame};
}

MapFrame global(std::int64_t width, std::int64_t height, Registration registration = Registration::pixel,
                double left_deg = 0, double right_deg = 360) {
    return MapFrame::by_edges(Projection::of_sphere(ProjectionKind::simple_cylindrical, 1000), registration,
                              width, height, left_deg * degree, right_deg * degree, 90 * degree,
                              -90 * degree);
}

double smooth(Vec3 p) {
    return 1000 * (p.x * p.y + 0.7 * p.z * p.z * p.z - 0.4 * p.y);
}

/// Raster of independent numbers, -1 to 1, on a plane of one metre a pixel.
std::vector<float> noise(std::size_t count, unsigned seed) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> samples(count);
    for (float& v : samples)
        v = uniform(engine);
    return samples;
}

MapFrame plane(std::int64_t width, std::int64_t height) {
    Projection projection;
    projection.kind = ProjectionKind::planar;
    return {projection, {0, 1, 0, 0, 0, -1}, Registration::pixel, width, height};
}

} // namespace

TEST_CASE("A raster is its function across its seam and its poles, in any registration and direction") {
    const MapFrame frames[] = {global(720, 360), global(721, 361, Registration::node, -180, 180),
                               global(720, 360, Registration::pixel, 180, -180),
                               global(723, 361, Registration::pixel, -73, 287)};
    for (const MapFrame& frame : frames) {
        const Raster raster = raster_of(frame, smooth);
        REQUIRE(raster.whole());
        Raster::Reader reader(raster);
        Random any;
        for (int k = 0; k < 4000; ++k) {
            Vec3 p = any.direction();
            if (k % 4 == 1) p = direction(360 * any.number(), std::copysign(90 - 2 * any.number(), p.z));
            if (k % 4 == 2) p = direction(2 * any.number() - 1, 180 * any.number() - 90);
            // Cubics leave a share of (step)^3 of third derivatives of some hundred metres; columns that are
            // means, up to a row wide, a 24th of its square of second derivatives of up to 4000 m.
            REQUIRE_THAT(reader.at(2.5 * p, 0), WithinAbs(smooth(p), std::abs(p.z) > 0.86 ? 0.016 : 0.01));
            // A footprint of some pixels takes the mean over it: a share of its square of second derivatives.
            for (const double pixels : {1.0, 3.7, 8.0, 29.0}) {
                CAPTURE(k, pixels, p.x, p.y, p.z, frame.width());
                const double footprint = pixels * 0.5 * degree;
                // A stretched cubic is off by up to 2 % of a footprint's change; beside a pole the mean is
                // over an arc.
                const double arc = std::abs(p.z) > std::cos(8 * footprint) ? 60 * footprint : 0;
                REQUIRE_THAT(reader.at(p, footprint),
                             WithinAbs(smooth(p), 0.02 + 15 * footprint + 700 * footprint * footprint + arc));
            }
        }
        for (const double z : {1.0, -1.0})
            CHECK_THAT(reader.at({0, 0, z}, 0), WithinAbs(smooth({0, 0, z}), 0.016));
    }
}

TEST_CASE("Samples are met, and between them the slope is continuous") {
    const MapFrame frame = plane(200, 150);
    const auto samples = noise(200 * 150, 1);
    const Raster raster(std::make_shared<const MemoryPyramid>(200, 150, samples), frame);
    Raster::Reader reader(raster);
    for (int k = 0; k < 2000; ++k) {
        const int i = k * 7 % 200, j = k * 13 % 150;
        const Vec3 p = frame.position({static_cast<double>(i), static_cast<double>(j)});
        REQUIRE_THAT(reader.at(p, 0), WithinAbs(samples[static_cast<std::size_t>(j * 200 + i)], 1e-7));
        REQUIRE_THAT(reader.bilinear(p), WithinAbs(samples[static_cast<std::size_t>(j * 200 + i)], 1e-7));
        if (i < 3 || j < 3 || i > 196 || j > 146) continue;
        const double h = 1e-5;
        const double left = reader.at(p, 0) - reader.at({p.x - h, p.y, 0}, 0);
        const double right = reader.at({p.x + h, p.y, 0}, 0) - reader.at(p, 0);
        REQUIRE_THAT(right - left, WithinAbs(0, 1e-8)); // a kink would be of the order of h
    }
    // A bilinear patch by hand.
    const double wanted =
        0.25 * (static_cast<double>(samples[200 * 20 + 30]) + static_cast<double>(samples[200 * 20 + 31]) +
                static_cast<double>(samples[200 * 21 + 30]) + static_cast<double>(samples[200 * 21 + 31]));
    CHECK_THAT(reader.bilinear(frame.position({30.5, 20.5})), WithinAbs(wanted, 1e-7));
}

TEST_CASE("A footprint leaves out what is shorter than it, without jumps") {
    // Stripes of one period in four pixels, and one of 64 pixels.
    const MapFrame frame = plane(1024, 1024);
    for (const double period : {4.0, 64.0}) {
        const auto stripes = [&](Vec3 p) {
            return std::sin(2 * pi * p.x / period) + std::cos(2 * pi * p.y / period);
        };
        const Raster raster = raster_of(frame, stripes);
        Raster::Reader reader(raster);
        double finest = 0, coarsest = 0;
        for (int k = 0; k < 500; ++k) {
            const Vec3 p{300 + 0.73 * k, -300 - 0.31 * k, 0};
            finest = std::max(finest, std::abs(reader.at(p, 0.5) - stripes(p)));
            coarsest = std::max(coarsest, std::abs(reader.at(p, 8)));
        }
        if (period == 4) {
            CHECK(finest < 0.5);
            CHECK(coarsest < 0.02); // half a period per sample: gone
        } else {
            CHECK(finest < 2e-3);
            CHECK(coarsest > 1.6); // eight samples a period: kept
        }
        // Over the range of footprints the value moves smoothly.
        const Vec3 p{511.3, -477.7, 0};
        for (double footprint = 0.5; footprint < 100; footprint *= 1.001)
            REQUIRE_THAT(reader.at(p, 1.001 * footprint) - reader.at(p, footprint), WithinAbs(0, 6e-3));
    }
}

TEST_CASE("Beside a pole the footprint is round, although pixels are narrow") {
    // Independent samples; one that subsamples along longitude would return some of them unaveraged.
    const MapFrame frame = global(1440, 720);
    const Raster raster(std::make_shared<const MemoryPyramid>(1440, 720, noise(1440 * 720, 3)), frame);
    Raster::Reader reader(raster);
    const auto variance = [&](double latitude) {
        double sum = 0;
        for (int k = 0; k < 720; ++k) {
            const double v = reader.at(direction(0.125 + 0.5 * k, latitude), 0.25 * degree);
            sum += v * v / 720;
        }
        return sum;
    };
    // At 85 degrees a footprint has 11.5 pixels, at 89 degrees 57.
    const double equator = variance(0.125);
    CHECK_THAT(equator, WithinAbs(1.0 / 3, 0.04)); // single samples, at their middles
    CHECK(variance(85.125) < equator / 8);
    CHECK(variance(89.125) < equator / 30);
    // All directions of the pole agree, whatever the footprint.
    for (const double footprint : {0.0, 0.25 * degree, 2 * degree})
        for (const double pole : {90.0, -90.0})
            CHECK_THAT(reader.at(direction(0, pole), footprint),
                       WithinAbs(reader.at(direction(77, pole * (1 - 1e-9)), footprint), 1e-7));
}

TEST_CASE("A spherical harmonic stays what it is across the poles, and so does its slope") {
    // Degree 6, order 1, 2 and 3 have values, slopes and saddles at the poles.
    const auto harmonic = [](Vec3 p) {
        const double z2 = p.z * p.z;
        return 100 * (p.x * p.z * (33 * z2 * z2 - 30 * z2 + 5) +
                      (p.x * p.x - p.y * p.y) * (33 * z2 * z2 - 18 * z2 + 1) +
                      p.z * (11 * z2 - 3) * p.x * (p.x * p.x - 3 * p.y * p.y));
    };
    const MapFrame frames[] = {global(720, 360), global(721, 361, Registration::node, -180, 180),
                               global(723, 361, Registration::pixel, -73, 287)};
    for (const MapFrame& frame : frames) {
        const Raster raster = raster_of(frame, harmonic);
        Raster::Reader reader(raster);
        double worst = 0, worst_slope = 0;
        for (int k = 0; k < 4000; ++k) {
            // Around the pole, out to where columns are as far apart as rows are.
            const double turn = 2 * pi * 0.618034 * k, distance = std::exp2(-12.0 * (k % 100) / 100);
            const double side = k % 2 == 0 ? 1 : -1;
            const Vec3 p{std::sin(distance) * std::cos(turn), std::sin(distance) * std::sin(turn),
                         side * std::cos(distance)};
            worst = std::max(worst, std::abs(reader.at(p, 0) - harmonic(p)));
            Vec3 u, v;
            orthonormal_basis(p, u, v);
            const double h = 1e-4;
            const Vec3 ahead = normalized(p + h * u), back = normalized(p - h * u);
            const double slope = (reader.at(ahead, 0) - reader.at(back, 0)) / (2 * h);
            worst_slope =
                std::max(worst_slope, std::abs(slope - (harmonic(ahead) - harmonic(back)) / (2 * h)));
        }
        CAPTURE(frame.width());
        CHECK(worst < 0.15);     // of 800 m, whose second derivatives reach 40,000 m
        CHECK(worst_slope < 15); // of up to 3000 m per radian
    }
}

TEST_CASE("There is one slope at a pole, and nothing is finer along parallels than along meridians") {
    for (const auto& [frame, seed] :
         {std::pair{global(1440, 720), 11U}, std::pair{global(1441, 721, Registration::node), 12U}}) {
        auto samples = noise(static_cast<std::size_t>(frame.width() * frame.height()), seed);
        if (frame.registration() ==
            Registration::node) // its last column is its first, its first row one point
            for (std::int64_t j = 0; j < frame.height(); ++j)
                samples[static_cast<std::size_t>((j + 1) * frame.width() - 1)] =
                    samples[static_cast<std::size_t>(j * frame.width())];
        const Raster raster(std::make_shared<const MemoryPyramid>(frame.width(), frame.height(), samples),
                            frame);
        Raster::Reader reader(raster);
        const double row = 0.25 * degree;
        for (const double side : {1.0, -1.0}) {
            const auto at = [&](double x, double y) { return reader.at(normalized(Vec3{x, y, side}), 0); };
            // Slopes in eight directions are those of one plane.
            const double h = 1e-6 * row, pole = at(0, 0);
            const double a = (at(h, 0) - pole) / h * row, b = (at(0, h) - pole) / h * row;
            for (int k = 1; k < 8; ++k) {
                const double turn = pi / 4 * k, c = std::cos(turn), s = std::sin(turn);
                CHECK_THAT((at(h * c, h * s) - pole) / h * row, WithinAbs(a * c + b * s, 1e-4));
            }
        }
        // Mean squared slopes along parallels and meridians, per row.
        for (const double latitude : {89.7, 89.0, 87.0, 80.0, 70.0, -89.4, -84.0}) {
            double along = 0, down = 0;
            const int count = 4000;
            for (int k = 0; k < count; ++k) {
                const double longitude = 360 * 0.618034 * k;
                const Vec3 p = direction(longitude, latitude + 0.25 * (k % 16) / 16.0);
                const Vec3 east{-std::sin(longitude * degree), std::cos(longitude * degree), 0};
                const Vec3 north = cross(p, east);
                const double h = 0.02 * row;
                const auto slope = [&](Vec3 d) {
                    return (reader.at(normalized(p + h * d), 0) - reader.at(normalized(p - h * d), 0)) / 0.04;
                };
                along += slope(east) * slope(east) / count;
                down += slope(north) * slope(north) / count;
            }
            INFO("latitude " << latitude << ": " << std::sqrt(along / down));
            // Columns of 3/4 of a row: independent samples make these about 1.3 times as steep; less so near
            // 70 degrees, from where columns are taken together. Without that it is 21 at 89 degrees.
            CHECK(std::sqrt(along / down) < (std::abs(latitude) < 82 ? 2.9 : 1.9));
            CHECK(std::sqrt(along / down) > 0.5);
        }
    }
}

TEST_CASE("Samples without data give nothing, and their neighbours something") {
    std::vector<float> samples(64 * 64, 5.0F);
    for (int j = 20; j < 30; ++j)
        for (int i = 20; i < 30; ++i)
            samples[static_cast<std::size_t>(64 * j + i)] = no_data;
    const MapFrame frame = plane(64, 64);
    const auto pyramid = std::make_shared<const MemoryPyramid>(64, 64, samples);
    CHECK(pyramid->missing() == 100);
    const Raster raster(pyramid, frame);
    CHECK_FALSE(raster.whole());
    Raster::Reader reader(raster);
    for (int k = 0; k < 4000; ++k) {
        const double x = 0.0161 * k, y = std::fmod(7.77 * k, 63.0);
        const auto i = static_cast<int>(std::lround(x)), j = static_cast<int>(std::lround(y));
        const double v = reader.at(frame.position({x, y}), 0);
        const bool hole = i >= 20 && i < 30 && j >= 20 && j < 30;
        if (x < 63) REQUIRE(std::isnan(v) == hole);
        if (!hole && x < 63) REQUIRE_THAT(v, WithinAbs(5, 1e-9));
        const double wide = reader.at(frame.position({x, y}), 3);
        if (!hole && x < 63) REQUIRE_THAT(wide, WithinAbs(5, 1e-9));
    }
    // Beyond the edges.
    CHECK(std::isnan(reader.at({-0.1, -5, 0}, 0)));
    CHECK(std::isnan(reader.at({5, 0.1, 0}, 0)));
    CHECK_THAT(reader.at({0.1, -0.1, 0}, 0), WithinAbs(5, 1e-9));
}

TEST_CASE("No value lies outside of the bounds of its area") {
    Random any;
    const MapFrame frames[] = {global(256, 128), global(257, 129, Registration::node, 10, -350),
                               MapFrame(Projection::of_sphere(ProjectionKind::south_polar_stereographic, 1),
                                        {-0.3, 0.004, 0, 0.4, 0, -0.004}, Registration::pixel, 150, 200)};
    for (const MapFrame& frame : frames) {
        // Smooth but for one part, so that the bounds differ between places.
        auto samples = noise(static_cast<std::size_t>(frame.width() * frame.height()), 9);
        for (std::size_t i = 0; i < samples.size(); ++i)
            if (static_cast<std::int64_t>(i) / frame.width() > frame.height() / 3) samples[i] *= 0.01F;
        const Raster raster(std::make_shared<const MemoryPyramid>(frame.width(), frame.height(), samples),
                            frame);
        Raster::Reader reader(raster);
        int tight = 0;
        for (int k = 0; k < 400; ++k) {
            const double radius = std::exp2(-10 * any.number());
            Vec3 centre = any.direction();
            if (k % 3 == 0) centre = normalized(Vec3{0.3 * centre.x, 0.3 * centre.y, -1});
            if (k % 7 == 0) centre = {0, 0, k % 2 == 0 ? 1.0 : -1.0};
            const double footprint = any.number() < 0.5 ? 0 : 0.1 * any.number();
            const SampleRange range = raster.range(raster.area(centre, radius), centre, radius, footprint);
            if (range.largest - range.least < 1) ++tight;
            Vec3 u, v;
            orthonormal_basis(centre, u, v);
            for (int n = 0; n < 200; ++n) {
                const double angle = radius * std::sqrt(any.number()), turn = 2 * pi * any.number();
                const Vec3 p =
                    std::cos(angle) * centre + std::sin(angle) * (std::cos(turn) * u + std::sin(turn) * v);
                const double value = reader.at(p, footprint * any.number());
                if (std::isnan(value)) continue;
                CAPTURE(k, n, radius, footprint, centre.x, centre.y, centre.z);
                REQUIRE(value >= static_cast<double>(range.least));
                REQUIRE(value <= static_cast<double>(range.largest));
            }
        }
        CHECK(tight > 3);
    }
}

TEST_CASE("Rasters that cannot be are refused") {
    const auto pyramid = std::make_shared<const MemoryPyramid>(8, 4, std::vector<float>(32, 1.0F));
    CHECK_THROWS_WITH(Raster(pyramid, plane(9, 4)), ContainsSubstring("8 x 4 samples in a map of 9 x 4"));
    const double step = 2 * pi * 1000 / 7.4;
    const MapFrame uneven(Projection::of_sphere(ProjectionKind::simple_cylindrical, 1000),
                          {0, step, 0, 0, 0, -1}, Registration::pixel, 8, 4);
    CHECK_THROWS_WITH(Raster(pyramid, uneven), ContainsSubstring("no whole number"));
}

} // namespace raster_test
