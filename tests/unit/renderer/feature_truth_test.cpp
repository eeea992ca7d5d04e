// SPDX-License-Identifier: Apache-2.0
// Craters and boulders in the truth table: against depth maps, and against all features of a body.
#include "core/camera/scene_truth.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "support.hpp"
#include "terrain/feature_search.hpp"
#include "terrain_support.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

namespace feature_truth_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr std::int32_t edge = 200;
constexpr double radius_m = 300, altitude_m = 40;

renderer::DetailParameters old_ground() {
    renderer::DetailParameters detail;
    detail.seed = 4;
    detail.crater_age_ga = 3.8;
    detail.crater_least_m = 0.7;
    detail.crater_largest_m = 80;
    detail.boulders_per_m2 = 0.06;
    detail.boulder_least_m = 0.8;
    detail.boulder_largest_m = 3;
    detail.boulder_ejecta = 3;
    detail.boulder_rock_px = 0;
    return detail;
}

/// A body of 300 m full of craters, from `eye_m`, the Sun 9 degrees above the horizon below the camera.
scene::Scene small_moon(Vec3 eye_m, Vec3 aim_m, double pixel_rad, const renderer::DetailParameters& detail) {
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {radius_m, radius_m, radius_m};
    planet.relief.detail = detail;
    s.bodies.push_back({"rock", planet, renderer::LambertParameters{0.3}, {}});
    s.sun.position_m = astronomical_unit_m * at_latitude(0, 86 * degree);
    s.camera = camera_at(eye_m, edge, pixel_rad);
    s.camera.motion.samples[0].pose = {eye_m, look_along(normalized(aim_m - eye_m), {0, 0, 1})};
    return s;
}

SceneTruth truth_of(const renderer::Renderer& r, Time t = {}) {
    FrameWindow window;
    window.sensor = {0, 0, r.scene().camera.width, r.scene().camera.height};
    const std::vector<RowTime> rows(static_cast<std::size_t>(window.sensor.height), RowTime{t, t});
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    SceneTruth truth;
    r.list_truth(request, truth);
    return truth;
}

std::vector<TruthEntry> features_of(const SceneTruth& truth) {
    std::vector<TruthEntry> found;
    for (const TruthEntry& e : truth.entries)
        if (e.kind == TruthKind::crater || e.kind == TruthKind::boulder) found.push_back(e);
    return found;
}

/// Name made of kind and identity.
std::string name_of(const TruthEntry& e) {
    return (e.kind == TruthKind::crater ? "c" : "b") + std::string(e.name.view());
}

Image aov_of(const renderer::Renderer& r, renderer::Aov aov) {
    std::vector<float> planes(renderer::aov_count * edge * edge);
    const std::vector<RowTime> rows(edge);
    renderer::RenderRequest request;
    request.window = {0, 0, edge, edge};
    request.rows = edge;
    request.row_times = rows;
    r.render_aovs(request, planes);
    const auto first = planes.begin() + static_cast<std::ptrdiff_t>(aov) * edge * edge;
    return {edge, edge, {first, first + edge * edge}};
}

/// Pixel of a point by the pinhole's own equations, px.
std::optional<std::array<double, 2>> pixel_of(const scene::Camera& camera, Vec3 point_m) {
    const Pose& pose = camera.motion.samples[0].pose;
    const Vec3 d = rotate(conjugate(pose.orientation), point_m - pose.position_m);
    if (!(d.z > 0)) return std::nullopt;
    const double focal_px = camera.focal_length_m / camera.pixel_pitch_m;
    return std::array{focal_px * d.x / d.z + (edge - 1) / 2.0, focal_px * d.y / d.z + (edge - 1) / 2.0};
}

} // namespace

