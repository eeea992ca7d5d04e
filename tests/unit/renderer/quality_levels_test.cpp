// SPDX-License-Identifier: Apache-2.0
// Quality levels of rows: the same levels give the same bytes, however the frame is rendered; what each costs
// in error; and what no level touches.
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

namespace quality_levels_test {

using namespace obscura;
using namespace obscura::test;

namespace {

using Levels = std::vector<QualityLevel>;

constexpr std::int32_t size = 256;
constexpr Region field{0, 0, size, size};

scene::Scene asteroid(double radius_px = 90) {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, radius_px, size);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 1, 5};
    return s;
}

renderer::Renderer renderer_of(const scene::Scene& scene, std::uint32_t threads = 2) {
    renderer::RenderSettings settings{2, threads, 5};
    settings.target_error = 0.02;
    return {scene, settings};
}

std::vector<RowTime> rows_of(std::int64_t exposure_ns, std::int64_t between_rows_ns) {
    std::vector<RowTime> times;
    for (std::int32_t y = 0; y < size; ++y) {
        const Time mid{y * between_rows_ns};
        times.push_back({mid - exposure_ns / 2, mid + exposure_ns / 2});
    }
    return times;
}

renderer::RenderRequest request_of(const std::vector<RowTime>& times, const Levels& levels,
                                   std::int32_t first, std::int32_t rows, std::uint64_t frame_id) {
    renderer::RenderRequest request;
    request.window = field;
    request.first_row = first;
    request.rows = rows;
    request.row_times =
        std::span(times).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(rows));
    request.common_mid = renderer::common_mid(times);
    request.frame_id = frame_id;
    if (!levels.empty())
        request.levels =
            std::span(levels).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(rows));
    request.frame_times = times;
    return request;
}

struct Planes {
    std::vector<float> image, variance;
};

Planes frame(const renderer::Renderer& r, const std::vector<RowTime>& times, const Levels& levels,
             std::int32_t block_rows = size, std::uint64_t frame_id = 1,
             renderer::FrameSamples* kept = nullptr) {
    constexpr std::size_t plane = static_cast<std::size_t>(size) * size;
    Planes out{std::vector<float>(plane * r.band_count()), std::vector<float>(plane)};
    for (std::int32_t first = 0; first < size; first += block_rows) {
        renderer::RenderRequest request =
            request_of(times, levels, first, std::min(block_rows, size - first), frame_id);
        const std::size_t at = static_cast<std::size_t>(first) * size;
        request.plane_rows = size;
        request.kept = kept;
        request.variance = std::span(out.variance).subspan(at, static_cast<std::size_t>(request.rows) * size);
        REQUIRE(r.render(request, std::span(out.image).subspan(at)));
    }
    return out;
}

Levels all(QualityLevel level) {
    return Levels(static_cast<std::size_t>(size), level);
}

/// Groups of 16 rows at one level after the other.
Levels mixed() {
    constexpr std::array order{QualityLevel::sixteenth, QualityLevel::full,    QualityLevel::grid,
                               QualityLevel::quarter,   QualityLevel::goal,    QualityLevel::full,
                               QualityLevel::bounces,   QualityLevel::instants};
    Levels levels;
    for (std::int32_t y = 0; y < size; ++y)
        levels.push_back(order[static_cast<std::size_t>(y / quality_group_rows) % order.size()]);
    return levels;
}

constexpr std::array rendered{QualityLevel::full, QualityLevel::goal,    QualityLevel::instants,
                              QualityLevel::grid, QualityLevel::quarter, QualityLevel::sixteenth};

} // namespace

TEST_CASE("rows of full level have the bytes of rows without levels, also in parts that share samples") {
    const renderer::Renderer r = renderer_of(asteroid());
    for (const std::int64_t exposure_ns : {std::int64_t{0}, 100 * ns_per_ms}) {
        const std::vector<RowTime> times = rows_of(exposure_ns, 0);
        const Planes plain = frame(r, times, {});
        CHECK(frame(r, times, all(QualityLevel::full), 48).image == plain.image);
        renderer::FrameSamples kept;
        CHECK(frame(r, times, all(QualityLevel::full), 16, 1, &kept).image == plain.image);
        // What is kept belongs to one frame.
        kept.begin_frame();
        CHECK(frame(r, times, {}, 80, 2, &kept).image == frame(r, times, {}, size, 2).image);
    }
}

TEST_CASE("the same levels give the same bytes, on any threads and in any parts") {
    scene::Scene scene = asteroid();
    scene.bodies[0].motion.samples = {{-10, {{0, 0, -400}, {}}}, {10, {{0, 0, 400}, {}}}};
    scene.max_bounces = 2;
    // Shared grid; own samples at several instants; every row at its own time.
    for (const auto& [exposure_ns, between_rows_ns] :
         {std::pair<std::int64_t, std::int64_t>{0, 0}, {200 * ns_per_ms, 0}, {10 * ns_per_ms, ns_per_ms}}) {
        const std::vector<RowTime> times = rows_of(exposure_ns, between_rows_ns);
        const renderer::Renderer one = renderer_of(scene, 1);
        const renderer::Renderer two = renderer_of(scene, 2);
        const Planes whole = frame(one, times, mixed());
        CHECK(frame(two, times, mixed()).image == whole.image);
        CHECK(frame(two, times, mixed(), 24).image == whole.image);
        renderer::FrameSamples kept;
        CHECK(frame(two, times, mixed(), 16, 1, &kept).image == whole.image);
        CHECK(frame(two, times, mixed(), 16).variance == whole.variance);
        // Each row is that of a frame which has its level throughout.
        for (const QualityLevel level : rendered) {
            const Planes same = frame(two, times, all(level));
            const Levels levels = mixed();
            bool equal = true;
            for (std::size_t i = 0; i < levels.size(); ++i)
                if (levels[i] == level)
                    equal =
                        equal && std::equal(whole.image.begin() + static_cast<std::ptrdiff_t>(i * size),
                                            whole.image.begin() + static_cast<std::ptrdiff_t>((i + 1) * size),
                                            same.image.begin() + static_cast<std::ptrdiff_t>(i * size));
            CHECK(equal);
        }
    }
}

