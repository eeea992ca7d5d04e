// SPDX-License-Identifier: Apache-2.0
// Honesty of the estimated variance: against the spread of frames whose random numbers differ.
#include "honesty_subjects.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace noise_estimate_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr int frames = 16;

struct Level {
    std::uint32_t samples = 1;
    double target_error = 0; ///< 0: fixed number of samples
};

/// The asteroid on its way across `pixels`.
Subject passing_asteroid(double pixels) {
    Subject a = asteroid();
    a.name = "asteroid that passes " + std::to_string(static_cast<int>(pixels)) + " px";
    a.exposure_ns = 400 * ns_per_ms;
    const Vec3 way = rotate(a.scene.camera.motion.samples[0].pose.orientation, {1, 0.3, 0});
    const Vec3 half_m = way * (pixels * 500.0 / 90 / length(way) / 2);
    a.scene.bodies[0].motion.samples = {{-0.2, {-half_m, {}}}, {0.2, {half_m, {}}}};
    return a;
}

struct Planes {
    std::vector<float> mean, variance, samples;
};

/// One frame of the window, mean over the bands, in requests of `block_rows` rows.
Planes frame(const renderer::Renderer& r, const Subject& subject, std::uint64_t id,
             std::int32_t block_rows = 64) {
    const Region& window = subject.window;
    const auto width = static_cast<std::size_t>(window.width);
    const std::size_t plane = width * static_cast<std::size_t>(window.height);
    const std::int64_t half_ns = subject.exposure_ns / 2;
    const std::vector<RowTime> times(static_cast<std::size_t>(window.height),
                                     {Time{-half_ns}, Time{half_ns}});
    Planes out{std::vector<float>(plane), std::vector<float>(plane), std::vector<float>(plane)};
    for (std::int32_t row = 0; row < window.height; row += block_rows) {
        renderer::RenderRequest request;
        request.window = window;
        request.first_row = row;
        request.rows = std::min(block_rows, window.height - row);
        const auto rows = static_cast<std::size_t>(request.rows);
        const std::size_t first = static_cast<std::size_t>(row) * width;
        request.row_times = std::span(times).first(rows);
        request.common_mid = renderer::common_mid(times);
        request.frame_id = id;
        request.samples = std::span(out.samples).subspan(first, rows * width);
        request.variance = std::span(out.variance).subspan(first, rows * width);
        std::vector<float> image(rows * width * r.band_count());
        r.render(request, image);
        for (std::size_t b = 0; b < r.band_count(); ++b)
            for (std::size_t i = 0; i < rows * width; ++i)
                out.mean[first + i] += image[b * rows * width + i] / static_cast<float>(r.band_count());
    }
    return out;
}

/// Pixels whose centre shows a body.
std::vector<bool> body_mask(const renderer::Renderer& r, const Region& window) {
    const std::vector<RowTime> times(static_cast<std::size_t>(window.height));
    const std::size_t plane =
        static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
    std::vector<float> aovs(renderer::aov_count * plane);
    renderer::RenderRequest request;
    request.window = window;
    request.rows = window.height;
    request.row_times = times;
    r.render_aovs(request, aovs);
    std::vector<bool> on(plane);
    for (std::size_t i = 0; i < plane; ++i)
        on[i] = aovs[static_cast<std::size_t>(renderer::Aov::body) * plane + i] > 0;
    return on;
}

renderer::Renderer renderer_for(const Subject& subject, const Level& level, std::uint32_t threads = 2) {
    renderer::RenderSettings settings{level.samples, threads, 5};
    settings.target_error = level.target_error;
    settings.max_samples_per_pixel = 256;
    return {subject.scene, settings};
}

struct Honesty {
    double noise = 0;      ///< true, rms over rms of the image
    double frame = 0;      ///< estimated over true rms
    double steep = 0;      ///< the same of the 5 % of pixels that differ most from their neighbours
    double samples = 0;    ///< per pixel
    std::size_t zeros = 0; ///< pixels of bodies with variance 0
};