TEST_CASE("Listed craters and boulders are all of the body's that are in the picture") {
    const renderer::DetailParameters base = old_ground();
    renderer::DetailParameters all = base;
    all.truth_most = 4096;
    const Vec3 eye = (radius_m + altitude_m) * at_latitude(10 * degree, 5 * degree);
    // Straight down, and obliquely over the horizon.
    const Vec3 aim = GENERATE(Vec3{0, 0, 0}, 290 * at_latitude(35 * degree, 20 * degree));
    constexpr double pixel_rad = 0.9 / edge;
    const scene::Scene s = small_moon(eye, aim, pixel_rad, all);
    const renderer::Renderer r(s, {1, 2, 1});
    const std::vector<TruthEntry> listed = features_of(truth_of(r));
    REQUIRE(listed.size() > 60);

    // Every feature of the seed, with rays of its own from a shape of the same layers.
    const auto domain = terrain::SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m});
    const renderer::DetailLayers layers = renderer::make_detail(all, domain, false);
    const renderer::TerrainShape shape(domain, layers.layers);
    const renderer::SurfaceTiles::Pin pin = shape.tiles()->pin();
    const renderer::DetailView view{.eye_m = eye, .cell_rad = 0.5 * pixel_rad};
    struct Known {
        double size_px, x_px, y_px, diameter_m;
        bool sure, seen;
        Vec3 point_m;
    };
    std::map<std::string, Known> known;
    const auto add = [&](char kind, std::uint64_t id, Vec3 position, double diameter,
                         const auto& share_left) {
        const Vec3 up = normalized(position);
        constexpr double max_relief_m = 30;
        if (diameter < 7 * pixel_rad * (length(position - eye) - max_relief_m)) return;
        const Vec3 point = (400 - distance_along(shape, 400 * up, -up, &view)) * up;
        REQUIRE(std::abs(length(point) - radius_m) < max_relief_m);
        const double range = length(point - eye);
        const double size = diameter / (range * pixel_rad);
        const auto at = pixel_of(s.camera, point);
        if (!at || size < 8 * 0.999) return;
        const auto& [x, y] = *at;
        const double inside = std::min({x, y, edge - 1 - x, edge - 1 - y}) + 0.5;
        if (inside < -0.01) return;
        const double left = share_left();
        if (left < 0.1) return;
        const bool seen =
            distance_along(shape, eye, (point - eye) / range, &view) > range * (1 - 0.5 * pixel_rad);
        known[fmt::format("{}{:016x}", kind, id)] = {
            size, x,    y, diameter, inside > 0.01 && size > 8 * 1.001 && std::abs(left - 0.1) > 1e-3,
            seen, point};
    };
    const terrain::Cap whole{{0, 0, 0}, 3 * radius_m};
    const std::vector<terrain::Crater> craters = layers.craters->near(whole, base.crater_least_m);
    for (const terrain::Crater& c : craters)
        add('c', c.id, c.position_m, c.diameter_m, [&] {
            return layers.craters->share_left(
                {terrain::FeatureKind::crater, c.id, c.position_m, c.diameter_m},
                std::numeric_limits<double>::infinity());
        });
    for (const terrain::Boulder& b :
         layers.boulders->near({radius_m * normalized(eye), 150}, base.boulder_least_m))
        add('b', b.id, b.position_m, b.diameter_m, [] { return 1.0; });

    std::set<std::string> names;
    int visible = 0, boulders = 0;
    for (const TruthEntry& e : listed) {
        const std::string name = name_of(e);
        INFO(name << " " << e.diameter_m << " m at " << e.x_px << ", " << e.y_px);
        CHECK(names.insert(name).second);
        const auto found = known.find(name);
        REQUIRE(found != known.end());
        const Known& k = found->second;
        CHECK_THAT(e.x_px, WithinAbs(k.x_px, 1e-3));
        CHECK_THAT(e.y_px, WithinAbs(k.y_px, 1e-3));
        CHECK_THAT(e.diameter_m, WithinAbs(k.diameter_m, 1e-9));
        CHECK(length(e.point_m - k.point_m) < 1e-5);
        CHECK_THAT(e.latitude_deg, WithinAbs(std::asin(normalized(e.point_m).z) / degree, 1e-9));
        CHECK_THAT(std::remainder(e.longitude_deg - std::atan2(k.point_m.y, k.point_m.x) / degree, 360),
                   WithinAbs(0, 1e-9));
        CHECK((e.visibility == TruthVisibility::visible) == k.seen);
        visible += k.seen ? 1 : 0;
        boulders += e.kind == TruthKind::boulder ? 1 : 0;
    }
    int missing = 0, wanted = 0;
    for (const auto& [name, k] : known) {
        if (!k.sure || !k.seen) continue;
        ++wanted;
        missing += names.contains(name) ? 0 : 1;
    }
    CHECK(missing == 0);
    CHECK(wanted > 40);
    CHECK(visible > 40);
    CHECK(boulders > 2);
    CHECK(std::is_sorted(listed.begin(), listed.end(), [](const TruthEntry& a, const TruthEntry& b) {
        return a.diameter_m / a.range_m > b.diameter_m / b.range_m;
    }));

    // With room for few, the largest of them.
    renderer::DetailParameters few = all;
    few.truth_most = 40;
    const std::vector<TruthEntry> largest =
        features_of(truth_of(renderer::Renderer(small_moon(eye, aim, pixel_rad, few), {1, 2, 1})));
    CHECK(largest.size() <= 40);
    CHECK(largest.size() > 15);
    for (std::size_t i = 0; i < largest.size(); ++i)
        CHECK(largest[i].name.view() == listed[i].name.view());
    few.truth_most = 0;
    CHECK(features_of(truth_of(renderer::Renderer(small_moon(eye, aim, pixel_rad, few), {1, 2, 1}))).empty());
}

