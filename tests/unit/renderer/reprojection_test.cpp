// SPDX-License-Identifier: Apache-2.0
// Reprojection: rows made from the light of another frame against rows rendered at the same instant.
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "renderer/work_clock.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace reprojection_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr std::int32_t size = 256;
constexpr Region field{0, 0, size, size};
constexpr double pixels = static_cast<double>(size) * size;

/// A body of 90 px in radius, 144 rays a pixel.
scene::Scene asteroid(double radius_px = 90) {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 0.7, radius_px, size);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.9, 0.8}, 1, 5};
    return s;
}

scene::Scene ball(double radius_px = 90) {
    return sphere_scene(renderer::LommelSeeligerParameters{0.2}, 0.7, radius_px, size);
}

renderer::Renderer renderer_of(const scene::Scene& scene, std::uint32_t threads = 2,
                               std::uint32_t samples = 144) {
    return {scene, renderer::RenderSettings{samples, threads, 5}};
}

struct Kept {
    explicit Kept(const renderer::Renderer& r) : light(r, size, size) {}
    renderer::ReprojectionSource light;
};

/// Rows of `size` at `t`, each `between_ns` later than the one above.
std::vector<RowTime> rows_at(Time t, std::int64_t between_ns = 0) {
    std::vector<RowTime> times;
    for (std::int32_t y = 0; y < size; ++y)
        times.push_back({t + y * between_ns, t + y * between_ns});
    return times;
}

std::vector<float> frame(const renderer::Renderer& r, const std::vector<RowTime>& times,
                         renderer::ReprojectionSource* keep, renderer::ReprojectionSource* from = nullptr,
                         QualityLevel level = QualityLevel::full, std::int32_t block = size,
                         std::uint64_t frame_id = 1, std::vector<float>* variance = nullptr,
                         renderer::Workspace* alone = nullptr) {
    if (keep != nullptr) keep->begin_frame(renderer::KeptWindow{field});
    if (from != nullptr) from->begin_reprojection();
    std::vector<float> image(static_cast<std::size_t>(size) * size * r.band_count());
    if (variance != nullptr) variance->assign(static_cast<std::size_t>(size) * size, 0);
    const std::vector<QualityLevel> levels(static_cast<std::size_t>(size), level);
    for (std::int32_t first = 0; first < size; first += block) {
        renderer::RenderRequest request;
        request.window = field;
        request.first_row = first;
        request.rows = std::min(block, size - first);
        const auto at = static_cast<std::size_t>(first);
        const auto rows = static_cast<std::size_t>(request.rows);
        request.row_times = std::span(times).subspan(at, rows);
        request.common_mid = renderer::common_mid(times);
        request.frame_id = frame_id;
        request.frame_times = times;
        request.levels = std::span(levels).subspan(at, rows);
        request.plane_rows = size;
        request.keep = keep;
        request.from = from;
        if (variance != nullptr) request.variance = std::span(*variance).subspan(at * size, rows * size);
        request.alone = alone;
        REQUIRE(r.render(request, std::span(image).subspan(at * size)));
    }
    return image;
}

double rms(const std::vector<float>& a) {
    double sum = 0;
    for (const float v : a)
        sum += static_cast<double>(v) * static_cast<double>(v);
    return std::sqrt(sum / pixels);
}

/// Root mean square of the difference over that of the image.
double error(const std::vector<float>& a, const std::vector<float>& truth) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(truth[i]);
        sum += d * d;
    }
    return std::sqrt(sum / pixels) / rms(truth);
}

/// Largest shift of the bright limb from one image to the other, along rows from the right, means of 16 rows:
/// the difference of the light about it over the brightness inside of it.
double limb_shift_px(const std::vector<float>& a, const std::vector<float>& b) {
    const double bright = 0.4 * static_cast<double>(*std::max_element(b.begin(), b.end()));
    double most = 0;
    for (std::int32_t group = size / 2 - 48; group < size / 2 + 48; group += 16) {
        double sum = 0;
        int rows = 0;
        for (std::int32_t y = group; y < group + 16; ++y) {
            const auto at = [&](const std::vector<float>& image, int k) {
                return static_cast<double>(image[static_cast<std::size_t>(y * size + size - 1 - k)]);
            };
            int first = 0;
            while (first < size - 12 && !(at(b, first) > 0))
                ++first;
            const double inside = (at(b, first + 5) + at(b, first + 6)) / 2;
            if (first < 6 || inside < bright) continue;
            for (int k = first - 6; k < first + 6; ++k)
                sum += (at(a, k) - at(b, k)) / inside;
            ++rows;
        }
        if (rows > 8) most = std::max(most, std::abs(sum) / rows);
    }
    return most;
}

