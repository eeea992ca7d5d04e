// SPDX-License-Identifier: Apache-2.0
// The pixel probe held against an analytic sphere, the frame's own light and the truth of its pixels.
#include "emulator/config/daemon_config.hpp"
#include "emulator/unit/assemble.hpp"
#include "emulator/unit/pixel_probe.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace pixel_probe_test {

using namespace obscura;
using namespace obscura::emulator;
using Catch::Matchers::WithinRel;

namespace {

constexpr double degrees = 180 / std::numbers::pi;
constexpr double radius_m = 1000, albedo = 0.25;
constexpr double sun_w_m2 = 758.328; ///< ASTM E490, 400 to 900 nm at 1 au, as in render_truth_test.cpp
constexpr double au_m = 149'597'870'700.0;

/// A sphere of 24 px in a camera of 40 x 30 px of 5.5 um; its axes are turned.
std::string
sphere_scene(const std::string& motion = "position_m = [0, 0, 0]\norientation = [0.8, 0.48, 0, 0.36]\n") {
    return fmt::format(R"(
[sun]
direction = [-0.6, 0.64, 0.48]
distance_au = 1
[camera]
focal_length_mm = 66
aperture_mm = 50
psf_sigma_px = 0
position_m = [-1e6, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
[[body]]
name = "sphere"
shape = "ellipsoid"
radii_m = [{0}, {0}, {0}]
material = "lambert"
albedo = {1}
{2})",
                       radius_m, albedo, motion);
}

/// A camera, a frame of it, and the probe.
struct Rig {
    explicit Rig(const std::string& scene, const std::string& settings = "", std::uint64_t frame_id = 1)
        : config(load(scene, settings)), imaging(config, 2, {}, {.pixels = true}) {
        for (std::uint64_t id = 1; id <= frame_id; ++id)
            make(id);
    }
    DaemonConfig load(const std::string& scene, const std::string& settings) {
        folder.write("scene.toml", scene);
        // Tables of the test may come from [sensor.readout] on.
        return load_config(folder.write("c.toml", "[scene]\nfile = \"scene.toml\"\n[gige]\nenabled = false\n"
                                                  "[sensor.readout]\nwidth = 40\nheight = 30\n" +
                                                      settings));
    }
    void make(std::uint64_t frame_id) {
        frame = {};
        frame = imaging.pool->acquire();
        REQUIRE(imaging.maker->make(imaging.nominal_order(frame_id), *frame).empty());
        rows.assign(frame->row_times().begin(), frame->row_times().end());
    }
    ProbedPixel operator()(std::int32_t x, std::int32_t y) {
        if (!probe)
            probe = std::make_unique<PixelProbe>(
                std::make_shared<const scene::Scene>(imaging.renderer->scene()), probe_settings(config));
        const auto origin = imaging.maker->origins().find(frame->info.frame_id, frame->info.trigger_edge);
        REQUIRE(origin);
        return probe->probe({frame->info, rows, *origin}, x, y, go_on);
    }
    /// Irradiance of all pixels, rendered again.
    std::vector<float> irradiance() {
        (void)(*this)(0, 0);
        const auto origin = imaging.maker->origins().find(frame->info.frame_id, frame->info.trigger_edge);
        REQUIRE(origin);
        return probe->irradiance({frame->info, rows, *origin}, go_on);
    }
    /// Light of the frame, as the detector got it.
    std::vector<float> light() {
        const sensors::ReadoutPlan& plan = imaging.maker->plan();
        std::vector<float> image(static_cast<std::size_t>(plan.width) *
                                 static_cast<std::size_t>(plan.height));
        for (const FrameWindow& window : plan.windows) {
            renderer::RenderRequest request;
            request.window = window.sensor;
            request.rows = window.sensor.height;
            request.row_times = imaging.maker->shown_rows().subspan(static_cast<std::size_t>(window.image_y),
                                                                    static_cast<std::size_t>(request.rows));
            request.common_mid = renderer::common_mid(imaging.maker->shown_rows());
            request.frame_id = frame->info.frame_id;
            std::vector<float> part(static_cast<std::size_t>(window.sensor.area()));
            imaging.renderer->render(request, part);
            for (std::int32_t r = 0; r < request.rows; ++r)
                std::copy_n(part.begin() + r * window.sensor.width, window.sensor.width,
                            image.begin() + (window.image_y + r) * plan.width);
        }
        return image;
    }

