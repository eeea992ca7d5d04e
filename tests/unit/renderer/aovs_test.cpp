// SPDX-License-Identifier: Apache-2.0
// Truth maps of a known ball against plane trigonometry.
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/disc.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>

namespace aovs_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using renderer::Aov;

namespace {

std::vector<float> aovs_of(const renderer::Renderer& r, Region window) {
    const std::vector<RowTime> times(static_cast<std::size_t>(window.height));
    renderer::RenderRequest request;
    request.window = window;
    request.rows = window.height;
    request.row_times = times;
    std::vector<float> aovs(renderer::aov_count * static_cast<std::size_t>(window.area()));
    CHECK(r.render_aovs(request, aovs));
    return aovs;
}

} // namespace

TEST_CASE("Layers tell the geometry behind each pixel") {
    constexpr int size = 101;
    const double phase = 0.7;
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, phase, 40, size);
    const renderer::Renderer r(s, {1, 2, 1});
    const std::vector<float> aovs = aovs_of(r, {0, 0, size, size});
    const auto value = [&](Aov aov, int x, int y) {
        return static_cast<double>(
            aovs[(static_cast<std::size_t>(aov) * size + static_cast<std::size_t>(y)) * size +
                 static_cast<std::size_t>(x)]);
    };
    CHECK(value(Aov::body, 0, 0) == 0);
    CHECK(std::isnan(value(Aov::range_m, 0, 0)));
    const double pixel = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const Pose& camera = s.camera.motion.samples[0].pose;
    for (const auto& [x, y] : {std::pair{50, 50}, {30, 61}, {77, 40}, {50, 85}}) {
        INFO("pixel " << x << ' ' << y);
        // The sphere's quadratic, solved plainly.
        const Vec3 d = rotate(camera.orientation, normalized(Vec3{(x - 50) * pixel, (y - 50) * pixel, 1}));
        const double b = dot(d, camera.position_m);
        const double t = -b - std::sqrt(b * b - (length_squared(camera.position_m) - 500.0 * 500));
        const Vec3 p = camera.position_m + d * t;
        const Vec3 n = p / 500.0;
        const double deg = 180 / std::numbers::pi;
        CHECK(value(Aov::body, x, y) == 1);
        CHECK_THAT(value(Aov::range_m, x, y), WithinRel(t, 1e-6));
        CHECK_THAT(value(Aov::depth_m, x, y),
                   WithinRel(t * dot(d, rotate(camera.orientation, {0, 0, 1})), 1e-6));
        CHECK_THAT(value(Aov::normal_x, x, y), WithinAbs(n.x, 1e-5));
        CHECK_THAT(value(Aov::normal_y, x, y), WithinAbs(n.y, 1e-5));
        CHECK_THAT(value(Aov::normal_z, x, y), WithinAbs(n.z, 1e-5));
        CHECK_THAT(value(Aov::latitude_deg, x, y), WithinAbs(std::asin(n.z) * deg, 1e-3));
        CHECK_THAT(value(Aov::longitude_deg, x, y), WithinAbs(std::atan2(n.y, n.x) * deg, 1e-3));
        CHECK_THAT(value(Aov::slope_deg, x, y), WithinAbs(0, 1e-3));
        CHECK_THAT(value(Aov::incidence_deg, x, y),
                   WithinAbs(std::acos(dot(n, normalized(s.sun.position_m - p))) * deg, 1e-3));
        CHECK_THAT(value(Aov::emission_deg, x, y),
                   WithinAbs(std::acos(std::min(1.0, -dot(n, d))) * deg, 1e-3));
        CHECK_THAT(value(Aov::phase_deg, x, y), WithinAbs(phase * deg, 0.3));
    }
}