scene::Motion turning(Vec3 axis, double rate_rad_s) {
    scene::Motion m;
    m.samples = {{0, {}}};
    m.spin_axis = axis;
    m.spin_rate_rad_s = rate_rad_s;
    return m;
}

struct Errors {
    double moved, repeated, floor, limb;
    double moved_estimate, repeated_estimate; ///< with the noise of the two renderings
};

/// Whether the estimates are bounds, and not far from the truth.
void check_estimates(const Errors& e) {
    CAPTURE(e.moved_estimate, e.moved, e.repeated_estimate, e.repeated, e.floor);
    CHECK(e.moved_estimate > 0.8 * e.moved);
    CHECK(e.moved_estimate < 4 * e.moved);
    CHECK(e.repeated_estimate > 0.8 * e.repeated);
    CHECK(e.repeated_estimate < 6 * e.repeated);
}

/// Errors of a frame made at `t` from one at 0, against one that is rendered then.
Errors compare(const renderer::Renderer& r, Time t, std::int64_t between_ns = 0) {
    Kept kept(r);
    const std::vector<float> before = frame(r, rows_at({}, between_ns), &kept.light);
    REQUIRE(kept.light.complete(r));
    const std::vector<RowTime> then = rows_at(t, between_ns);
    const std::vector<float> truth = frame(r, then, nullptr, nullptr, QualityLevel::full, size, 2);
    const std::vector<float> again = frame(r, then, nullptr, nullptr, QualityLevel::full, size, 3);
    std::vector<float> variance;
    const double floor = error(again, truth);
    const auto estimate = [&] {
        double sum = 0;
        for (const float v : variance)
            sum += static_cast<double>(v);
        return std::hypot(std::sqrt(sum / pixels) / rms(truth), floor);
    };
    Errors e{};
    e.floor = floor;
    const std::vector<float> moved =
        frame(r, then, nullptr, &kept.light, QualityLevel::reprojected, size, 1, &variance);
    e.moved = error(moved, truth);
    e.moved_estimate = estimate();
    e.limb = limb_shift_px(moved, truth);
    e.repeated =
        error(frame(r, then, nullptr, &kept.light, QualityLevel::repeated, size, 1, &variance), truth);
    e.repeated_estimate = estimate();
    return e;
}

} // namespace

TEST_CASE("a repeated frame and one reprojected to its own instant are the frame itself") {
    const renderer::Renderer r = renderer_of(asteroid(), 2, 4);
    for (const std::int64_t between_ns : {std::int64_t{0}, ns_per_ms}) {
        Kept kept(r);
        const std::vector<RowTime> times = rows_at({}, between_ns);
        const std::vector<float> whole = frame(r, times, &kept.light);
        CHECK(error(frame(r, times, nullptr, &kept.light, QualityLevel::repeated), whole) < 1e-6);
        CHECK(error(frame(r, times, nullptr, &kept.light, QualityLevel::reprojected), whole) < 1e-5);
    }
}

TEST_CASE("keeping the light of a frame changes nothing in it") {
    const renderer::Renderer r = renderer_of(asteroid(), 2, 4);
    Kept kept(r);
    CHECK(frame(r, rows_at({}), &kept.light) == frame(r, rows_at({}), nullptr));
    CHECK(kept.light.complete(r));
    kept.light.begin_frame(renderer::KeptWindow{field});
    CHECK_FALSE(kept.light.complete(r));
}

