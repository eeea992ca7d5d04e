// SPDX-License-Identifier: Apache-2.0
// Deflection of light by the Sun in frames and truth tables, against ERFA and closed forms.
#include "core/camera/scene_truth.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/scene/sky_object.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "renderer/world/scene_poses.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <numbers>

namespace light_deflection_test {

using namespace obscura;

namespace {

constexpr double mas = std::numbers::pi / 180 / 3.6e6;
constexpr std::int32_t size = 64;
/// 10 mas.
constexpr double pixel_rad = 10 * mas;

scene::Star star_at(Vec3 direction) {
    scene::Star star;
    star.right_ascension_rad = std::atan2(direction.y, direction.x);
    star.declination_rad = std::atan2(direction.z, std::hypot(direction.x, direction.y));
    star.magnitude_v = 3;
    return star;
}

/// A camera at the origin that looks along `direction`.
scene::Scene looking(Vec3 direction, Vec3 sun_m) {
    scene::Scene s;
    s.sun.position_m = sun_m;
    s.light_deflection = true;
    s.camera = test::camera_at({1, 0, 0}, size, pixel_rad);
    s.camera.motion.samples[0].pose = {{}, look_along(direction, {0, 0, 1})};
    s.camera.psf_sigma_px = 0.7;
    return s;
}

SceneTruth truth_of(const renderer::Renderer& r) {
    const std::vector<RowTime> rows(size, RowTime{Time{-5}, Time{5}});
    FrameWindow window;
    window.sensor = {0, 0, size, size};
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    SceneTruth truth;
    r.list_truth(request, truth);
    return truth;
}

/// The entry of the truth table; its distance from the middle of the picture, and that of the light there.
struct Seen {
    TruthEntry entry;
    double truth_px = 0, light_px = 0;
};
Seen seen(const scene::Scene& s, TruthKind kind) {
    const renderer::Renderer r(s, {});
    Seen out;
    bool found = false;
    for (const TruthEntry& e : truth_of(r).entries)
        if (e.kind == kind && (kind != TruthKind::body || e.object == 0)) out.entry = e, found = true;
    REQUIRE(found);
    const double middle = (size - 1) / 2.0;
    out.truth_px = std::hypot(out.entry.x_px - middle, out.entry.y_px - middle);
    const test::Image image = test::render(r);
    double x = 0, y = 0;
    for (std::int32_t row = 0; row < size; ++row)
        for (std::int32_t column = 0; column < size; ++column) {
            const auto value = static_cast<double>(image.at(column, row));
            x += value * column, y += value * row;
        }
    out.light_px = std::hypot(x / image.sum() - out.entry.x_px, y / image.sum() - out.entry.y_px);
    return out;
}

} // namespace

TEST_CASE("Stars near the Sun are in frame and truth table where ERFA has them", "[renderer][truth]") {
    struct Case {
        Vec3 sun_m, star, velocity_m_s, apparent;
        double shift_mas;
    };
    // python3-erfa 2.0.0.1: ldsun(), then ab() without the Sun's potential; unit vectors.
    constexpr std::array cases{
        Case{{-77449520786.944687, -127904913476.6879, -23986450720.603634},
             {-0.50826583638809075, -0.84494833749687526, -0.16651770633173352},
             {-9395.0044491159515, -13341.266040852732, 12728.678102488049},
             {-0.50827193098685741, -0.84495374243784294, -0.16647167119715744},
             921.872},
        Case{{119834440407.54051, 19994759399.29377, -90406645046.447281},
             {0.81954295285450673, 0.14413789697224186, -0.55459319783327243},
             {-29446.292321472942, -1422.8352778894389, -19774.841548560726},
             {0.81948166133335254, 0.14413974801482063, -0.55468327880021107},
             153.611},
        Case{{-89138825771.295639, -69126154565.699539, -101041028670.79271},
             {-0.21690218429873287, -0.95168792779262223, -0.2173557695121604},
             {6963.843051470988, 14107.540220042507, -27931.397313896508},
             {-0.216885339230042, -0.95166902232693351, -0.2174553323567123},
             9.711},
        Case{{-11202894504.635504, -42796727135.245979, -7555948904.4699402},
             {0.074486431744859, 0.32881754052579371, -0.94145143078572391},
             {-5173.7417662943126, -17814.750587044186, -6735.2356180425759},
             {0.074469162832470126, 0.32875805929512991, -0.94147356958946582},
             11.389},
        Case{{-483884566061.03314, -600886309398.08228, 99667796242.781906},
             {-0.62891189952618531, -0.76931019894085584, 0.11239057095658322},
             {-33962.883771645262, 4626.1907800122954, -18729.182668877762},
             {-0.62899242316235282, -0.76925440528983824, 0.11232182132840009},
             89.730},
        Case{{2486090724.6122742, 3281373675.8218131, -149541214578.73257},
             {-0.080488497363831457, 0.037382339281053417, 0.9960542969647731},
             {-20084.595735255665, 12546.712263376628, -18682.536971618909},
             {-0.080559929583934348, 0.037426251447805779, 0.99604687311792572},
             0.178},
    };
    for (const Case& c : cases) {
        CAPTURE(c.shift_mas);
        scene::Scene s = looking(c.apparent, c.sun_m);
        s.aberration = true;
        s.camera.velocity_m_s = c.velocity_m_s;
        // As a star of the catalogue, and as a sky object that varies.
        for (const bool object : {false, true}) {
            s.stars.clear();
            s.sky_objects.reset();
            if (object) {
                scene::SkyObject variable;
                variable.star = star_at(c.star);
                variable.amplitude_mag = 0.1;
                s.sky_objects = std::make_shared<std::vector<scene::SkyObject>>(1, variable);
            } else {
                s.stars = {star_at(c.star)};
            }
            const Seen star = seen(s, TruthKind::star);
            // In the middle of the picture, within 0.1 mas; positions of the table are rounded to 1e-4 px.
            CHECK(star.truth_px < 0.01);
            CHECK(star.light_px < 2e-3);
        }
        // Without deflection it is away by that.
        s.sky_objects.reset();
        s.stars = {star_at(c.star)};
        s.light_deflection = false;
        s.camera.focal_length_m /= 10; // 100 mas a pixel
        CHECK(std::abs(seen(s, TruthKind::star).truth_px * 100 - c.shift_mas) < 0.2);
    }
}

TEST_CASE("Bodies and points in space are shifted away from the Sun by their distances",
          "[renderer][truth]") {
    // For the triangle of observer, Sun and source with the angle a at the Sun: 2 G M / (c^2 e) tan(a / 2), e
    // the observer's distance (Murray, MNRAS 195, 639, 1981).
    constexpr double gm = 1.32712440041e20, c2 = 299792458.0 * 299792458.0;
    const double au = 149597870700.0;
    const Vec3 sun_m{au, 0, 0};
    const double angle = 2 * std::numbers::pi / 180;
    const Vec3 direction{std::cos(angle), std::sin(angle), 0};
    for (const double distance_m : {0.4 * au, 2.5 * au, 30 * au}) {
        const Vec3 place_m = distance_m * direction;
        const double at_sun = std::acos(dot(normalized(place_m - sun_m), {-1, 0, 0}));
        const double shift = 2 * gm / (c2 * au) * std::tan(at_sun / 2);
        const Vec3 towards{std::cos(angle + shift), std::sin(angle + shift), 0};
        CAPTURE(distance_m / au, shift / mas);
        scene::Scene s = looking(towards, sun_m);
        scene::SkyObject point;
        point.kind = scene::SkyObject::Kind::point;
        point.star.magnitude_v = -20;
        point.motion.samples[0].pose.position_m = place_m;
        s.sky_objects = std::make_shared<std::vector<scene::SkyObject>>(1, point);
        const Seen as_point = seen(s, TruthKind::star);
        CHECK(as_point.truth_px < 0.01);
        CHECK(as_point.light_px < 2e-3);
        s.sky_objects.reset();
        // A dot and a disc, whose light is not about the centre: as without deflection, but for the shift.
        for (const double radius_px : {1.0, 12.0}) {
            const double radius_m = radius_px * pixel_rad * distance_m;
            s.bodies = {{"ball",
                         renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                         renderer::LambertParameters{0.5},
                         {}}};
            s.bodies[0].motion.samples[0].pose.position_m = place_m;
            const Seen bent = seen(s, TruthKind::body);
            CHECK(bent.truth_px < 0.01);
            scene::Scene straight = s;
            straight.light_deflection = false;
            straight.camera.motion.samples[0].pose.orientation = look_along(direction, {0, 0, 1});
            CHECK(std::abs(bent.light_px - seen(straight, TruthKind::body).light_px) < 0.02);
            // The table's poses are those of the bodies, not of their images.
            const renderer::Renderer r(s, {});
            CHECK(length(truth_of(r).poses[1].pose.position_m - place_m) == 0);
        }
        s.camera.motion.aim = scene::Aim{.body = "ball", .up = {0, 0, 1}};
        const renderer::ScenePoses poses(s);
        CHECK(length(rotate(poses.camera(0).orientation, {0, 0, 1}) - towards) < 0.1 * mas);
        REQUIRE(poses.body(0, 0).pixel);
        CHECK(std::abs(poses.body(0, 0).pixel->x - (size - 1) / 2.0) < 0.01);
        CHECK(length(poses.body(0, 0).pose.position_m - place_m) == 0);
    }
    // The Sun itself stays.
    scene::Scene s = looking({1, 0, 0}, sun_m);
    s.camera.focal_length_m /= 1e5;
    CHECK(std::abs(renderer::ScenePoses(s).sun(0).pixel->x - (size - 1) / 2.0) < 1e-9);
}

} // namespace light_deflection_test
