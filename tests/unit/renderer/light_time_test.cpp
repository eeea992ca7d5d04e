// SPDX-License-Identifier: Apache-2.0
// Light time of every point of a body, against bodies at rest and against the equation of light time solved
// point by point.
#include "renderer/camera/aberration.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/row_state.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace light_time_test {

using namespace obscura;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using renderer::Aov;
using renderer::ImagePoint;
using renderer::light_speed_m_s;

namespace {

constexpr std::int32_t size = 64;

/// Without rotation, along a function of time.
class Path final : public scene::PosePath {
public:
    using Position = std::function<Vec3(double)>;
    explicit Path(Position at) : at_(std::move(at)) {}
    [[nodiscard]] Pose at(double time_s) const noexcept override { return {at_(time_s), {}}; }
    [[nodiscard]] Vec3 velocity_m_s(double time_s) const noexcept override {
        return (at_(time_s + 1) - at_(time_s - 1)) / 2;
    }
    [[nodiscard]] scene::PoseAges ages(double /*time_s*/) const noexcept override { return {}; }
    [[nodiscard]] std::vector<double> times_s() const override { return {0}; }

private:
    Position at_;
};

scene::Body ball(const std::string& name, double radius_m, Path::Position at) {
    scene::Body body{name,
                     renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                     renderer::LambertParameters{0.5},
                     {}};
    body.motion.path = std::make_shared<Path>(std::move(at));
    return body;
}

/// One plane of all truth maps, time 0.
class Maps {
public:
    explicit Maps(const renderer::Renderer& r) : values_(renderer::aov_count * size * size) {
        const std::vector<RowTime> times(size);
        renderer::RenderRequest request;
        request.window = {0, 0, size, size};
        request.rows = size;
        request.row_times = times;
        CHECK(r.render_aovs(request, values_));
    }
    [[nodiscard]] double at(Aov aov, int x, int y) const {
        return static_cast<double>(
            values_[(static_cast<std::size_t>(aov) * size + static_cast<std::size_t>(y)) * size +
                    static_cast<std::size_t>(x)]);
    }

private:
    std::vector<float> values_;
};

/// Time at which light left a point that moves as `at` for a camera at `camera_m` at `time_s`.
double emitted_s(const Path::Position& at, Vec3 camera_m, double time_s) {
    double t = time_s;
    for (int i = 0; i < 50; ++i)
        t = time_s - length(at(t) - camera_m) / light_speed_m_s;
    return t;
}

/// Unit direction in which a camera that moves sees what is along `d`: the textbook formula.
Vec3 seen_moving(Vec3 d, Vec3 velocity_m_s) {
    const double beta = length(velocity_m_s) / light_speed_m_s;
    if (beta == 0) return d;
    const Vec3 along = normalized(velocity_m_s);
    const double cosine = dot(d, along), gamma = 1 / std::sqrt(1 - beta * beta);
    const Vec3 across = d - cosine * along;
    return (along * (cosine + beta) + across / gamma) / (1 + beta * cosine);
}

ImagePoint image_of(const scene::Camera& c, Vec3 direction) {
    const Vec3 d = rotate(conjugate(c.motion.samples[0].pose.orientation), direction);
    const double f = c.focal_length_m / c.pixel_pitch_m;
    return {(size - 1) / 2.0 + f * d.x / d.z, (size - 1) / 2.0 + f * d.y / d.z};
}

} // namespace

