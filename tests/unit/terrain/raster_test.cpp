// SPDX-License-Identifier: Apache-2.0
// Rasters on a body: across seam and poles, over footprints, at holes and edges, and their bounds.
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/maps/raster.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

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
            // Cubics leave a share of (step)^3 of third derivatives of some hundred metres; within half a row
            // of a pole the mean of the row takes over.
            const bool polar = std::abs(p.z) > std::cos(0.5 * degree);
            REQUIRE_THAT(reader.at(2.5 * p, 0), WithinAbs(smooth(p), polar ? 0.5 : 0.01));
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
            CHECK_THAT(reader.at({0, 0, z}, 0), WithinAbs(smooth({0, 0, z}), 0.5));
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
        double most_fine = 0, most_coarse = 0;
        for (int k = 0; k < 500; ++k) {
            const Vec3 p{300 + 0.73 * k, -300 - 0.31 * k, 0};
            most_fine = std::max(most_fine, std::abs(reader.at(p, 0.5) - stripes(p)));
            most_coarse = std::max(most_coarse, std::abs(reader.at(p, 8)));
        }
        if (period == 4) {
            CHECK(most_fine < 0.5);
            CHECK(most_coarse < 0.02); // half a period per sample: gone
        } else {
            CHECK(most_fine < 2e-3);
            CHECK(most_coarse > 1.6); // eight samples a period: kept
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
                       WithinAbs(reader.at(direction(77, pole * (1 - 1e-9)), footprint), 1e-9));
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