TEST_CASE("a camera that turns is reprojected to within the interpolation") {
    scene::Scene s = asteroid();
    // 3 % at the corners of this narrow field.
    s.camera.distortion.model = scene::Distortion::Model::brown_conrady;
    s.camera.distortion.coefficients = {-300};
    const double pixel_rad = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const Quat there = s.camera.motion.samples[0].pose.orientation;
    const Vec3 position = s.camera.motion.samples[0].pose.position_m;
    // 2.4 px to the side and 1.3 px down, rolled by 0.01 rad.
    const Quat turned = there * axis_angle({0, 1, 0}, 2.4 * pixel_rad) *
                        axis_angle({1, 0, 0}, 1.3 * pixel_rad) * axis_angle({0, 0, 1}, 0.01);
    s.camera.motion.samples = {{0, {position, there}}, {1, {position, turned}}};
    const renderer::Renderer r = renderer_of(s);
    for (const std::int64_t between_ns : {std::int64_t{0}, 2 * ns_per_ms}) {
        const Errors e = compare(r, Time{400 * ns_per_ms}, between_ns);
        CAPTURE(between_ns, e.moved, e.repeated, e.floor, e.limb);
        CHECK(e.repeated > 0.02);
        CHECK(e.moved < e.floor + 0.005);
        CHECK(e.limb < 0.05);
        check_estimates(e);
    }
}

/// A copy of the scene's body, and axes of the camera.
struct Behind {
    explicit Behind(scene::Scene& s)
        : camera(s.camera.motion.samples[0].pose),
          ahead(rotate(camera.orientation, {0, 0, 1})),
          right(rotate(camera.orientation, {1, 0, 0})),
          pixel_m(1e5 * s.camera.pixel_pitch_m / s.camera.focal_length_m),
          body(s.bodies[0]) {
        body.name = "behind";
    }
    /// Adds it at `place_m`, and moves the camera by `way_m` in a second.
    void add(scene::Scene& s, Vec3 place_m, Vec3 way_m) {
        body.motion.samples = {{0, {place_m, {}}}};
        s.bodies.push_back(body);
        s.camera.motion.samples = {{0, camera}, {1, {camera.position_m + way_m, camera.orientation}}};
    }

    Pose camera;
    Vec3 ahead, right;
    double pixel_m;
    scene::Body body;
};

TEST_CASE("bodies move by their range as the camera passes them") {
    // Another one behind, partly hidden: its centre 20 km further off.
    scene::Scene s = asteroid(70);
    Behind other(s);
    other.add(s, 2e4 * other.ahead - 600 * other.right, 3 * other.pixel_m * other.right + 200 * other.ahead);
    const renderer::Renderer r = renderer_of(s);
    for (const double share : {0.1, 0.3, 1.0}) {
        const Errors e = compare(r, Time{static_cast<std::int64_t>(share * 1e9)});
        CAPTURE(share, e.moved, e.repeated, e.floor, e.limb);
        CHECK(e.moved < e.floor + 0.002 + 0.025 * share);
        CHECK(e.moved < e.repeated / 4);
        CHECK(e.limb < 0.05);
        check_estimates(e);
    }
}

TEST_CASE("spinning bodies are turned") {
    for (const bool smooth : {true, false}) {
        scene::Scene s = smooth ? ball() : asteroid();
        s.bodies[0].motion = turning({0, 0, 1}, 0.01);
        const renderer::Renderer r = renderer_of(s);
        for (const std::int64_t ms : {50, 200}) {
            const Errors e = compare(r, Time{ms * ns_per_ms});
            CAPTURE(smooth, ms, e.moved, e.repeated, e.floor, e.limb);
            // The light of each place goes with it: it would change by the angle.
            CHECK(e.moved < 1.5 * e.floor + 1e-5 * static_cast<double>(ms));
            if (!smooth) CHECK(e.moved < e.repeated);
            CHECK(e.limb < 0.05);
            check_estimates(e);
            check_estimates(e);
        }
    }
}