TEST_CASE("What moves with the camera is seen where it is at rest, from any height") {
    constexpr double radius_m = 1.7374e6;
    for (const double height_m : {1.0, 1e3, 1e4, 1e6})
        for (const Vec3 velocity : {Vec3{0, 30e3, 0}, Vec3{20e3, -10e3, 20e3}, Vec3{30e3, 0, 0}}) {
            INFO(height_m << " m, " << velocity.x << ' ' << velocity.y);
            const double pixel_rad = 1e-4; // 10 um at 100 mm
            const auto scene_of = [&](Vec3 v) {
                scene::Scene s;
                s.light_time = s.aberration = true;
                s.bodies.push_back(ball("moon", radius_m, [v](double t) { return v * t; }));
                s.camera = test::camera_at({radius_m + height_m, 0, 0}, size, pixel_rad);
                const Pose pose = s.camera.motion.samples[0].pose;
                s.camera.motion.samples = {{-1e4, {pose.position_m - v * 1e4, pose.orientation}},
                                           {1e4, {pose.position_m + v * 1e4, pose.orientation}}};
                s.sun.position_m = {astronomical_unit_m, 0.3 * astronomical_unit_m, 0};
                for (const double y : {-20.0, 0.0, 13.0}) {
                    scene::Landmark mark;
                    mark.name = std::to_string(y);
                    mark.body = "moon";
                    const double a = y * pixel_rad * height_m;
                    mark.position_m = radius_m * normalized(Vec3{radius_m, a, 0.7 * a});
                    s.landmarks.push_back(mark);
                }
                return s;
            };
            const renderer::Renderer moving(scene_of(velocity), {1, 2, 1});
            const renderer::Renderer resting(scene_of({}), {1, 2, 1});
            const auto marks = test::truth_entries(moving, TruthKind::landmark, size);
            const auto wanted = test::truth_entries(resting, TruthKind::landmark, size);
            REQUIRE(marks.size() == 3);
            REQUIRE(wanted.size() == 3);
            for (std::size_t i = 0; i < 3; ++i) {
                CHECK_THAT(marks[i].x_px, WithinAbs(wanted[i].x_px, 1e-3));
                CHECK_THAT(marks[i].y_px, WithinAbs(wanted[i].y_px, 1e-3));
                CHECK(marks[i].visible_share == wanted[i].visible_share);
            }
            const Maps maps(moving), rest(resting);
            const double px_deg = pixel_rad * height_m / radius_m * 180 / std::numbers::pi;
            for (const auto& [x, y] : {std::pair{3, 5}, {32, 31}, {60, 12}, {40, 63}}) {
                CHECK_THAT(maps.at(Aov::longitude_deg, x, y),
                           WithinAbs(rest.at(Aov::longitude_deg, x, y), 0.001 * px_deg));
                CHECK_THAT(maps.at(Aov::latitude_deg, x, y),
                           WithinAbs(rest.at(Aov::latitude_deg, x, y), 0.001 * px_deg));
                // The path of light, as an observer at rest measures it.
                CHECK_THAT(maps.at(Aov::range_m, x, y), WithinRel(rest.at(Aov::range_m, x, y), 2e-4));
            }
        }
}

