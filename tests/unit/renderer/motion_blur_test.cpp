// SPDX-License-Identifier: Apache-2.0
// What moves during an exposure: against the mean of many pictures without exposure.
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/world/exposure.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace motion_blur_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr std::int64_t exposure_ns = 400 * ns_per_ms;
constexpr std::int32_t size = 96;
constexpr double pixel_rad = 1e-4;

/// A camera at the origin that turns about its own down axis: stars move along the rows, `across_px` in an
/// exposure.
scene::Scene turning_before_stars(double across_px) {
    scene::Scene s;
    s.camera = camera_at({-1, 0, 0}, size, pixel_rad);
    s.camera.psf_sigma_px = 0.6;
    s.camera.motion.spin_axis = {0, 1, 0};
    s.camera.motion.spin_rate_rad_s = across_px * pixel_rad / to_seconds(exposure_ns);
    s.stars = {{0.3 * pixel_rad, 0.17 * pixel_rad, 0, 0.5}};
    return s;
}

/// A ball of 16 px radius that passes before a camera at rest, and turns.
scene::Scene passing_ball(double across_px) {
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.9, 16, size);
    const Vec3 way = rotate(s.camera.motion.samples[0].pose.orientation, {1, 0.3, 0});
    const double metres = across_px * 500.0 / 16 / length(way);
    s.bodies[0].motion.samples = {{-0.2, {way * (-metres / 2), {}}}, {0.2, {way * (metres / 2), {}}}};
    s.bodies[0].motion.spin_rate_rad_s = 0.1;
    return s;
}

std::vector<float> frame(const scene::Scene& s, renderer::RenderSettings settings, std::int64_t exposed_ns,
                         std::uint64_t id = 1, Time t = {}) {
    return render_window(renderer::Renderer(s, settings), {0, 0, size, size}, 32, id, t, exposed_ns);
}

/// The mean of `count` pictures at instants that share the exposure.
std::vector<double> mean_of_instants(const scene::Scene& s, renderer::RenderSettings settings, int count) {
    const renderer::Renderer r(s, settings);
    std::vector<double> mean(size * size);
    for (int i = 0; i < count; ++i) {
        const Time t{std::llround(static_cast<double>(exposure_ns) * ((i + 0.5) / count - 0.5))};
        const std::vector<float> one =
            render_window(r, {0, 0, size, size}, 32, static_cast<std::uint64_t>(i + 1), t);
        for (std::size_t p = 0; p < mean.size(); ++p)
            mean[p] += static_cast<double>(one[p]) / count;
    }
    return mean;
}

template<typename A, typename B>
double rms_difference(const A& a, const B& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        sum += d * d;
    }
    return std::sqrt(sum / static_cast<double>(a.size()));
}

template<typename A>
double total(const A& a) {
    double sum = 0;
    for (const auto v : a)
        sum += static_cast<double>(v);
    return sum;
}

struct Streak {
    double flux = 0, x = 0, variance_px2 = 0;
};

Streak streak_of(const std::vector<float>& image) {
    Streak s;
    double square = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
        const double x = static_cast<double>(i % size), v = static_cast<double>(image[i]);
        s.flux += v;
        s.x += v * x;
        square += v * x * x;
    }
    s.x /= s.flux;
    s.variance_px2 = square / s.flux - s.x * s.x;
    return s;
}

/// A pose that is received: it may change between two renderings of one instant.
struct ReceivedPose final : scene::LivePose {
    Pose pose;
    bool at(double /*time_s*/, Pose& out) const noexcept override {
        out = pose;
        return true;
    }
};

} // namespace

TEST_CASE(
    "A star's streak is as long as the turn, as bright as the star at rest, and lies about mid-exposure") {
    const Streak rest = streak_of(frame(turning_before_stars(0), {1, 2, 1}, exposure_ns));
    for (const double across_px : {0.3, 3.0, 17.3, 61.0}) {
        CAPTURE(across_px);
        const Streak moved = streak_of(frame(turning_before_stars(across_px), {1, 2, 1}, exposure_ns));
        CHECK_THAT(moved.flux, WithinRel(rest.flux, 1e-4));
        CHECK_THAT(moved.x, WithinAbs(rest.x, 2e-3));
        // A uniform streak has a twelfth of its length squared as variance.
        const double length_px = std::sqrt(12 * std::max(0.0, moved.variance_px2 - rest.variance_px2));
        if (across_px > 1) CHECK_THAT(length_px, WithinRel(across_px, 2e-3));
    }
}