TEST_CASE("Layers tell albedo, material and texture coordinates; samples and variance come with the light") {
    scene::Scene s = sphere_scene(renderer::HapkeParameters{0.3, 0.3, 0.5}, 0.3, 12, 32);
    s.bodies[0].colour = {0.5};
    s.bodies.push_back({"disc", renderer::DiscParameters{300, 100}, renderer::LambertParameters{0.25}, {}});
    s.bodies[1].motion.samples[0].pose = {{-600, 0, 0}, axis_angle({0, 1, 0}, std::numbers::pi / 2)};
    const renderer::Renderer r(s, {16, 2, 1});
    const std::vector<float> aovs = aovs_of(r, {0, 0, 32, 32});
    const auto value = [&](Aov aov, std::size_t i) {
        return static_cast<double>(aovs[static_cast<std::size_t>(aov) * 32 * 32 + i]);
    };
    // Hapke's smooth surface at no angles: w/8 [p(0) + H(1)^2 - 1], H of Hapke (2002) worked out by hand.
    const double gamma = std::sqrt(0.7);
    const double r0 = (1 - gamma) / (1 + gamma);
    const double h = 1 / (1 - 0.3 * (r0 + (1 - 2 * r0) / 2 * std::log(2)));
    const auto lobe = [](double c, double sign) { return c * 0.91 / std::pow(1.09 - sign * 0.6, 1.5); };
    const double p = lobe(0.75, 1) + lobe(0.25, -1);
    const double wanted = 0.5 * std::numbers::pi * 0.3 / (8 * std::numbers::pi) * (p + h * h - 1);
    int ball = 0;
    int disc = 0;
    for (std::size_t i = 0; i < 32 * 32; ++i) {
        if (value(Aov::body, i) == 1) {
            CHECK_THAT(value(Aov::albedo, i), WithinRel(wanted, 1e-5));
            CHECK(value(Aov::material, i) == 1);
            CHECK(std::isnan(value(Aov::u, i)));
            ++ball;
        } else if (value(Aov::body, i) == 2) {
            CHECK_THAT(value(Aov::albedo, i), WithinRel(0.25, 1e-6));
            CHECK(value(Aov::material, i) == 2);
            CHECK(value(Aov::v, i) >= 0);
            CHECK(value(Aov::v, i) <= 1);
            ++disc;
        }
    }
    CHECK(ball > 200);
    CHECK(disc > 20);

    const std::vector<RowTime> times(32);
    std::vector<float> image(32 * 32);
    std::vector<float> samples(32 * 32, -1);
    std::vector<float> variance(32 * 32, -1);
    renderer::RenderRequest request;
    request.window = {0, 0, 32, 32};
    request.rows = 32;
    request.row_times = times;
    request.samples = samples;
    request.variance = variance;
    // The estimate against what frames of different seeds do.
    constexpr int frames = 60;
    std::vector<double> sum(32 * 32);
    std::vector<double> square(32 * 32);
    std::vector<double> estimate(32 * 32);
    for (int f = 0; f < frames; ++f) {
        request.frame_id = static_cast<std::uint64_t>(f);
        CHECK(r.render(request, image));
        for (std::size_t i = 0; i < image.size(); ++i) {
            sum[i] += static_cast<double>(image[i]);
            square[i] += static_cast<double>(image[i]) * static_cast<double>(image[i]);
            estimate[i] += static_cast<double>(variance[i]) / frames;
        }
    }
    CHECK(samples[0] == 0);
    CHECK(variance[0] == 0);
    CHECK(samples[16 * 32 + 16] >= 16);
    double seen = 0;
    double told = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
        seen += (square[i] - sum[i] * sum[i] / frames) / (frames - 1);
        told += estimate[i];
    }
    // Sobol points do better than the n^-3/2 that the estimate counts on, or not quite as well.
    CHECK(told / seen > 0.2);
    CHECK(told / seen < 5);
}

TEST_CASE("Layers of a window are the crop of the whole, and follow a body that turns") {
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.5, 30, 80);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 3, 4};
    s.bodies[0].motion.samples[0].pose.orientation = axis_angle({1, 2, 3}, 0.8);
    const renderer::Renderer r(s, {1, 3, 1});
    const std::vector<float> whole = aovs_of(r, {0, 0, 80, 80});
    const Region window{21, 33, 29, 17};
    const std::vector<float> part = aovs_of(r, window);
    std::size_t differing = 0;
    std::size_t seen = 0;
    for (std::size_t k = 0; k < renderer::aov_count; ++k)
        for (int y = 0; y < window.height; ++y)
            for (int x = 0; x < window.width; ++x) {
                const float a = whole[(k * 80 + static_cast<std::size_t>(window.y + y)) * 80 +
                                      static_cast<std::size_t>(window.x + x)];
                const float b =
                    part[(k * static_cast<std::size_t>(window.height) + static_cast<std::size_t>(y)) *
                             static_cast<std::size_t>(window.width) +
                         static_cast<std::size_t>(x)];
                differing += a == b || (std::isnan(a) && std::isnan(b)) ? 0 : 1;
                seen += k == 0 && b == 1 ? 1 : 0;
            }
    CHECK(differing == 0);
    CHECK(seen > 300);
    // Normals are unit vectors of the inertial frame.
    const auto at = [&](Aov aov) {
        return static_cast<double>(whole[(static_cast<std::size_t>(aov) * 80 + 40) * 80 + 40]);
    };
    const Vec3 n{at(Aov::normal_x), at(Aov::normal_y), at(Aov::normal_z)};
    CHECK_THAT(length(n), WithinAbs(1, 1e-5));
    const Vec3 to_camera = normalized(s.camera.motion.samples[0].pose.position_m);
    CHECK_THAT(std::acos(std::min(1.0, dot(n, to_camera))) * 180 / std::numbers::pi,
               WithinAbs(at(Aov::emission_deg), 0.5));
}

TEST_CASE("rays from the camera meet what the layers tell, and others what is in their way") {
    constexpr int size = 32;
    const scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.7, 10, size);
    const renderer::Renderer r(s, {1, 2, 1});
    const std::vector<float> aovs = aovs_of(r, {0, 0, size, size});
    const double pixel = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const Pose& camera = s.camera.motion.samples[0].pose;
    std::vector<renderer::Ray> rays;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            rays.push_back(
                {camera.position_m,
                 rotate(camera.orientation,
                        Vec3{(x - (size - 1) / 2.0) * pixel, (y - (size - 1) / 2.0) * pixel, 1} * 3)});
    rays.push_back({{0, 0, 2000}, {0, 0, -1}});
    rays.push_back({{0, 0, 0}, {0, 1, 0}}); // from inside
    std::vector<double> distances(rays.size());
    REQUIRE(r.intersect(Time{0}, rays, distances));
    for (std::size_t i = 0; i < size * size; ++i) {
        const double range =
            static_cast<double>(aovs[static_cast<std::size_t>(Aov::range_m) * size * size + i]);
        if (std::isnan(range))
            CHECK(std::isinf(distances[i]));
        else
            CHECK_THAT(distances[i], WithinRel(range, 1e-6));
    }
    CHECK_THAT(distances[size * size], WithinAbs(1500, 1e-9));
    CHECK_THAT(distances[size * size + 1], WithinAbs(500, 1e-9));
}

} // namespace aovs_test