Honesty honesty(const Subject& subject, const Level& level) {
    const renderer::Renderer r = renderer_for(subject, level);
    const std::vector<bool> body = body_mask(r, subject.window);
    const auto width = static_cast<std::size_t>(subject.window.width);
    const std::size_t plane = body.size();
    std::vector<double> mean(plane);
    std::vector<double> square(plane);
    std::vector<double> estimate(plane);
    Honesty h;
    for (int f = 0; f < frames; ++f) {
        const Planes p = frame(r, subject, static_cast<std::uint64_t>(f));
        for (std::size_t i = 0; i < plane; ++i) {
            const double v = static_cast<double>(p.mean[i]);
            mean[i] += v / frames;
            square[i] += v * v / frames;
            estimate[i] += static_cast<double>(p.variance[i]) / frames;
            h.samples += static_cast<double>(p.samples[i]) / frames / static_cast<double>(plane);
            h.zeros += body[i] && !(p.variance[i] > 0) ? 1 : 0;
        }
    }
    std::vector<double> slope(plane);
    std::vector<double> sorted;
    for (std::size_t i = 0; i < plane; ++i) {
        if (!body[i]) continue;
        const double right = i % width + 1 < width ? std::abs(mean[i] - mean[i + 1]) : 0;
        const double down = i + width < plane ? std::abs(mean[i] - mean[i + width]) : 0;
        slope[i] = std::max(right, down);
        sorted.push_back(slope[i]);
    }
    const auto steep = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 95 / 100);
    std::nth_element(sorted.begin(), steep, sorted.end());
    double lit = 0;
    double truth[2] = {};
    double told[2] = {};
    for (std::size_t i = 0; i < plane; ++i) {
        const double v = std::max(0.0, (square[i] - mean[i] * mean[i]) * frames / (frames - 1));
        lit += mean[i] * mean[i];
        truth[0] += v;
        told[0] += estimate[i];
        if (!body[i] || slope[i] < *steep) continue;
        truth[1] += v;
        told[1] += estimate[i];
    }
    h.noise = std::sqrt(truth[0] / lit);
    h.frame = std::sqrt(told[0] / truth[0]);
    h.steep = std::sqrt(told[1] / truth[1]);
    return h;
}

Honesty check_honesty(const Subject& subject, const Level& level) {
    const Honesty h = honesty(subject, level);
    INFO(subject.name << ", " << level.samples << " samples, error " << level.target_error << ": true noise "
                      << h.noise << ", " << h.samples << " samples a pixel");
    CHECK(h.frame > 0.8);
    CHECK(h.frame < 1.25);
    CHECK(h.steep > 0.7);
    CHECK(h.steep < 1.5);
    CHECK(h.zeros == 0);
    return h;
}

} // namespace

TEST_CASE("The estimated noise is what frames of different random numbers differ by") {
    for (const Subject& subject : {asteroid(), limb(), cornell(), planetshine(100)})
        for (const std::uint32_t samples : {1u, 2u, 4u, 16u, 64u})
            check_honesty(subject, {samples});
}

TEST_CASE("The estimated noise of a moving body is what frames differ by") {
    for (const double pixels : {1.0, 2.0, 7.0, 40.0})
        for (const std::uint32_t samples : {1u, 2u, 4u, 16u, 64u})
            check_honesty(passing_asteroid(pixels), {samples});
}

TEST_CASE("Adaptive sampling reaches the error it is asked for and knows the error it leaves") {
    for (const double error : {0.02, 0.005}) {
        CHECK(check_honesty(asteroid(), {2, error}).noise < 1.1 * error);
        CHECK(check_honesty(limb(), {2, error}).noise < 1.1 * error);
        CHECK(check_honesty(passing_asteroid(2), {2, error}).noise < 1.1 * error);
        CHECK(check_honesty(passing_asteroid(12), {2, error}).noise < 1.1 * error);
    }
    // A wide field of indirect light: few of 2 samples meet the planet, which must not pass for darkness.
    CHECK(check_honesty(cornell(), {2, 0.15}).noise < 1.3 * 0.15);
    // The error is relative to the moon's sunlit side, some six times as bright as its night side.
    CHECK(check_honesty(planetshine(100), {2, 0.015}).noise < 0.1);
    CHECK(check_honesty(planetshine(180), {2, 0.015}).noise < 0.1); // shares a sample grid
}

TEST_CASE("The estimated noise is the same for any threads, row blocks and window") {
    for (const Level& level : {Level{1}, Level{2}, Level{16}, Level{2, 0.01}}) {
        INFO(level.samples << " samples, error " << level.target_error);
        const Subject whole = limb();
        const Planes one = frame(renderer_for(whole, level, 1), whole, 1);
        const renderer::Renderer three = renderer_for(whole, level, 3);
        CHECK(frame(three, whole, 1, 5).variance == one.variance);
        Subject part = whole;
        part.window = {53, 303, 77, 9};
        const Planes crop = frame(three, part, 1, 4);
        std::size_t differing = 0;
        for (std::int32_t y = 0; y < part.window.height; ++y)
            for (std::int32_t x = 0; x < part.window.width; ++x) {
                const auto at = [](std::int32_t column, std::int32_t row, std::int32_t width) {
                    return static_cast<std::size_t>(row * width + column);
                };
                const float v = one.variance[at(x + part.window.x - whole.window.x,
                                                y + part.window.y - whole.window.y, whole.window.width)];
                differing += crop.variance[at(x, y, part.window.width)] != v ? 1 : 0;
            }
        CHECK(differing == 0);
    }
}

} // namespace noise_estimate_test
