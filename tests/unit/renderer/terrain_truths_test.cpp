// SPDX-License-Identifier: Apache-2.0
// Terrains against closed forms: cone, waves, limb and the Sun's disc over a wall; the shipped Moon.
#include "core/camera/scene_truth.hpp"
#include "images/writers/fits.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "support.hpp"
#include "terrain/maps/height_stack.hpp"
#include "terrain_support.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <numbers>

namespace terrain_truths_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using terrain::SurfaceDomain;

namespace {

constexpr double pi = std::numbers::pi, degree = pi / 180;
constexpr double half_edge_m = 500;

/// Distance at which z - height(x, y) first turns negative along a ray, in long double: many steps, then
/// bisection.
template<typename Height>
long double root(Vec3 o, Vec3 d, long double to, const Height& height) {
    const auto above = [&](long double t) { return o.z + t * d.z - height(o.x + t * d.x, o.y + t * d.y); };
    constexpr int steps = 4000;
    for (int k = 1; k <= steps; ++k) {
        if (above(to * k / steps) > 0) continue;
        long double low = to * (k - 1) / steps, high = to * k / steps;
        for (int i = 0; i < 70; ++i) {
            const long double middle = (low + high) / 2;
            (above(middle) > 0 ? low : high) = middle;
        }
        return high;
    }
    return std::numeric_limits<long double>::infinity();
}

} // namespace

TEST_CASE("A cone is met where its equation has its root") {
    // Apex over a vertex; heights between vertices are those of the grid, so cells beside the apex are left
    // out.
    constexpr double top_m = 150, slope = 0.6;
    const auto height = [](auto x, auto y) { return top_m - slope * std::sqrt(x * x + y * y); };
    constexpr int level = 3;
    const TerrainShape shape(SurfaceDomain::plane(half_edge_m),
                             layers_of([&](Vec3 p) { return height(p.x, p.y); }, -300, top_m),
                             at_level(level));
    const double cell_m = 2 * half_edge_m / (256 << level);
    Directions any;
    int met = 0;
    double worst = 0;
    for (int k = 0; k < 2000; ++k) {
        const Vec3 origin{300 * any.number(), 300 * (any.number() - 0.5), 200 + 300 * any.number()};
        const double turn = 2 * pi * any.number(), reach = 20 + 250 * any.number();
        const double x = reach * std::cos(turn), y = reach * std::sin(turn);
        const Vec3 direction = normalized(Vec3{x, y, height(x, y)} - origin);
        // |q|^2 of the plane's coordinates against (top - z)^2 / slope^2: the lesser root in front.
        using Real = long double;
        const Real a = Real{direction.x} * direction.x + Real{direction.y} * direction.y -
                       Real{direction.z} * direction.z / (slope * slope);
        const Real rise = (Real{top_m} - origin.z) / (slope * slope);
        const Real b = Real{origin.x} * direction.x + Real{origin.y} * direction.y + rise * direction.z;
        const Real c = Real{origin.x} * origin.x + Real{origin.y} * origin.y -
                       (Real{top_m} - origin.z) * (Real{top_m} - origin.z) / (slope * slope);
        const Real under = b * b - a * c;
        if (under < 0) continue;
        Real wanted = std::numeric_limits<Real>::infinity();
        for (const Real t : {(-b - std::sqrt(under)) / a, (-b + std::sqrt(under)) / a})
            if (t > 0 && origin.z + t * direction.z < top_m) wanted = std::min(wanted, t);
        const Vec3 at = origin + static_cast<double>(wanted) * direction;
        const double radius = std::hypot(at.x, at.y);
        if (!(radius > 15) || std::max(std::abs(at.x), std::abs(at.y)) > 490) continue;
        ++met;
        const double got = distance_to(shape, origin, direction);
        // Chords lie below the surface between vertices across the slope by at most slope cell^2 / (4 r)
        // (both diagonals); along the ray by the inverse of the angle to the ground.
        const double deep =
            slope * cell_m * cell_m / (4 * radius) + height_step_m(shape.tiles()->domain(), level);
        const Vec3 normal = normalized(Vec3{slope * at.x / radius, slope * at.y / radius, 1});
        const double grazing = std::abs(dot(normal, direction));
        if (grazing < 0.05) continue;
        worst = std::max(worst, std::abs(got - static_cast<double>(wanted)) * grazing / (deep + 1e-3));
    }
    CHECK(met > 500);
    CHECK(worst < 1);
}