TEST_CASE("A crater goes when larger ones come later") {
    // By the list of all craters, with their ages: what later ones of a larger octave cover is not left.
    const renderer::DetailParameters detail = old_ground();
    const auto domain = terrain::SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m});
    const renderer::DetailLayers layers = renderer::make_detail(detail, domain, false);
    const std::vector<terrain::Crater> craters = layers.craters->near({{0, 0, 0}, 3 * radius_m}, 4);
    int gone = 0, kept = 0;
    for (const terrain::Crater& c : craters) {
        bool covered = false, touched = false;
        for (const terrain::Crater& other : craters) {
            if (std::ilogb(other.diameter_m) <= std::ilogb(c.diameter_m) || other.age_ga >= c.age_ga)
                continue;
            const double radii = 2 * length(other.position_m - c.position_m) / other.diameter_m;
            covered = covered || radii < 0.94;
            touched = touched || radii < 1.31;
        }
        const double left =
            layers.craters->share_left({terrain::FeatureKind::crater, c.id, c.position_m, c.diameter_m},
                                       std::numeric_limits<double>::infinity());
        if (covered) CHECK(left < 1e-12);
        if (!touched) CHECK(left > 0.01);
        CHECK(left <= 1 + 1e-12);
        gone += covered ? 1 : 0;
        kept += touched ? 0 : 1;
        // Real ones are in samples as fine as that.
        CHECK(layers.craters->share_left({terrain::FeatureKind::crater, c.id, c.position_m, c.diameter_m},
                                         c.diameter_m / 20) == 0);
    }
    CHECK(gone > 20);
    CHECK(kept > 100);
}

TEST_CASE("Boulders of a flat plain are the bumps of its depth map") {
    renderer::DetailParameters detail;
    detail.boulders_per_m2 = 0.08;
    detail.boulder_least_m = 1.5;
    detail.boulder_rock_px = 0; // domes have no overhangs
    detail.truth_least_px = 8;
    detail.truth_most = 1000;
    scene::Scene s;
    renderer::TerrainParameters plain;
    plain.half_edge_m = 100;
    plain.relief.detail = detail;
    s.bodies.push_back({"plain", plain, renderer::LambertParameters{0.3}, {}});
    s.sun.position_m = astronomical_unit_m * normalized(Vec3{1, 0.2, 0.4});
    constexpr double pixel_rad = 1.0 / edge;
    s.camera = camera_at({7, -5, altitude_m}, edge, pixel_rad);
    s.camera.motion.samples[0].pose = {{7, -5, altitude_m}, look_along({0, 0, -1}, {0, 1, 0})};
    const renderer::Renderer r(s, {4, 2, 1});
    const Image depth = aov_of(r, renderer::Aov::depth_m);
    const std::vector<TruthEntry> listed = features_of(truth_of(r));
    REQUIRE(listed.size() > 10);
    const auto height = [&](std::int32_t x, std::int32_t y) {
        return altitude_m - static_cast<double>(depth.at(x, y));
    };
    // Each stands at a peak of the map, which has its height there: domes that touch may hide it.
    int peaks = 0;
    for (const TruthEntry& e : listed) {
        CHECK(e.kind == TruthKind::boulder);
        CHECK(std::isnan(e.latitude_deg));
        const auto x = static_cast<std::int32_t>(std::lround(e.x_px)),
                   y = static_cast<std::int32_t>(std::lround(e.y_px));
        if (std::min({x, y, edge - 1 - x, edge - 1 - y}) < 8 || e.visibility != TruthVisibility::visible)
            continue;
        CHECK_THAT(height(x, y), WithinAbs(e.point_m.z, 0.08 * e.diameter_m));
        std::array<std::int32_t, 2> top{x, y};
        for (std::int32_t j = -3; j <= 3; ++j)
            for (std::int32_t i = -3; i <= 3; ++i)
                if (height(x + i, y + j) > height(top[0], top[1])) top = {x + i, y + j};
        // A pixel sees the near side of the dome a little higher: half its slope there.
        peaks += std::hypot(top[0] - e.x_px, top[1] - e.y_px) < 1.8 ? 1 : 0;
    }
    CHECK(peaks > 0.8 * static_cast<double>(listed.size()) - 3);
    // What is raised has a listed boulder, if it is wider than two others.
    std::vector<int> group(static_cast<std::size_t>(edge) * edge, 0);
    int groups = 0, wide = 0, without = 0;
    for (std::int32_t y0 = 0; y0 < edge; ++y0)
        for (std::int32_t x0 = 0; x0 < edge; ++x0) {
            const auto number = [&](std::int32_t x, std::int32_t y) -> int& {
                return group[static_cast<std::size_t>(y) * edge + static_cast<std::size_t>(x)];
            };
            if (number(x0, y0) != 0 || height(x0, y0) < 0.02) continue;
            ++groups;
            std::vector<std::array<std::int32_t, 2>> open{{x0, y0}}, members;
            number(x0, y0) = groups;
            while (!open.empty()) {
                const auto [x, y] = open.back();
                open.pop_back();
                members.push_back({x, y});
                for (const auto& [i, j] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
                    const std::int32_t xi = x + i, yj = y + j;
                    if (xi < 0 || yj < 0 || xi >= edge || yj >= edge || number(xi, yj) != 0 ||
                        height(xi, yj) < 0.02)
                        continue;
                    number(xi, yj) = groups;
                    open.push_back({xi, yj});
                }
            }
            double longest = 0;
            bool border = false;
            for (const auto& a : members) {
                border = border || std::min({a[0], a[1], edge - 1 - a[0], edge - 1 - a[1]}) < 1;
                for (const auto& b : members)
                    longest = std::max(longest, std::hypot(a[0] - b[0], a[1] - b[1]));
            }
            if (border || longest < 18) continue; // more than two small ones that touch
            ++wide;
            const int own = groups;
            without += std::none_of(listed.begin(), listed.end(),
                                    [&](const TruthEntry& e) {
                                        return number(static_cast<std::int32_t>(std::lround(e.x_px)),
                                                      static_cast<std::int32_t>(std::lround(e.y_px))) == own;
                                    })
                           ? 1
                           : 0;
        }
    CHECK(wide > 2);
    CHECK(without == 0);
}