TEST_CASE("reprojected rows have the same bytes on any threads and in any parts") {
    scene::Scene s = asteroid();
    s.bodies[0].motion = turning({0, 0, 1}, 0.01);
    s.bodies[0].motion.samples = {{-10, {{0, 0, -400}, {}}}, {10, {{0, 0, 400}, {}}}};
    s.max_bounces = 1; // light in all bands
    const renderer::Renderer one = renderer_of(s, 1, 4);
    const renderer::Renderer two = renderer_of(s, 2, 4);
    for (const std::int64_t between_ns : {std::int64_t{0}, ns_per_ms}) {
        renderer::ReprojectionSource from_one(one, size, size);
        renderer::ReprojectionSource from_two(two, size, size);
        static_cast<void>(frame(one, rows_at({}, between_ns), &from_one));
        static_cast<void>(frame(two, rows_at({}, between_ns), &from_two, nullptr, QualityLevel::full, 48));
        const std::vector<RowTime> then = rows_at(Time{100 * ns_per_ms}, between_ns);
        const std::vector<float> moved = frame(one, then, nullptr, &from_one, QualityLevel::reprojected);
        CHECK(frame(two, then, nullptr, &from_two, QualityLevel::reprojected, 16) == moved);
        CHECK(frame(two, then, nullptr, &from_two, QualityLevel::reprojected, 50) == moved);
        renderer::Workspace alone(two, size, size);
        CHECK(frame(two, then, nullptr, &from_two, QualityLevel::reprojected, 16, 1, nullptr, &alone) ==
              moved);
    }
}

/// A camera that turns about its rows by 0.8 px from line to line, and may turn out to point elsewhere.
struct SweepingPose final : scene::LivePose {
    Pose middle;
    double rad_per_s = 0;
    Quat off{};
    bool at(double time_s, Pose& out) const noexcept override {
        out = middle;
        out.orientation = out.orientation * axis_angle({1, 0, 0}, rad_per_s * time_s) * off;
        return true;
    }
};

TEST_CASE("lines that see what other lines were to see are made of those") {
    scene::Scene s = asteroid(50);
    const double pixel_rad = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const auto pose = std::make_shared<SweepingPose>();
    pose->middle = s.camera.motion.samples[0].pose;
    pose->rad_per_s = 0.8 * pixel_rad / 1e-3;
    s.camera.motion.live = pose;
    const renderer::Renderer r = renderer_of(s);
    std::vector<RowTime> times;
    for (std::int32_t l = 0; l < size; ++l)
        times.push_back(
            {Time{(l - size / 2) * ns_per_ms}, Time{(l - size / 2) * ns_per_ms + 900 * ns_per_us}});
    renderer::RenderRequest request;
    request.window = {0, size / 2, size, 1};
    request.rows = size;
    request.line = 0;
    request.row_times = request.frame_times = times;
    const auto lines = [&](renderer::ReprojectionSource* keep, renderer::ReprojectionSource* from,
                           std::uint64_t id) {
        std::vector<float> image(static_cast<std::size_t>(size) * size * r.band_count());
        const std::vector<QualityLevel> levels(static_cast<std::size_t>(size), QualityLevel::reprojected);
        request.levels =
            from != nullptr ? std::span<const QualityLevel>(levels) : std::span<const QualityLevel>();
        request.keep = keep;
        request.from = from;
        request.frame_id = id;
        REQUIRE(r.render(request, image));
        return image;
    };
    renderer::ReprojectionSource kept(r, size, size);
    REQUIRE(kept.begin_frame(renderer::KeptWindow{{0, 0, size, size}, size / 2}));
    const std::vector<float> before = lines(&kept, nullptr, 1);
    REQUIRE(kept.complete(r));
    // 0.55 px along the sweep, 0.3 px across.
    pose->off = axis_angle({1, 0, 0}, 0.55 * pixel_rad) * axis_angle({0, 1, 0}, 0.3 * pixel_rad);
    kept.begin_reprojection();
    request.from = &kept;
    std::vector<float> px(static_cast<std::size_t>(size));
    REQUIRE(r.kept_motion_px(request, px));
    const std::vector<float> moved = lines(nullptr, &kept, 1);
    const std::vector<float> truth = lines(nullptr, nullptr, 2);
    const std::vector<float> again = lines(nullptr, nullptr, 3);
    CAPTURE(error(before, truth), error(moved, truth), error(again, truth), limb_shift_px(moved, truth));
    CHECK(error(moved, truth) < error(again, truth) + 0.01);
    CHECK(error(moved, truth) < error(before, truth) / 2);
    CHECK(limb_shift_px(moved, truth) < 0.05);
    // Only the lines with the body count; those without have nothing that moves.
    CHECK_THAT(static_cast<double>(px[size / 2]), Catch::Matchers::WithinAbs(std::hypot(0.55, 0.3), 0.02));
    CHECK(px[0] == 0);
    CHECK(std::all_of(px.begin(), px.end(), [](float p) { return p < 1; }));
    // A camera that does not sweep does not say where in the lines a place beside them would be.
    pose->rad_per_s = 0;
    pose->off = {};
    REQUIRE(kept.begin_frame(renderer::KeptWindow{{0, 0, size, size}, size / 2}));
    static_cast<void>(lines(&kept, nullptr, 1));
    pose->off = axis_angle({1, 0, 0}, 0.55 * pixel_rad);
    kept.begin_reprojection();
    request.keep = nullptr;
    request.from = &kept;
    REQUIRE(r.kept_motion_px(request, px));
    CHECK(std::isinf(px[size / 2]));
}