    test::TempFolder folder;
    DaemonConfig config;
    Imaging imaging;
    FrameRef frame;
    std::vector<RowTime> rows;
    std::unique_ptr<PixelProbe> probe;
    std::atomic<bool> go_on{false};
};

/// Where the ray through a pixel's centre meets the sphere.
struct Hit {
    double range_m, latitude_deg, longitude_deg, incidence_deg, emission_deg, phase_deg;
    double irradiance_w_m2; ///< of the pixel, as if it were all alike
};

std::optional<Hit> meet(const FrameInfo& info, const Pose& body, std::int32_t x, std::int32_t y) {
    const Intrinsics& lens = info.truth.intrinsics;
    const Vec3 ray{(x - lens.principal_point_px[0]) / lens.focal_length_px[0],
                   (y - lens.principal_point_px[1]) / lens.focal_length_px[1], 1};
    const Vec3 eye = info.truth.camera.position_m;
    const Vec3 direction = normalized(rotate(info.truth.camera.orientation, ray));
    const Vec3 from = eye - body.position_m;
    const double along = -dot(from, direction);
    // The distance of the ray from the centre, without cancellation.
    const double off = length(cross(from, direction));
    if (off >= radius_m) return std::nullopt;
    const double range = along - std::sqrt(radius_m * radius_m - off * off);
    const Vec3 normal = (from + direction * range) / radius_m;
    const Vec3 there = body.position_m + normal * radius_m;
    const Vec3 to_sun = normalized(info.truth.sun_position_m - there);
    const Vec3 own = rotate(conjugate(body.orientation), normal);
    const auto angle = [](Vec3 a, Vec3 b) { return std::atan2(length(cross(a, b)), dot(a, b)) * degrees; };
    Hit hit{range,
            std::asin(own.z) * degrees,
            std::atan2(own.y, own.x) * degrees,
            angle(normal, to_sun),
            angle(normal, -direction),
            angle(to_sun, -direction),
            0};
    const double solid_angle =
        1 / (lens.focal_length_px[0] * lens.focal_length_px[1]) / std::pow(length(ray), 3);
    const double distance_au = length(info.truth.sun_position_m - there) / au_m;
    hit.irradiance_w_m2 = std::max(0.0, dot(normal, to_sun)) * albedo / std::numbers::pi * sun_w_m2 /
                          (distance_au * distance_au) * solid_angle;
    return hit;
}

void check_geometry(const ProbedPixel& pixel, const Hit& hit) {
    CHECK(pixel.body == "sphere");
    CHECK_THAT(*pixel.range_m, WithinRel(hit.range_m, 1e-6));
    CHECK_THAT(*pixel.latitude_deg, WithinRel(hit.latitude_deg, 1e-6));
    CHECK_THAT(*pixel.longitude_deg, WithinRel(hit.longitude_deg, 1e-6));
    CHECK_THAT(*pixel.incidence_deg, WithinRel(hit.incidence_deg, 1e-6));
    CHECK_THAT(*pixel.emission_deg, WithinRel(hit.emission_deg, 1e-6));
    CHECK_THAT(*pixel.phase_deg, WithinRel(hit.phase_deg, 1e-6));
}

} // namespace

TEST_CASE("the probe of a Lambert sphere tells its geometry and light") {
    Rig rig(sphere_scene(), "[render]\nsamples_per_pixel = 64\ntarget_error = 0\n");
    const Pose body{{0, 0, 0}, {0.8, 0.48, 0, 0.36}};
    int hits = 0, misses = 0;
    double sum = 0, wanted = 0;
    for (std::int32_t y = 0; y < 30; y += 3)
        for (std::int32_t x = 0; x < 40; x += 2) {
            CAPTURE(x, y);
            const ProbedPixel pixel = rig(x, y);
            const auto hit = meet(rig.frame->info, body, x, y);
            REQUIRE(pixel.body.has_value() == hit.has_value());
            if (!hit) {
                ++misses;
                CHECK_FALSE((pixel.range_m || pixel.latitude_deg || pixel.longitude_deg ||
                             pixel.incidence_deg || pixel.emission_deg || pixel.phase_deg));
                continue;
            }
            ++hits;
            check_geometry(pixel, *hit);
            CHECK(pixel.samples == 64);
            // Away from limb and terminator a pixel is nearly all alike.
            if (hit->incidence_deg > 70 || hit->emission_deg > 60) continue;
            CHECK_THAT(pixel.irradiance_w_m2.at(0), WithinRel(hit->irradiance_w_m2, 0.02));
            sum += pixel.irradiance_w_m2.at(0);
            wanted += hit->irradiance_w_m2;
        }
    CHECK(hits > 60);
    CHECK(misses > 60);
    REQUIRE(wanted > 0);
    CHECK_THAT(sum, WithinRel(wanted, 0.003));
}