TEST_CASE("the error grows from level to level and its estimate is honest") {
    const scene::Scene scene = asteroid();
    const renderer::Renderer r = renderer_of(scene);
    const renderer::Renderer reference(scene, {256, 2, 77});
    const std::vector<RowTime> times = rows_of(0, 0);
    const Planes truth = frame(reference, times, {});
    double before = 0;
    for (const QualityLevel level : {QualityLevel::full, QualityLevel::goal, QualityLevel::grid,
                                     QualityLevel::quarter, QualityLevel::sixteenth}) {
        double error2 = 0;
        double told2 = 0;
        double lit2 = 0;
        std::size_t zeros = 0;
        for (std::uint64_t f = 0; f < 16; ++f) {
            const Planes p = frame(r, times, all(level), size, f);
            for (std::size_t i = 0; i < truth.image.size(); ++i) {
                const auto t = static_cast<double>(truth.image[i]);
                error2 += std::pow(static_cast<double>(p.image[i]) - t, 2);
                told2 += static_cast<double>(p.variance[i]);
                lit2 += t * t;
                zeros += p.image[i] > 0 && !(p.variance[i] > 0) ? 1 : 0;
            }
        }
        const double error = std::sqrt(error2 / lit2);
        const double ratio = std::sqrt(told2 / error2);
        INFO(name_of(level) << ": error " << error << ", estimated over true " << ratio);
        CHECK(error > before);
        CHECK(ratio > 0.8);
        CHECK(ratio < 1.25);
        CHECK(zeros == 0);
        before = error;
    }
}

TEST_CASE("stars and small bodies are the same at every level") {
    scene::Scene scene = asteroid(60);
    const Vec3 side = rotate(scene.camera.motion.samples[0].pose.orientation, {1, 0.1, 0});
    const double pixel_rad = scene.camera.pixel_pitch_m / scene.camera.focal_length_m;
    scene::Body moon = scene.bodies[0];
    moon.name = "moon";
    moon.shape = renderer::EllipsoidParameters{{25, 25, 25}}; // 4.5 px in radius
    moon.motion.samples[0].pose.position_m = side * (110 * pixel_rad * 1e5 / length(side));
    scene.bodies.push_back(moon);
    moon.name = "rock";
    moon.shape = renderer::EllipsoidParameters{{1, 1, 1}}; // below a pixel
    moon.motion.samples[0].pose.position_m = side * (-115 * pixel_rad * 1e5 / length(side));
    scene.bodies.push_back(moon);
    for (const double up : {-0.4, 0.2, 0.35}) {
        const Vec3 star = normalized(rotate(scene.camera.motion.samples[0].pose.orientation,
                                            {105 * pixel_rad, 256 * up * pixel_rad, 1}));
        scene.stars.push_back({std::atan2(star.y, star.x), std::asin(star.z), 3, 0.5});
    }
    const renderer::Renderer r = renderer_of(scene);
    for (const std::int64_t exposure_ns : {std::int64_t{0}, 100 * ns_per_ms}) {
        const std::vector<RowTime> times = rows_of(exposure_ns, 0);
        const Planes full = frame(r, times, {});
        // Columns left and right of the asteroid.
        double outside = 0;
        for (const QualityLevel level : rendered) {
            const Planes p = frame(r, times, all(level));
            bool equal = true;
            for (std::size_t i = 0; i < full.image.size(); ++i) {
                if (i % size >= 32 && i % size < size - 32) continue;
                outside += static_cast<double>(full.image[i]);
                equal = equal && p.image[i] == full.image[i];
            }
            INFO(name_of(level));
            CHECK(equal);
            CHECK((level == QualityLevel::full) == (p.image == full.image));
        }
        CHECK(outside > 0);
    }
}

TEST_CASE("a gate leaves out rows that are not wanted any more, and no others") {
    struct Gate final : renderer::RowGate {
        std::array<std::atomic<int>, size> rows{};
        std::int32_t last = 0;
        bool wants(std::int32_t r) noexcept override { return r < last; }
        void done(std::int32_t r, const renderer::RenderedRow& /*how*/) noexcept override {
            ++rows[static_cast<std::size_t>(r)];
        }
    };
    const renderer::Renderer r = renderer_of(asteroid());
    const std::vector<RowTime> times = rows_of(0, 0);
    for (const QualityLevel level : rendered) {
        const Planes whole = frame(r, times, all(level));
        Gate gate;
        gate.last = 100;
        const Levels levels = all(level);
        renderer::RenderRequest request = request_of(times, levels, 0, size, 1);
        request.gate = &gate;
        std::vector<float> image(static_cast<std::size_t>(size) * size, -1.0F);
        CHECK_FALSE(r.render(request, image));
        bool right = true;
        std::int32_t count = 0;
        for (std::size_t y = 0; y < size; ++y) {
            const bool done = gate.rows[y] == 1;
            count += done ? 1 : 0;
            for (std::size_t x = 0; x < size; ++x)
                right = right && image[y * size + x] == (done ? whole.image[y * size + x] : -1.0F);
        }
        CHECK(right);
        CHECK(count <= 100);
        CHECK(count >= 90); // grids reach beyond the last rows
        gate.last = size;
        CHECK(r.render(request, image));
        CHECK(image == whole.image);
    }
}

} // namespace quality_levels_test