TEST_CASE("Craters keep their names and places while the camera flies, and shadows are dark") {
    const renderer::DetailParameters detail = old_ground();
    constexpr double pixel_rad = 0.9 / edge;
    const auto at = [&](double longitude_deg) {
        const Vec3 eye = (radius_m + altitude_m) * at_latitude(10 * degree, longitude_deg * degree);
        return small_moon(eye, {0, 0, 0}, pixel_rad, detail);
    };
    const renderer::Renderer first(at(5), {4, 2, 1}), second(at(5.4), {4, 1, 2});
    const Image picture = render(first);
    const Image away = render(second); // tiles in another order
    std::map<std::string, TruthEntry> places;
    for (const TruthEntry& e : features_of(truth_of(first)))
        places.emplace(name_of(e), e);
    int again = 0, differ = 0;
    for (const TruthEntry& e : features_of(truth_of(second))) {
        const auto before = places.find(name_of(e));
        if (before == places.end()) continue;
        ++again;
        CHECK(e.diameter_m == before->second.diameter_m);
        // Levels of detail differ by less than a pixel's half.
        differ += length(e.point_m - before->second.point_m) > 0.5 * pixel_rad * e.range_m ? 1 : 0;
    }
    CHECK(again > 25);
    CHECK(differ == 0);
    double lit = 0, dark = 0, lit_count = 0, dark_count = 0;
    for (const auto& [name, e] : places) {
        if (e.visibility != TruthVisibility::visible) continue;
        const auto value = static_cast<double>(picture.at(static_cast<std::int32_t>(std::lround(e.x_px)),
                                                          static_cast<std::int32_t>(std::lround(e.y_px))));
        (e.lit ? lit : dark) += value;
        (e.lit ? lit_count : dark_count) += 1;
    }
    CHECK(lit_count > 10);
    CHECK(dark_count > 3);
    CHECK(dark / dark_count < 0.25 * lit / lit_count);
}