TEST_CASE("light and electrons of the probe are those of the frame") {
    // What spreads charge, and differs from pixel to pixel.
    const std::string pattern = R"(
[sensor.detector]
crosstalk_edge = 0.03
crosstalk_corner = 0.01
prnu_local = 0.02
prnu_global = 0.02
dark_nonuniformity_e_per_s = 20
dark_current_e_per_s = 200
hot_fraction = 0.05
hot_current_e_per_s = 5000
rts_fraction = 0.1
rts_current_e_per_s = 3000
hit_flux_per_cm2_s = 200000
)";
    const auto [name, settings] = GENERATE_COPY(
        std::pair{"rolling", pattern + "blooming = 0.8\nfull_well_e = 3000\n[camera]\nexposure_us = 60000\n"},
        std::pair{"global",
                  "shutter = \"global\"\n" + pattern + "parasitic_light = 0.01\n[daemon]\nrun = 7\n"},
        std::pair{"smear", "shutter = \"global\"\n" + pattern + "smear_row_ns = 100000\n"},
        std::pair{"windows", pattern +
                                 "[[camera.window]]\nwidth = 12\nheight = 9\noffset_x = 10\noffset_y = 8\n"
                                 "[[camera.window]]\nwidth = 20\nheight = 6\noffset_x = 20\noffset_y = 17\n"
                                 "exposure_us = 3000\n"},
        std::pair{"push-broom",
                  "shutter = \"push-broom\"\nline_rate_hz = 100\n[sensor.detector]\nprnu_local = 0.02\n"
                  "dark_nonuniformity_e_per_s = 20\nhit_flux_per_cm2_s = 200000\n"
                  "[camera]\noffset_y = 14\nheight = 12\nexposure_us = 5000\n"},
        std::pair{"shared samples", "shutter = \"global\"\n" + pattern +
                                        "[render]\nsamples_per_pixel = 1\ntarget_error = 0.05\n"});
    CAPTURE(name);
    std::string scene = sphere_scene();
    if (std::string(name) == "shared samples")
        scene.replace(scene.find("psf_sigma_px = 0"), 16, "psf_sigma_px = 0.5");
    Rig rig(scene, settings, 3);
    const bool lines = rig.config.sensor.readout.shutter == Shutter::push_broom;
    const std::vector<float> light = lines ? std::vector<float>() : rig.light();
    const std::vector<float>& mean_e = rig.frame->pixel_truth()->mean_e;
    const FrameInfo& info = rig.frame->info;
    std::string others;
    int lit = 0, wrong_light = 0, wrong_charge = 0, places = 0;
    for (std::int32_t y = 0; y < info.height; ++y)
        for (std::int32_t x = 0; x < info.width; ++x) {
            // Edges, corners, and a lattice of what is between.
            const bool edge = x == 0 || y == 0 || x == info.width - 1 || y == info.height - 1;
            if ((!edge && (x + 3 * y) % 7 != 0) || (edge && (x + y) % 3 != 0) || !window_of(info, x, y))
                continue;
            const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(info.width) +
                                   static_cast<std::size_t>(x);
            const ProbedPixel pixel = rig(x, y);
            ++places;
            lit += pixel.irradiance_w_m2.at(0) > 0 ? 1 : 0;
            if (!lines) wrong_light += pixel.irradiance_w_m2.at(0) != static_cast<double>(light[at]) ? 1 : 0;
            REQUIRE(pixel.mean_e);
            if (*pixel.mean_e != static_cast<double>(mean_e[at])) {
                ++wrong_charge;
                others += fmt::format("{}, {}: {} e-, frame {}\n", x, y, *pixel.mean_e, mean_e[at]);
            }
        }
    CHECK(places > 30);
    CHECK(lit > 10);
    if (!lines) CHECK(rig.irradiance() == light);
    CHECK(wrong_light == 0);
    INFO(others);
    CHECK(wrong_charge == 0);
}