TEST_CASE("A star's streak is the mean of the star at many instants") {
    const scene::Scene s = turning_before_stars(17.3);
    const std::vector<float> blurred = frame(s, {1, 2, 1}, exposure_ns);
    const std::vector<double> mean = mean_of_instants(s, {1, 2, 1}, 400);
    const double level = *std::max_element(mean.begin(), mean.end());
    double worst = 0;
    for (std::size_t i = 0; i < mean.size(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(blurred[i]) - mean[i]));
    CHECK(worst < 0.01 * level);
}

TEST_CASE("A body that moves in an exposure is the mean of itself at many instants, at no more samples") {
    const scene::Scene s = passing_ball(12);
    const renderer::RenderSettings settings{64, 2, 1};
    const renderer::Renderer blurring(s, settings);
    const std::vector<float> blurred = render_window(blurring, {0, 0, size, size}, 32, 1, {}, exposure_ns);
    const std::vector<double> mean = mean_of_instants(s, {4, 2, 1}, 96);
    const std::vector<float> frozen = frame(s, {64, 2, 1, 0, 64, 0, 1}, exposure_ns);
    const double level = *std::max_element(mean.begin(), mean.end());
    CHECK_THAT(total(blurred), WithinRel(total(mean), 1e-3));
    CHECK(rms_difference(blurred, mean) < 0.004 * level);
    CHECK(rms_difference(frozen, mean) > 0.03 * level);

    const renderer::Renderer still(passing_ball(0), settings);
    render_window(still, {0, 0, size, size}, 32, 1, {}, 0);
    // The margins about the bodies of more than one instant are looked at, too.
    CHECK(static_cast<double>(blurring.samples_taken()) < 1.1 * static_cast<double>(still.samples_taken()));

    // A single instant is the one in the middle.
    CHECK(frozen == frame(s, {64, 2, 1}, 0));
}

TEST_CASE("Few samples spread over a long motion are noisy, not wrong") {
    const scene::Scene s = passing_ball(40);
    std::vector<double> mean(size * size);
    constexpr int frames = 96;
    const renderer::Renderer r(s, {2, 2, 1});
    for (std::uint64_t id = 1; id <= frames; ++id) {
        const std::vector<float> one = render_window(r, {0, 0, size, size}, 32, id, {}, exposure_ns);
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] += static_cast<double>(one[i]) / frames;
    }
    const std::vector<double> expected = mean_of_instants(s, {4, 2, 1}, 192);
    const double level = *std::max_element(expected.begin(), expected.end());
    CHECK_THAT(total(mean), WithinRel(total(expected), 5e-3));
    CHECK(rms_difference(mean, expected) < 0.03 * level);
}

TEST_CASE("A body smaller than pixels leaves a streak of its flux") {
    const auto small = [](double across_px) {
        scene::Scene s = passing_ball(across_px * 16 / 0.4);
        s.camera.focal_length_m *= 0.4 / 16;
        return s;
    };
    const std::vector<float> moved = frame(small(20), {4, 2, 1}, exposure_ns);
    const std::vector<double> mean = mean_of_instants(small(20), {4, 2, 1}, 200);
    CHECK(total(mean) > 0);
    CHECK_THAT(total(moved), WithinRel(total(mean), 1e-3));
    CHECK(rms_difference(moved, mean) < 0.02 * *std::max_element(mean.begin(), mean.end()));
}

TEST_CASE("Adaptive sampling keeps its promise while things move") {
    const scene::Scene s = passing_ball(6);
    renderer::RenderSettings settings{4, 2, 1};
    settings.target_error = 0.02;
    settings.max_samples_per_pixel = 256;
    const std::vector<float> got = frame(s, settings, exposure_ns);
    const std::vector<float> fine = frame(s, {1024, 2, 1}, exposure_ns, 2);
    double square = 0;
    int lit = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        if (!(fine[i] > 0)) continue;
        const double d = static_cast<double>(got[i] - fine[i]);
        square += d * d;
        ++lit;
    }
    const double level = static_cast<double>(*std::max_element(fine.begin(), fine.end()));
    CHECK(std::sqrt(square / lit) < 0.02 * level);
}

TEST_CASE("A blurred picture does not depend on bands, threads or windows") {
    scene::Scene s = passing_ball(9);
    s.stars = turning_before_stars(0).stars;
    const std::vector<float> whole = frame(s, {8, 1, 1}, exposure_ns);
    CHECK(whole ==
          render_window(renderer::Renderer(s, {8, 7, 1}), {0, 0, size, size}, 5, 1, {}, exposure_ns));
    const Region part{21, 17, 40, 50};
    const std::vector<float> crop =
        render_window(renderer::Renderer(s, {8, 2, 1}), part, 50, 1, {}, exposure_ns);
    bool same = true;
    for (std::int32_t y = 0; y < part.height; ++y)
        for (std::int32_t x = 0; x < part.width; ++x)
            same = same && crop[static_cast<std::size_t>(y * part.width + x)] ==
                               whole[static_cast<std::size_t>((y + part.y) * size + x + part.x)];
    CHECK(same);
}