TEST_CASE("Halving the cells divides the error of waves of eight cells by four") {
    // Waves of 8 cells of level 0, seen at levels 0 to 3: a bilinear surface is of second order in hits, and
    // its smooth normals too.
    constexpr double length_m = 8 * 2 * half_edge_m / 256, amplitude_m = 2;
    constexpr double k_per_m = 2 * pi / length_m;
    const auto height = [](auto x, auto y) {
        return amplitude_m * std::sin(k_per_m * x + decltype(x)(0.4)) * std::cos(k_per_m * y);
    };
    struct Errors {
        double hit = 0, normal = 0;
    };
    std::array<Errors, 4> errors{};
    for (int level = 0; level < 4; ++level) {
        const TerrainShape shape(SurfaceDomain::plane(half_edge_m),
                                 layers_of([&](Vec3 p) { return height(p.x, p.y); }, -3, 3), at_level(level));
        Directions any;
        int met = 0;
        for (int ray = 0; ray < 600; ++ray) {
            const Vec3 origin{600 * (any.number() - 0.5), 600 * (any.number() - 0.5), 60 + 40 * any.number()};
            const Vec3 direction = normalized(Vec3{any.number() - 0.5, any.number() - 0.5, -0.8});
            const long double wanted = root(origin, direction, 300, height);
            OneRay one(origin, direction);
            const double got = one.meet(shape);
            REQUIRE(got < no_hit);
            const double miss = got - static_cast<double>(wanted);
            errors[static_cast<std::size_t>(level)].hit += miss * miss;
            const Vec3 at = origin + static_cast<double>(wanted) * direction;
            const double phase = k_per_m * at.x + 0.4;
            const Vec3 normal =
                normalized(Vec3{-amplitude_m * k_per_m * std::cos(phase) * std::cos(k_per_m * at.y),
                                amplitude_m * k_per_m * std::sin(phase) * std::sin(k_per_m * at.y), 1});
            const double turned = length(one.surface(shape).normal.lane(OneRay::lane) - normal);
            errors[static_cast<std::size_t>(level)].normal += turned * turned;
            ++met;
        }
        CHECK(met == 600);
    }
    for (std::size_t level = 0; level + 1 < errors.size(); ++level) {
        const double hit = std::sqrt(errors[level].hit / errors[level + 1].hit);
        const double normal = std::sqrt(errors[level].normal / errors[level + 1].normal);
        INFO("levels " << level << " and " << level + 1);
        CHECK(hit > 3.5);
        CHECK(hit < 4.5);
        CHECK(normal > 3.5);
        CHECK(normal < 4.5);
    }
    CHECK(std::sqrt(errors[3].hit / 600) < 0.005 * amplitude_m);
}