TEST_CASE("A distant body in its orbit is seen where each of its points was") {
    // Io's orbit of 17.3 km/s, seen from far and from near, by a camera that moves too.
    constexpr double orbit_m = 4.217e8, rate = 4.11e-5, radius_m = 1.8216e6;
    const Vec3 drift{-4e3, 12e3, 1e3};
    for (const double distance_m : {6.3e11, 4e8, 3e6}) {
        INFO(distance_m);
        const Path::Position centre = [&](double t) {
            const double a = 0.7 + rate * (t + distance_m / light_speed_m_s);
            const double a0 = 0.7;
            const double s = t + distance_m / light_speed_m_s;
            return drift * s +
                   Vec3{0, orbit_m * (std::cos(a) - std::cos(a0)), orbit_m * (std::sin(a) - std::sin(a0))};
        };
        scene::Scene s;
        s.light_time = s.aberration = true;
        s.bodies.push_back(ball("moon", radius_m, centre));
        const double apparent_rad = std::asin(radius_m / distance_m);
        s.camera = test::camera_at({distance_m, 0, 0}, size, apparent_rad / 25);
        s.camera.velocity_m_s = {-7e3, 21e3, 5e3};
        s.camera.motion.aim = scene::Aim{.body = "moon", .point_m = {}, .up = {0, 0, 1}};
        s.sun.position_m = {astronomical_unit_m * 3, astronomical_unit_m, 0};
        const Vec3 camera_m = s.camera.motion.samples[0].pose.position_m;
        std::vector<Vec3> points;
        for (const double a : {0.0, 0.5, 2.2, 3.9, 5.3}) {
            scene::Landmark mark;
            mark.name = std::to_string(a);
            mark.body = "moon";
            const double off = a == 0 ? 0 : 0.8;
            // On the near side, also from 3000 km.
            mark.position_m =
                radius_m * normalized(Vec3{1, off * std::cos(a) * 0.8, off * std::sin(a) * 0.8});
            points.push_back(*mark.position_m);
            s.landmarks.push_back(mark);
        }
        const renderer::Renderer r(s, {1, 2, 1});
        const auto marks = test::truth_entries(r, TruthKind::landmark, size);
        REQUIRE(marks.size() == points.size());
        const Path::Position& c = centre;
        // The camera's attitude by the same equation, of the centre.
        scene::Camera at_rest = s.camera;
        {
            const Vec3 d = normalized(c(emitted_s(c, camera_m, 0)) - camera_m);
            at_rest.motion.samples[0].pose.orientation =
                look_along(seen_moving(d, s.camera.velocity_m_s), {0, 0, 1});
        }
        const auto wanted_at = [&](Vec3 point, double& range_m) {
            const Path::Position moving = [&](double t) { return c(t) + point; };
            const Vec3 to = moving(emitted_s(moving, camera_m, 0)) - camera_m;
            range_m = length(to);
            return image_of(at_rest, seen_moving(to / range_m, s.camera.velocity_m_s));
        };
        for (std::size_t i = 0; i < points.size(); ++i) {
            double range_m = 0;
            const ImagePoint wanted = wanted_at(points[i], range_m);
            CHECK_THAT(marks[i].x_px, WithinAbs(wanted.x, 1e-4));
            CHECK_THAT(marks[i].y_px, WithinAbs(wanted.y, 1e-4));
            CHECK_THAT(marks[i].range_m, WithinRel(range_m, 1e-9));
        }
        const Maps maps(r);
        for (const auto& [x, y] : {std::pair{32, 31}, {20, 25}, {40, 40}, {31, 45}}) {
            const double lon = maps.at(Aov::longitude_deg, x, y) * std::numbers::pi / 180;
            const double lat = maps.at(Aov::latitude_deg, x, y) * std::numbers::pi / 180;
            const Vec3 point =
                radius_m * Vec3{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
            double range_m = 0;
            const ImagePoint wanted = wanted_at(point, range_m);
            CHECK_THAT(wanted.x, WithinAbs(x, 1e-4));
            CHECK_THAT(wanted.y, WithinAbs(y, 1e-4));
            CHECK_THAT(maps.at(Aov::range_m, x, y), WithinRel(range_m, 1e-7));
            const Vec3 forward = rotate(at_rest.motion.samples[0].pose.orientation, {0, 0, 1});
            CHECK(std::abs(dot(forward, Vec3{1, 0, 0})) > 0.99);
        }
    }
}

TEST_CASE("A moon's shadow is on its planet where light left the Sun past both") {
    // The moon at 17 km/s crosses the line to the Sun, the planet runs at 13 km/s; from afar.
    constexpr double planet_m = 3e6, moon_m = 6e5, apart_m = 1.2e8;
    const Vec3 of_planet{3e3, 13e3, 0};
    for (const double distance_m : {6e11, 5e7}) {
        INFO(distance_m);
        const double light_s = distance_m / light_speed_m_s;
        const Path::Position planet = [&](double t) { return of_planet * (t + light_s); };
        const Path::Position moon = [&](double t) {
            const double s = t + light_s, a = s * 17e3 / apart_m;
            return of_planet * s + Vec3{apart_m * std::cos(a), apart_m * std::sin(a), 1e6};
        };
        scene::Scene s;
        s.light_time = true;
        s.bodies.push_back(ball("planet", planet_m, planet));
        s.sun.radius_m = 1000; // sharp shadows
        s.sun.position_m = {5 * astronomical_unit_m, 0, 0};
        s.camera = test::camera_at(distance_m * normalized(Vec3{1, 0.4, 0.1}), size,
                                   std::asin(planet_m / distance_m) / 25);
        s.camera.motion.aim = scene::Aim{.body = "planet", .point_m = {}, .up = {0, 0, 1}};
        const Vec3 camera_m = s.camera.motion.samples[0].pose.position_m;
        scene::Scene alone = s;
        s.bodies.push_back(ball("moon", moon_m, moon));
        // Depth of a point of the planet in the shadow's cylinder, m.
        const auto in_shadow_m = [&](Vec3 point) {
            const Path::Position moving = [&](double t) { return planet(t) + point; };
            const double t = emitted_s(moving, camera_m, 0);
            const Vec3 from = moving(t), to_sun = normalized(s.sun.position_m - from);
            double along = 0;
            for (int i = 0; i < 50; ++i)
                along = dot(moon(t - along / light_speed_m_s) - from, to_sun);
            return moon_m - length(cross(moon(t - along / light_speed_m_s) - from, to_sun));
        };
        // Landmarks at both sides of the shadow's edge.
        std::vector<bool> lit;
        for (int k = 0; k < 8; ++k) {
            const double a = 0.3 + k * std::numbers::pi / 4;
            const auto at = [&](double off_m) {
                return planet_m * normalized(Vec3{planet_m, off_m * std::cos(a), 1e6 + off_m * std::sin(a)});
            };
            double inner_m = 0, outer_m = 1.5e6;
            for (int i = 0; i < 50; ++i) {
                const double middle_m = (inner_m + outer_m) / 2;
                (in_shadow_m(at(middle_m)) > 0 ? inner_m : outer_m) = middle_m;
            }
            for (const double off_m : {-3000.0, -30.0, 30.0, 3000.0}) {
                scene::Landmark mark;
                mark.name = std::to_string(k) + std::to_string(off_m);
                mark.body = "planet";
                mark.position_m = at(inner_m + off_m);
                s.landmarks.push_back(mark);
                lit.push_back(off_m > 0);
            }
        }
        for (const std::uint32_t bounces : {0U, 1U}) {
            INFO(bounces << " bounces");
            renderer::RenderSettings settings{256, 2, 1};
            settings.max_bounces = bounces;
            const renderer::Renderer r(s, settings);
            const auto marks = test::truth_entries(r, TruthKind::landmark, size);
            CHECK(marks.size() == lit.size());
            for (const TruthEntry& mark : marks) {
                INFO(mark.item);
                CHECK(mark.lit == lit[static_cast<std::size_t>(mark.item)]);
            }
            // By the picture: the dark area and its centre.
            const test::Image image = test::render(r),
                              bright = test::render(renderer::Renderer(alone, settings));
            const Maps maps(r);
            double dark = 0, dark_x = 0, dark_y = 0, wanted = 0, wanted_x = 0, wanted_y = 0;
            constexpr int fine = 8;
            for (int y = 0; y < size; ++y)
                for (int x = 0; x < size; ++x) {
                    if (maps.at(Aov::body, x, y) != 1 || maps.at(Aov::emission_deg, x, y) > 60 ||
                        bright.at(x, y) <= 0)
                        continue;
                    const double share =
                        1 - static_cast<double>(image.at(x, y)) / static_cast<double>(bright.at(x, y));
                    dark += share, dark_x += share * x, dark_y += share * y;
                    // About the pixel's centre by the truth maps, whose derivatives are good enough.
                    const auto point_at = [&](int px, int py) {
                        const double lon = maps.at(Aov::longitude_deg, px, py) * std::numbers::pi / 180;
                        const double lat = maps.at(Aov::latitude_deg, px, py) * std::numbers::pi / 180;
                        return planet_m * Vec3{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon),
                                               std::sin(lat)};
                    };
                    const Vec3 p = point_at(x, y), dx = (point_at(x + 1, y) - point_at(x - 1, y)) / 2,
                               dy = (point_at(x, y + 1) - point_at(x, y - 1)) / 2;
                    int inside = 0;
                    for (int j = 0; j < fine; ++j)
                        for (int i = 0; i < fine; ++i)
                            inside += in_shadow_m(planet_m * normalized(p + dx * ((i + 0.5) / fine - 0.5) +
                                                                        dy * ((j + 0.5) / fine - 0.5))) > 0
                                          ? 1
                                          : 0;
                    const double part = static_cast<double>(inside) / (fine * fine);
                    wanted += part, wanted_x += part * x, wanted_y += part * y;
                }
            REQUIRE(wanted > 20);
            CHECK_THAT(dark, WithinRel(wanted, 0.01));
            CHECK_THAT(dark_x / dark, WithinAbs(wanted_x / wanted, 0.03));
            CHECK_THAT(dark_y / dark, WithinAbs(wanted_y / wanted, 0.03));
        }
    }
}

} // namespace light_time_test