TEST_CASE("A pose that is received between two renderings of the same exposure shows in the second") {
    scene::Scene s = passing_ball(9);
    const auto pose = std::make_shared<ReceivedPose>();
    pose->pose = s.bodies[0].motion.samples[0].pose;
    s.bodies[0].motion.live = pose;
    const renderer::Renderer r(s, {4, 1, 1});
    const std::vector<float> before = render_window(r, {0, 0, size, size}, 32, 1, {}, exposure_ns);
    CHECK(before == render_window(r, {0, 0, size, size}, 32, 1, {}, exposure_ns));
    pose->pose = s.bodies[0].motion.samples[1].pose;
    const std::vector<float> after = render_window(r, {0, 0, size, size}, 32, 1, {}, exposure_ns);
    CHECK(rms_difference(before, after) > 0);
    CHECK(after ==
          render_window(renderer::Renderer(s, {4, 1, 1}), {0, 0, size, size}, 32, 1, {}, exposure_ns));
}

TEST_CASE("Instants are as many as half pixels of motion, and share the exposure evenly") {
    const RowTime row{{1'000'000}, {3'000'000}};
    using renderer::Exposure;
    const Exposure still = Exposure::of(row, 0.2, 256);
    CHECK(still.instants == 1);
    CHECK(still.time_s(0) == 2e-3);
    const Exposure slow = Exposure::of(row, 1.9, 256);
    CHECK(slow.instants == 4);
    double mean = 0;
    double square = 0;
    for (std::uint32_t i = 0; i < 4; ++i) {
        mean += slow.time_s(i) / 4;
        square += (slow.time_s(i) - 2e-3) * (slow.time_s(i) - 2e-3) / 4;
    }
    CHECK_THAT(mean, WithinAbs(2e-3, 1e-12));
    CHECK_THAT(square, WithinRel(2e-3 * 2e-3 / 12, 1e-9)); // as that of the whole exposure
    CHECK(Exposure::of(row, 1000, 256).instants == 256);
}

TEST_CASE("At 4 samples the noise of a moving limb has no structure") {
    // Deviations of frames from their mean, in the parts of the picture that a limb crosses.
    scene::Scene s = passing_ball(40);
    s.camera.focal_length_m *= 2;
    const renderer::Renderer r(s, {4, 2, 1});
    constexpr std::size_t frames = 32;
    constexpr std::size_t width = size;
    std::vector<std::vector<float>> images;
    std::vector<double> mean(width * width);
    for (std::uint64_t id = 1; id <= frames; ++id) {
        images.push_back(render_window(r, {0, 0, size, size}, 32, id, {}, exposure_ns));
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] += static_cast<double>(images.back()[i]) / frames;
    }
    const auto correlation = [&](std::size_t across, std::size_t down) {
        double product = 0;
        double square = 0;
        for (const std::vector<float>& image : images)
            for (std::size_t y = 0; y + down < width; ++y)
                for (std::size_t x = 0; x + across < width; ++x) {
                    const std::size_t a = y * width + x;
                    const std::size_t b = (y + down) * width + x + across;
                    const double own = static_cast<double>(image[a]) - mean[a];
                    product += own * (static_cast<double>(image[b]) - mean[b]);
                    square += own * own;
                }
        return product / square;
    };
    for (const std::size_t lag : {1u, 2u, 3u, 5u, 8u, 13u, 20u, 27u}) {
        INFO("lag " << lag);
        CHECK(std::abs(correlation(lag, 0)) < 0.03);
        CHECK(std::abs(correlation(0, lag)) < 0.03);
        CHECK(std::abs(correlation(lag, lag)) < 0.03);
    }
}