TEST_CASE("The limb is the highest of the map's great circle") {
    const TempFolder folder;
    constexpr double radius_m = 1737400;
    constexpr std::int32_t rows = 90;
    std::vector<float> samples;
    for (std::int32_t j = 0; j < rows; ++j)
        for (std::int32_t i = 0; i < 2 * rows; ++i) {
            const double b = (90 - (j + 0.5) * 2) * degree, l = (-180 + (i + 0.5) * 2) * degree;
            samples.push_back(static_cast<float>(
                std::cos(b) * (4000 * std::sin(9 * l + 3 * b) + 2500 * std::cos(14 * b - 5 * l))));
        }
    const auto file = (folder.path() / "heights.fits").string();
    images::write_fits_float(file, 2 * rows, rows, 1, samples, "", {});
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {radius_m, radius_m, radius_m};
    planet.relief.heights = {whole_body_map(file)};
    s.bodies.push_back({"moon", planet, renderer::LambertParameters{0.3}, {}});
    s.sun.position_m = astronomical_unit_m * Vec3{1, 0, 0};
    constexpr std::int32_t edge = 512;
    const Vec3 eye = 9e6 * normalized(Vec3{1, 0.3, 0.2});
    s.camera = camera_at(eye, edge, 0.42 / edge);
    const renderer::Renderer r(s, {1, 2, 1});
    FrameWindow window;
    window.sensor = {0, 0, edge, edge};
    const std::vector<RowTime> times(edge);
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = times;
    SceneTruth truth;
    r.list_truth(request, truth);
    // The map's own heights, without tiles, over the half plane of each limb point.
    terrain::MapFindings notes;
    const auto domain = SurfaceDomain::ellipsoid(planet.radii_m);
    const auto layers = renderer::open_heights(planet.relief.heights, domain, notes);
    const Vec3 axis = -normalized(eye);
    int points = 0;
    double worst_px = 0, spread = 0;
    for (const TruthEntry& e : truth.entries) {
        if (e.kind != TruthKind::limb) continue;
        ++points;
        const Vec3 seen = rotate(s.camera.motion.samples[0].pose.orientation,
                                 normalized(Vec3{(e.x_px - (edge - 1) / 2.0) * 0.42 / edge,
                                                 (e.y_px - (edge - 1) / 2.0) * 0.42 / edge, 1}));
        const double got = std::atan2(length(cross(axis, seen)), dot(axis, seen));
        const Vec3 side = normalized(seen - dot(seen, axis) * axis);
        // Around the tangent point of the sphere.
        const double tangent = std::acos(radius_m / length(eye));
        std::vector<Vec3> places;
        for (int k = -3000; k <= 3000; ++k) {
            const double a = tangent + k * 1e-4;
            places.push_back(radius_m * (-std::cos(a) * axis + std::sin(a) * side));
        }
        const std::vector<double> heights = terrain::heights_at(layers, places, 0);
        double wanted = 0;
        for (std::size_t k = 0; k < places.size(); ++k) {
            const Vec3 to = places[k] * (1 + heights[k] / radius_m) - eye;
            wanted = std::max(wanted, std::atan2(length(cross(axis, to)), dot(axis, to)));
        }
        worst_px = std::max(worst_px, std::abs(got - wanted) / (0.42 / edge));
        spread = std::max(spread, std::abs(wanted - std::asin(radius_m / length(eye))) / (0.42 / edge));
    }
    INFO("limb " << worst_px << " px off, relief of " << spread << " px");
    CHECK(points > 60);
    CHECK(worst_px < 0.05);
    CHECK(spread > 0.5);
}

TEST_CASE("The shadow of a cone ends at its height over the tangent of the Sun's elevation") {
    constexpr double high_m = 30;
    constexpr int level = 4;
    const TerrainShape shape(
        SurfaceDomain::plane(half_edge_m),
        layers_of([](Vec3 p) { return std::max(0.0, high_m - std::hypot(p.x, p.y)); }, 0, high_m),
        at_level(level));
    const double cell_m = 2 * half_edge_m / (256 << level);
    for (const double elevation_deg : {5.0, 12.0, 25.0, 40.0})
        for (const double turn : {0.0, 0.3, 0.785, 2.4}) {
            const double elevation = elevation_deg * degree;
            const Vec3 sun{std::cos(elevation) * std::cos(turn), std::cos(elevation) * std::sin(turn),
                           std::sin(elevation)};
            const auto dark = [&](double away) {
                return distance_along(shape, {-away * std::cos(turn), -away * std::sin(turn), 1e-6}, sun) <
                       no_hit;
            };
            double in = high_m + cell_m, out = 400;
            REQUIRE(dark(in));
            REQUIRE_FALSE(dark(out));
            while (out - in > 1e-4)
                (dark(0.5 * (in + out)) ? in : out) = 0.5 * (in + out);
            INFO(elevation_deg << " deg, towards " << turn);
            CHECK_THAT(in, WithinAbs(high_m / std::tan(elevation), 0.2 * cell_m));
        }
}