TEST_CASE("a pixel of a rolling shutter is that of its row's own time, in the time that the scene shows") {
    // 40 m/s along the rows' direction of time; the scene runs at twice the speed, from 3 s on.
    const std::string moving = "trajectory = \"fall.csv\"\n";
    const std::string fall = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,-200,-400,1,0,0,0\n10,0,200,400,1,0,0,0\n";
    const test::TempFolder other;
    struct Moving : Rig {
        explicit Moving(const std::string& table)
            : Rig(sphere_scene("trajectory = \"" + table + "\"\n"),
                  "pixel_clock_hz = 4e3\n[camera]\nexposure_us = 40000\n"
                  "[daemon]\nscene_start_s = 3\nscene_rate = 2\n[render]\nmax_instants = 1\n",
                  2) {}
    };
    Moving rig(other.write("fall.csv", fall).string());
    REQUIRE(rig.rows[29].mid() - rig.rows[0].mid() > 200 * ns_per_ms);
    int moved = 0;
    const auto origin = *rig.imaging.maker->origins().find(2, rig.frame->info.trigger_edge);
    for (std::int32_t y = 2; y < 30; y += 4)
        for (const std::int32_t x : {17, 21}) {
            CAPTURE(x, y);
            const auto& row = rig.rows[static_cast<std::size_t>(y)];
            const double shown_s = 3 + 2 * to_seconds((row.mid() - origin.scene_to_clock_ns).ns);
            const Pose body{{0, -200 + 40 * shown_s, -400 + 80 * shown_s}, {}};
            const ProbedPixel pixel = rig(x, y);
            CHECK(pixel.row_mid == row.mid());
            const auto hit = meet(rig.frame->info, body, x, y);
            REQUIRE(pixel.body.has_value() == hit.has_value());
            if (!hit) continue;
            check_geometry(pixel, *hit);
            // At mid-exposure of the frame it would be another place.
            const auto frozen = meet(rig.frame->info, rig.frame->info.truth.bodies[0].pose, x, y);
            moved += !frozen || std::abs(frozen->latitude_deg - hit->latitude_deg) > 0.1 ? 1 : 0;
        }
    CHECK(moved > 6);
    const std::vector<float> light = rig.light();
    for (std::int32_t y = 0; y < 30; ++y)
        CHECK(rig(19, y).irradiance_w_m2.at(0) ==
              static_cast<double>(light[static_cast<std::size_t>(y) * 40 + 19]));
}

TEST_CASE("poses that came after the frame do not change what its pixels showed") {
    Rig rig(sphere_scene(),
            "shutter = \"global\"\n[simulator]\nenabled = true\nmax_extrapolation_ms = 1000\n"
            "[camera]\nexposure_us = 1000\n",
            1);
    PoseRing& ring = *rig.imaging.poses.at("sphere");
    PoseRing& camera = *rig.imaging.poses.at("camera");
    const Pose eye = rig.frame->info.truth.camera;
    REQUIRE(camera.push(-1, eye));
    // The frame is made with the pose of 0 s and its rates, ...
    REQUIRE(ring.push(0, {{0, 0, 0}, {}}, PoseRates{{0, 3000, 0}, {0, 0, 0.2}}));
    rig.make(2);
    const Pose then = rig.frame->info.truth.bodies[0].pose;
    REQUIRE(then.position_m.y > 100);
    const auto check = [&] {
        for (const std::int32_t x : {18, 22, 25}) {
            const auto hit = meet(rig.frame->info, then, x, 12);
            REQUIRE(hit);
            check_geometry(rig(x, 12), *hit);
        }
    };
    check();
    // ... it was elsewhere, and went on until the poses of then are gone.
    for (int i = 1; i < 100; ++i) {
        REQUIRE(ring.push(0.01 * i, {{0, 0, 100.0 * i}, {0, 0, 1, 0}}));
        if (i == 1 || i == 20 || i == 99) check();
    }
}

TEST_CASE("a pixel right of a narrow window is of none") {
    FrameInfo info;
    info.window_count = 2;
    info.windows[0].sensor = {3, 3, 10, 4};
    info.windows[1].sensor = {0, 9, 6, 2};
    info.windows[1].image_y = 4;
    CHECK(window_of(info, 9, 3) == 0);
    CHECK(window_of(info, 5, 5) == 1);
    CHECK_FALSE(window_of(info, 6, 4));
    CHECK_FALSE(window_of(info, 0, 6));
}

TEST_CASE("origins are kept of the latest frames, by number and edge") {
    const auto origins = std::make_unique<FrameOrigins>();
    CHECK_FALSE(origins->find(1, Time{5}));
    FrameOrigin origin;
    for (std::uint64_t id = 1; id <= FrameOrigins::capacity + 1; ++id) {
        origin.frame_id = id;
        origin.trigger_edge = Time{static_cast<std::int64_t>(5 * id)};
        origin.scene_to_clock_ns = -static_cast<std::int64_t>(id);
        origin.shown = {Time{1}, Time{-2}, 0.5};
        origin.black_level_dn = 12.5;
        origin.pattern = id % 2 == 0;
        origins->note(origin);
    }
    CHECK_FALSE(origins->find(1, Time{5}));
    const auto found = origins->find(2, Time{10});
    REQUIRE(found);
    CHECK(found->scene_to_clock_ns == -2);
    CHECK(found->shown.at(Time{21}) == Time{8});
    CHECK(found->black_level_dn == 12.5);
    CHECK(found->pattern);
    CHECK_FALSE(origins->find(2, Time{11}));
    origin.frame_id = 2; // of the next acquisition
    origins->note(origin);
    CHECK(origins->find(2, origin.trigger_edge)->scene_to_clock_ns == origin.scene_to_clock_ns);
}

} // namespace pixel_probe_test