TEST_CASE("stars and bodies smaller than pixels are where they are then") {
    scene::Scene s = asteroid(60);
    const Pose camera = s.camera.motion.samples[0].pose;
    const double pixel_rad = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const auto direction = [&](double x_px, double y_px) {
        return rotate(camera.orientation, normalized(Vec3{x_px * pixel_rad, y_px * pixel_rad, 1}));
    };
    for (const auto& [x, y] : {std::pair{-100.0, -90.0}, {95.0, 100.0}, {-110.0, 60.0}}) {
        scene::Star star;
        const Vec3 d = direction(x, y);
        star.right_ascension_rad = std::atan2(d.y, d.x);
        star.declination_rad = std::asin(d.z);
        star.magnitude_v = 2;
        s.stars.push_back(star);
    }
    scene::Body moon = s.bodies[0]; // 2 px across
    moon.name = "moon";
    moon.shape = renderer::EllipsoidParameters{{8, 8, 8}};
    moon.motion.samples = {{0, {camera.position_m + 1e5 * direction(100, -80), {}}},
                           {1, {camera.position_m + 1e5 * direction(103, -82), {}}}};
    s.bodies.push_back(moon);
    s.camera.motion.samples = {
        {0, camera}, {1, {camera.position_m, camera.orientation * axis_angle({0, 1, 0}, pixel_rad)}}};
    const renderer::Renderer r = renderer_of(s, 2, 16);
    Kept kept(r);
    static_cast<void>(frame(r, rows_at({}), &kept.light));
    const std::vector<RowTime> then = rows_at(Time{ns_per_s});
    const std::vector<float> truth = frame(r, then, nullptr);
    const std::vector<float> moved = frame(r, then, nullptr, &kept.light, QualityLevel::reprojected);
    // Corners of the image, without the asteroid.
    for (const auto& [x0, y0] : {std::pair{0, 0}, {192, 0}, {0, 150}, {192, 192}}) {
        bool same = true;
        double light = 0;
        for (std::int32_t y = y0; y < y0 + 60; ++y)
            for (std::int32_t x = x0; x < x0 + 60; ++x) {
                const auto at = static_cast<std::size_t>(y * size + x);
                same = same && moved[at] == truth[at];
                light += static_cast<double>(truth[at]);
            }
        CAPTURE(x0, y0);
        CHECK(light > 0);
        CHECK(same);
    }
}

TEST_CASE("what an earlier frame did not show is filled and counted") {
    scene::Scene s = asteroid(70);
    // A wide wall behind the body, of nearly even brightness: the body uncovers 3 px of it.
    Behind wall(s);
    wall.body.shape = renderer::EllipsoidParameters{{2e4, 2e4, 2e4}};
    wall.add(s, 5e4 * wall.ahead, 10 * wall.pixel_m * wall.right);
    const renderer::Renderer r = renderer_of(s, 2, 64);
    Kept kept(r);
    static_cast<void>(frame(r, rows_at({}), &kept.light));
    const std::vector<RowTime> then = rows_at(Time{ns_per_s});
    const std::vector<float> truth = frame(r, then, nullptr);
    const std::uint64_t before = r.work().pixels_filled;
    const std::vector<float> moved = frame(r, then, nullptr, &kept.light, QualityLevel::reprojected);
    const auto filled = static_cast<double>(r.work().pixels_filled - before);
    // Some 3 px along half of the limb and 7 columns at the border of the image, rounded up to nodes.
    CAPTURE(filled, error(moved, truth), rms(truth));
    CHECK(filled > 7 * size + 3 * 140);
    CHECK(filled < 10 * size + 16 * 140);
    CHECK(error(moved, truth) < 0.01);
}

} // namespace reprojection_test