TEST_CASE("A landmark of a terrain lies on the ground that the picture shows") {
    const renderer::DetailParameters detail = old_ground();
    const Vec3 up = at_latitude(10 * degree, 5 * degree);
    scene::Scene s = small_moon((radius_m + altitude_m) * up, {0, 0, 0}, 0.9 / edge, detail);
    scene::Landmark mark;
    mark.name = "summit";
    mark.body = "rock";
    mark.latitude_rad = 10.4 * degree;
    mark.longitude_rad = 5.4 * degree;
    s.landmarks.push_back(mark);
    const renderer::Renderer r(s, {1, 2, 1});
    const SceneTruth truth = truth_of(r);
    const auto entry = std::find_if(truth.entries.begin(), truth.entries.end(),
                                    [](const TruthEntry& e) { return e.kind == TruthKind::landmark; });
    REQUIRE(entry != truth.entries.end());
    CHECK(entry->visibility == TruthVisibility::visible);
    CHECK_THAT(entry->latitude_deg, WithinAbs(10.4, 1e-9));
    CHECK_THAT(entry->longitude_deg, WithinAbs(5.4, 1e-9));
    const Image range = aov_of(r, renderer::Aov::range_m);
    const double seen = static_cast<double>(range.at(static_cast<std::int32_t>(std::lround(entry->x_px)),
                                                     static_cast<std::int32_t>(std::lround(entry->y_px))));
    CHECK_THAT(entry->range_m, WithinAbs(seen, 0.3));
}

TEST_CASE("Limb and terminator of a terrain are where rays of its levels begin to meet it") {
    const renderer::DetailParameters detail = old_ground();
    constexpr double pixel_rad = 0.9 / edge;
    const Vec3 eye = 1500 * at_latitude(0.2, 40 * degree);
    scene::Scene s = small_moon(eye, {0, 0, 0}, pixel_rad, detail);
    const auto curves_of = [&](const scene::Scene& scene) {
        std::map<std::pair<bool, std::int32_t>, TruthEntry> found;
        for (const TruthEntry& e : truth_of(renderer::Renderer(scene, {1, 2, 1})).entries)
            if (e.kind == TruthKind::limb || e.kind == TruthKind::terminator)
                found.emplace(std::pair(e.kind == TruthKind::limb, e.item), e);
        return found;
    };
    const auto curves = curves_of(s);
    const auto domain = terrain::SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m});
    const renderer::TerrainShape shape(domain, renderer::make_detail(detail, domain, false).layers);
    const renderer::SurfaceTiles::Pin pin = shape.tiles()->pin();
    const renderer::DetailView view{.eye_m = eye, .cell_rad = 0.5 * pixel_rad};
    const Pose& pose = s.camera.motion.samples[0].pose;
    int limbs = 0, terminators = 0;
    for (const auto& [key, e] : curves) {
        const double focal_px = 1 / pixel_rad, middle = (edge - 1) / 2.0;
        const Vec3 towards = normalized(Vec3{(e.x_px - middle) / focal_px, (e.y_px - middle) / focal_px, 1});
        const Vec3 point = eye + e.range_m * rotate(pose.orientation, towards);
        const Vec3 from = key.first ? eye : s.sun.position_m;
        const auto meets = [&](double outwards_m) {
            const Vec3 aim =
                point + outwards_m * normalized(point - dot(point, normalized(from)) * normalized(from));
            return distance_along(shape, from, normalized(aim - from), &view) != no_hit;
        };
        // As precise as the direction to the Sun in doubles.
        const double step_m = key.first ? 1e-5 : 1e-3;
        CHECK(meets(-step_m));
        CHECK(!meets(step_m));
        (key.first ? limbs : terminators) += 1;
    }
    CHECK(limbs == 72);
    CHECK(terminators > 25);

    // Where the field ends changes none of those in it.
    s.camera.width = s.camera.height = edge / 4;
    s.camera.motion.samples[0].pose.orientation =
        look_along(normalized(300 * at_latitude(0.5, 130 * degree) - eye), {0, 0, 1});
    const auto part = curves_of(s);
    CHECK(part.size() > 5);
    CHECK(part.size() < curves.size() / 2);
    s.camera.width = s.camera.height = edge;
    const auto whole = curves_of(s);
    std::size_t within = 0;
    for (const auto& [key, e] : whole) {
        const double left = (edge - edge / 4) / 2.0;
        const bool inside = std::abs(e.x_px - (edge - 1) / 2.0) < edge / 8.0 &&
                            std::abs(e.y_px - (edge - 1) / 2.0) < edge / 8.0;
        const auto other = part.find(key);
        CHECK((other != part.end()) == inside);
        if (other == part.end()) continue;
        ++within;
        CHECK_THAT(other->second.x_px, WithinAbs(e.x_px - left, 1e-9));
        CHECK_THAT(other->second.y_px, WithinAbs(e.y_px - left, 1e-9));
        CHECK(other->second.range_m == e.range_m);
    }
    CHECK(within == part.size());
}

} // namespace feature_truth_test