TEST_CASE("What lights, shades and turns in an exposure is the mean of itself at many instants") {
    scene::Scene s = passing_ball(12);
    const auto moving = [](Vec3 from, Vec3 to) {
        scene::Motion motion;
        motion.samples = {{-0.2, {from, {}}}, {0.2, {to, {}}}};
        return motion;
    };
    renderer::RenderSettings settings{64, 2, 1};
    renderer::RenderSettings few{4, 2, 1};
    double most = 0.006;
    SECTION("shadows") {
        s.bodies.push_back({"screen", renderer::EllipsoidParameters{{150, 150, 150}},
                            renderer::LambertParameters{0.2}, moving({-900, -400, 0}, {-900, 500, 100})});
    }
    SECTION("a turning camera with aberration") {
        s.camera.motion.spin_axis = {0, 0, 1};
        s.camera.motion.spin_rate_rad_s = 0.8;
        s.aberration = true;
        s.camera.velocity_m_s = {0, 3e5, 2e5};
    }
    SECTION("lamps, shining bodies and light between bodies") {
        most = 0.012;
        s.sun.irradiance_scale = 1e-3;
        settings.max_bounces = few.max_bounces = 2;
        s.bodies.push_back({"lamp", renderer::EllipsoidParameters{{60, 60, 60}},
                            renderer::LambertParameters{0.2}, moving({-500, 600, 300}, {-300, 700, -200})});
        s.bodies[1].emission_w_m2_sr = {0.5};
        s.bodies.push_back({"plate", inward_cube(), renderer::LambertParameters{0.5}, {}});
        for (auto& face : s.bodies[2].shape.get<renderer::PolygonsParameters>().faces_m)
            for (Vec3& corner : face)
                corner = Vec3{corner.x * 40, corner.y * 200, corner.z * 200};
        s.bodies[2].emission_w_m2_sr = {1};
        s.bodies[2].motion = moving({-700, 300, -800}, {-400, 500, -800});
        s.bodies[2].motion.spin_axis = {0, 0, 1};
        s.bodies[2].motion.spin_rate_rad_s = 0.4;
        scene::Lamp lamp;
        lamp.name = "spot";
        lamp.beam = scene::Lamp::Beam::gaussian;
        lamp.half_angle_rad = 0.4;
        lamp.intensity_w_sr = {3e5};
        lamp.motion = moving({-200, 2000, 200}, {-200, 2000, -200});
        for (auto& pose : lamp.motion.samples)
            pose.pose.orientation = look_along({0, -1, 0}, {0, 0, 1});
        s.lamps.push_back(lamp);
    }
    SECTION("planetshine") {
        most = 0.012;
        settings.max_bounces = few.max_bounces = 1;
        s.bodies.push_back({"planet", renderer::EllipsoidParameters{{2000, 2000, 2000}},
                            renderer::LambertParameters{0.6}, moving({2500, 1500, 0}, {2500, 2200, 300})});
    }
    const std::vector<float> blurred = frame(s, settings, exposure_ns);
    const std::vector<double> mean = mean_of_instants(s, few, 96);
    const std::vector<float> frozen = frame(s, {64, 2, 1, 0, 64, settings.max_bounces, 1}, exposure_ns);
    const double level = *std::max_element(mean.begin(), mean.end());
    CHECK_THAT(total(blurred), WithinRel(total(mean), 2e-3));
    CHECK(rms_difference(blurred, mean) < most * level);
    CHECK(rms_difference(frozen, mean) > 2 * most * level);
    // Any threads and row blocks.
    CHECK(blurred == render_window(renderer::Renderer(s, {64, 5, 1, 0, 64, settings.max_bounces}),
                                   {0, 0, size, size}, 7, 1, {}, exposure_ns));
}

TEST_CASE("A body and its lamp that hang on a camera in motion are as sharp as before a camera at rest") {
    // A ball before the lens and a lamp beside it; the camera tumbles by a radian and 50 m in an exposure.
    const auto scene = [](const char* parent, bool moves) {
        scene::Scene s;
        s.sun.irradiance_scale = 0;
        s.camera = camera_at({-1, 0, 0}, size, 1e-3);
        s.camera.motion.samples[0].pose = {};
        if (moves)
            s.camera.motion.samples = {{-0.2, {{0, 0, 0}, axis_angle({1, 2, 0}, -0.5)}},
                                       {0.2, {{30, -40, 0}, axis_angle({1, 2, 0}, 0.5)}}};
        s.bodies.push_back(
            {"ball", renderer::EllipsoidParameters{{0.2, 0.2, 0.2}}, renderer::LambertParameters{0.5}, {}});
        s.bodies[0].motion.samples[0].pose.position_m = {0.02, 0.01, 10};
        s.bodies[0].parent = parent;
        s.lamps.emplace_back();
        s.lamps[0].parent = parent;
        s.lamps[0].motion.samples[0].pose.position_m = {3, 0, 5};
        s.lamps[0].intensity_w_sr = {100};
        return s;
    };
    const renderer::RenderSettings settings{16, 2, 1};
    const std::vector<float> rest = frame(scene("", false), settings, exposure_ns);
    const std::vector<float> hung = frame(scene("camera", true), settings, exposure_ns);
    const std::vector<float> left = frame(scene("", true), settings, exposure_ns);
    const double level = static_cast<double>(*std::max_element(rest.begin(), rest.end()));
    REQUIRE(level > 0);
    CHECK(rms_difference(hung, rest) < 0.01 * level);
    CHECK(std::abs(total(hung) / total(rest) - 1) < 1e-3);
    CHECK(total(left) < 0.5 * total(rest)); // the camera turns away from it
}

} // namespace motion_blur_test