TEST_CASE("A wall hides the part of the Sun's disc that its height and distance say") {
    // A wall of 20 m along y, east of x = 0, on a plain; its face is as steep as one cell.
    constexpr double high_m = 20;
    constexpr int level = 4;
    const TerrainShape shape(SurfaceDomain::plane(half_edge_m),
                             layers_of([](Vec3 p) { return p.x > 0 && p.x < 100 ? high_m : 0.0; }, 0, high_m),
                             at_level(level));
    const double cell_m = 2 * half_edge_m / (256 << level);
    constexpr double sun_rad = 0.2666 * degree;
    for (const double elevation_deg : {5.0, 20.0}) {
        const double elevation = elevation_deg * degree;
        const double middle = high_m / std::tan(elevation);
        for (const double part : {-0.9, -0.5, 0.0, 0.4, 0.8}) {
            // So far that the top of the wall, its first whole vertex east of 0, is this part of a radius
            // above the centre of the disc.
            const double distance = high_m / std::tan(elevation + part * sun_rad);
            const Vec3 ground{cell_m - distance, 3.3, 1e-6};
            int dark = 0;
            constexpr int rays = 40000;
            for (int k = 0; k < rays; ++k) {
                // Uniform over the disc: Vogel's spiral of the golden angle.
                const double rho = sun_rad * std::sqrt((k + 0.5) / rays),
                             turn = pi * (3 - std::sqrt(5.0)) * k;
                const double up = elevation + rho * std::sin(turn), across = rho * std::cos(turn);
                const Vec3 direction = normalized(
                    Vec3{std::cos(up) * std::cos(across), std::cos(up) * std::sin(across), std::sin(up)});
                dark += distance_along(shape, ground, direction) < no_hit ? 1 : 0;
            }
            // Area of a disc below a chord.
            const double wanted = 0.5 + (part * std::sqrt(1 - part * part) + std::asin(part)) / pi;
            INFO(elevation_deg << " deg, " << part << ", shadow of " << middle << " m");
            CHECK_THAT(static_cast<double>(dark) / rays, WithinAbs(wanted, 0.005));
        }
    }
}

TEST_CASE("The shipped Moon fills its disc, is dark at night and has craters") {
    scene::Scene s = scene::load_scene(OBSCURA_SOURCE_DIR "/config/scenes/moon.toml");
    const double shrink = s.camera.width / 96.0;
    s.camera.width = s.camera.height = 96;
    s.camera.pixel_pitch_m *= shrink;
    s.camera.pixel_pitch_y_m *= shrink;
    const renderer::Renderer r(s, {4, 2, 1});
    const Image picture = render(r);
    std::vector<float> planes(renderer::aov_count * 96 * 96);
    const std::vector<RowTime> times(96);
    renderer::RenderRequest request;
    request.window = {0, 0, 96, 96};
    request.rows = 96;
    request.row_times = times;
    r.render_aovs(request, planes);
    const auto aov = [&](renderer::Aov which, std::size_t pixel) {
        return static_cast<double>(planes[static_cast<std::size_t>(which) * 96 * 96 + pixel]);
    };
    double disc = 0, day = 0, night = 0;
    for (std::size_t k = 0; k < planes.size() / renderer::aov_count; ++k) {
        if (aov(renderer::Aov::body, k) == 0) continue;
        ++disc;
        const Vec3 up = at_latitude(aov(renderer::Aov::latitude_deg, k) * degree,
                                    aov(renderer::Aov::longitude_deg, k) * degree);
        const double cosine = dot(up, normalized(s.sun.position_m));
        (cosine < -0.12 ? night : day) += static_cast<double>(picture.values[k]);
    }
    const double radius_px =
        std::tan(std::asin(1737400 / 29500000.0)) * s.camera.focal_length_m / s.camera.pixel_pitch_m;
    CHECK_THAT(disc, WithinAbs(pi * radius_px * radius_px, 0.02 * disc));
    CHECK(day > 0);
    CHECK(night < 1e-3 * day);
    // 80 km above the terminator, as the file says: craters wherever one looks.
    const Vec3 eye{-1573900, 908700, 0};
    s.camera.focal_length_m = 6e-3;
    s.camera.motion.samples[0].pose = {eye, look_along({0.433, -0.25, 0.8}, {-0.866, 0.5, 0})};
    const renderer::Renderer low(s, {1, 2, 1});
    FrameWindow window;
    window.sensor = {0, 0, 96, 96};
    renderer::TruthRequest asked;
    asked.windows = {&window, 1};
    asked.rows = times;
    SceneTruth truth;
    low.list_truth(asked, truth);
    int craters = 0;
    for (const TruthEntry& e : truth.entries) {
        if (e.kind != TruthKind::crater) continue;
        ++craters;
        CHECK(e.diameter_m > 8 * 0.9 * e.range_m * s.camera.pixel_pitch_m / s.camera.focal_length_m);
        CHECK(std::abs(length(e.point_m) - 1737400) < 12000);
    }
    CHECK(craters > 10);
}

} // namespace terrain_truths_test
