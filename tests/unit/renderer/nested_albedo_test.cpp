// SPDX-License-Identifier: Apache-2.0
// Nested albedo maps: where their texels are, footprints against means by brute force, blends, holes,
// statistics, giant textures, and a picture against materials of the same albedo.
#include "core/error.hpp"
#include "images/writers/fits.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/textures/nested_albedo.hpp"
#include "renderer/textures/paged_texture.hpp"
#include "renderer/world/albedo_maker.hpp"
#include "support.hpp"
#include "terrain_support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/terrain/obt_support.hpp"

#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

namespace nested_albedo_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using namespace obscura::terrain;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr float none = std::numeric_limits<float>::quiet_NaN();
const std::vector<SpectralBand> one_band{{500e-9, 600e-9, {}}};
const SurfaceDomain ball = SurfaceDomain::ellipsoid({1000, 1000, 1000});

std::vector<float> texels(int width, int height, const std::function<double(int, int)>& f) {
    std::vector<float> values;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            values.push_back(static_cast<float>(f(x, y)));
    return values;
}

std::string write(const TempFolder& folder, const char* name, int width, int height,
                  const std::vector<float>& values) {
    images::write_fits_float(folder.path() / name, width, height, 1, values, "", {});
    return (folder.path() / name).string();
}

/// The whole body from -180 to 180 degrees.
AlbedoTable whole(std::string file) {
    AlbedoTable table;
    table.file = std::move(file);
    table.map.projection = ProjectionKind::simple_cylindrical;
    return table;
}

AlbedoTable part(std::string file, double left_deg, double right_deg, double top_deg, double bottom_deg) {
    AlbedoTable table = whole(std::move(file));
    table.map.left_rad = left_deg * degree;
    table.map.right_rad = right_deg * degree;
    table.map.top_rad = top_deg * degree;
    table.map.bottom_rad = bottom_deg * degree;
    return table;
}

/// By a ray of no width.
double at(const NestedAlbedo& albedo, Vec3 p) {
    double factor = -1;
    albedo.factors(p, {}, {}, 1, &factor);
    return factor;
}

std::string refusal(const std::vector<AlbedoTable>& tables, const SurfaceDomain& domain = ball) {
    try {
        (void)open_albedo(tables, domain, one_band);
    } catch (const InputError& error) {
        CHECK(std::string(error.what()).find('\n') == std::string::npos);
        return error.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("The step of a place is the derivative of the projection") {
    Directions random;
    for (const ProjectionKind kind :
         {ProjectionKind::simple_cylindrical, ProjectionKind::north_polar_stereographic,
          ProjectionKind::south_polar_stereographic, ProjectionKind::planar})
        for (const bool graphic : {false, true}) {
            terrain::Projection projection = terrain::Projection::of_sphere(kind, 1000, 0.7);
            const bool polar = kind != ProjectionKind::simple_cylindrical && kind != ProjectionKind::planar;
            if (graphic) {
                projection.latitudes = Latitudes::planetographic;
                projection.polar_radius_m = 995;
            }
            // Turned by 30 degrees where it may be.
            const PixelTransform transform = kind == ProjectionKind::simple_cylindrical
                                                 ? PixelTransform{-3000, 2, 0, 1500, 0, -3}
                                                 : PixelTransform{-3000, 1.7, 1, 1500, 1, -1.7};
            const MapFrame frame(projection, transform, Registration::pixel, 100, 100);
            for (int k = 0; k < 300; ++k) {
                const Vec3 p = 1000 * random();
                if (std::abs(p.z) > 990 && !polar) continue;
                if (polar && (kind == ProjectionKind::north_polar_stereographic) != (p.z > 0)) continue;
                const Vec3 step = random();
                const double h = 1e-3;
                const SamplePlace before = frame.place(p - h * step), after = frame.place(p + h * step);
                const SamplePlace found = frame.step(p, step);
                const double scale = std::hypot(found.x, found.y) + 0.1;
                if (std::abs(after.x - before.x) > 100) continue; // across the seam
                // Conformal only in conformal latitudes: off by the flattening.
                const double allowed = (polar && graphic ? 0.012 : 1e-5) * scale;
                CHECK_THAT(found.x, WithinAbs((after.x - before.x) / (2 * h), allowed));
                CHECK_THAT(found.y, WithinAbs((after.y - before.y) / (2 * h), allowed));
            }
        }
}

TEST_CASE("Texels of albedo maps are where their projections say") {
    const TempFolder folder;
    const auto f = [](int x, int y) { return 0.1 + 0.001 * x + 0.02 * y; };
    const auto file = write(folder, "a.fits", 64, 32, texels(64, 32, f));
    const auto albedo = open_albedo({whole(file)}, ball, one_band);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 64; ++x) {
            const double longitude = (-180 + (x + 0.5) * 360 / 64) * degree;
            const double latitude = (90 - (y + 0.5) * 180 / 32) * degree;
            CHECK_THAT(at(*albedo, 1003 * at_latitude(latitude, longitude)), WithinAbs(f(x, y), 2e-5));
        }
    // Across the seam: the middle between the last column and the first.
    CHECK_THAT(at(*albedo, 1000 * at_latitude((90 - 10.5 * 180 / 32) * degree, pi)),
               WithinAbs((f(63, 10) + f(0, 10)) / 2, 2e-5));
    CHECK(albedo->notes().size() == 1); // on the range of the map
    CHECK(albedo->grey());
    // The mean over the sphere: rows count by their areas.
    double mean = 0;
    for (int y = 0; y < 32; ++y)
        mean += (0.1 + 0.001 * 31.5 + 0.02 * y) *
                (std::sin((90 - y * 180.0 / 32) * degree) - std::sin((90 - (y + 1) * 180.0 / 32) * degree)) /
                2;
    CHECK_THAT(albedo->mean(), WithinAbs(mean, 2e-3));

    // A polar map of 10 m pixels whose upper left corner is at -160, 120 m: x = rho sin, y = rho cos.
    AlbedoTable polar;
    polar.file = file;
    polar.scale = 2;
    polar.map.projection = ProjectionKind::south_polar_stereographic;
    polar.map.left_m = -320;
    polar.map.top_m = 160;
    polar.map.pixel_m = 10;
    polar.feather_m = 1e-6;
    const auto cap = open_albedo({polar}, ball, one_band);
    for (int y = 3; y < 29; y += 5)
        for (int x = 3; x < 61; x += 5) {
            const double px = -320 + 10 * (x + 0.5), py = 160 - 10 * (y + 0.5);
            const double colatitude = 2 * std::atan(std::hypot(px, py) / 2000);
            const Vec3 p = 1000 * at_latitude(colatitude - pi / 2, std::atan2(px, py));
            CHECK_THAT(at(*cap, p), WithinAbs(2 * f(x, y), 4e-5));
        }
    CHECK(at(*cap, {0, 0, 1000}) == 1); // beyond the map the material has its own albedo
    CHECK(at(*cap, {1000, 0, 0}) == 1);
}

TEST_CASE("Footprints of rays are means over the map") {
    const TempFolder folder;
    // Waves of 4 and 8 texels across and down.
    const auto wave = [](double x, double y) {
        return 0.5 + 0.2 * std::cos(pi * x / 2) + 0.2 * std::cos(pi * y / 4);
    };
    const auto file =
        write(folder, "w.fits", 512, 512, texels(512, 512, [&](int x, int y) { return wave(x, y); }));
    AlbedoTable table;
    table.file = file;
    table.map.projection = ProjectionKind::planar;
    table.map.left_m = -512;
    table.map.top_m = 512;
    table.map.pixel_m = 2;
    const auto albedo = open_albedo({table}, SurfaceDomain::plane(512), one_band);
    const auto seen = [&](Vec3 p, double a_m, double b_m) {
        double factor = 0;
        albedo->factors(p, {a_m, 0, 0}, {0, b_m, 0}, 1, &factor);
        return factor;
    };
    // Texel (100, 200) is at x = -512 + 201, y = 512 - 401.
    const Vec3 p{-311, 111, 0};
    CHECK_THAT(seen(p, 0.01, 0.01), WithinAbs(0.9, 1e-4));
    // 8 m across is one wave of x, 16 m down one of y: what is as wide as the footprint is gone.
    CHECK_THAT(seen(p, 8, 0.01), WithinAbs(0.7, 0.02));
    CHECK_THAT(seen(p, 0.01, 16), WithinAbs(0.7, 0.03));
    CHECK_THAT(seen(p, 64, 64), WithinAbs(0.5, 2e-3));
    CHECK_THAT(seen({0, 0, 0}, 900, 900), WithinAbs(0.5, 1e-4));
}

TEST_CASE("Patches blend over what is below by their distance to the edge") {
    const TempFolder folder;
    const auto base = whole(write(folder, "base.fits", 360, 180, std::vector<float>(360 * 180, 0.25F)));
    auto patch =
        part(write(folder, "patch.fits", 40, 40, std::vector<float>(40 * 40, 0.5F)), 10, 30, 10, -10);
    patch.feather_m = 50;
    patch.priority = 1;
    // The order of the tables does not count, priorities do.
    const auto albedo = open_albedo({patch, base}, ball, one_band);
    for (const double longitude : {9.0, 10.2, 11.0, 12.0, 13.0, 14.0, 20.0}) {
        // Distances end two texels of half a degree before the edge.
        const double metres = (longitude - 11) * degree * 1000;
        const double t = std::min(std::max(metres / 50, 0.0), 1.0);
        const double expected = 0.25 + 0.25 * t * t * (3 - 2 * t);
        CHECK_THAT(at(*albedo, 1000 * at_latitude(0, longitude * degree)), WithinAbs(expected, 1e-4));
    }
    REQUIRE(albedo->notes().size() == 3); // two on the maps, then the overlap
    CHECK_THAT(albedo->notes()[2],
               ContainsSubstring("patch.fits: albedo at 1296 points over what is below it: mean 0.5 against "
                                 "0.25, difference 0.25 rms; blended over 50 m"));
    // Between equal priorities the later covers the earlier; the default blend is 16 of its texels, at most a
    // quarter of its side, which is 349 m.
    patch.priority = 0;
    patch.feather_m = 0;
    const auto later = open_albedo({base, patch}, ball, one_band);
    CHECK_THAT(at(*later, 1000 * at_latitude(0, 20 * degree)), WithinAbs(0.5, 1e-4));
    CHECK_THAT(later->notes().back(), ContainsSubstring("blended over 87.27 m"));
    CHECK_THAT(at(*open_albedo({patch, base}, ball, one_band), 1000 * at_latitude(0, 20 * degree)),
               WithinAbs(0.25, 1e-4));
}

TEST_CASE("Missing texels of a patch show what is below") {
    const TempFolder folder;
    const auto base = whole(write(folder, "base.fits", 360, 180, std::vector<float>(360 * 180, 0.25F)));
    const auto values = texels(80, 80, [](int x, int y) {
        return std::hypot(x - 39.5, y - 39.5) < 10 ? static_cast<double>(none) : 0.5;
    });
    auto patch = part(write(folder, "hole.fits", 80, 80, values), 0, 40, 20, -20);
    patch.feather_m = 1e-3;
    patch.priority = 1;
    const auto albedo = open_albedo({base, patch}, ball, one_band);
    const auto seen = [&](double longitude) {
        return at(*albedo, 1000 * at_latitude(0, longitude * degree));
    };
    CHECK_THAT(seen(20), WithinAbs(0.25, 1e-4)); // the hole has a radius of 5 degrees
    CHECK_THAT(seen(24), WithinAbs(0.25, 1e-4));
    CHECK_THAT(seen(27), WithinAbs(0.5, 1e-4));
    // A wide footprint beside the hole does not see what stands for it.
    double factor = 0;
    albedo->factors(1000 * at_latitude(0, 30 * degree), {0, 60, 0}, {0, 0, 60}, 1, &factor);
    CHECK_THAT(factor, WithinAbs(0.5, 1e-4));
}

TEST_CASE("Giant albedo textures give the same values, and need not wait") {
    const TempFolder folder;
    const auto f = [](std::uint32_t, std::int64_t x, std::int64_t y) {
        return static_cast<float>(std::lround(120 + 60 * std::sin(static_cast<double>(x) / 50) +
                                              60 * std::cos(static_cast<double>(y) / 35)));
    };
    ObtMetadata m = planar_metadata(SampleType::u8, 2048, 1024);
    m.kind = ObtKind::albedo;
    m.scale = 1.0 / 255;
    FunctionSource source(f);
    (void)write_obt(folder.path() / "a.obt", m, source);
    const MapFrame frame =
        MapFrame::by_edges(terrain::Projection::of_sphere(ProjectionKind::simple_cylindrical, 1000, 0),
                           Registration::pixel, 2048, 1024, -pi, pi, pi / 2, -pi / 2);
    const auto paged = std::make_shared<PagedTexture>(
        std::make_shared<const ObtFile>(folder.path() / "a.obt", 0), std::size_t{32} << 20);
    const auto of = [&](std::shared_ptr<const Texture> texture) {
        return NestedAlbedo(ball, {{"a.obt", {std::move(texture), 2048, 1024, 1, {}}, frame}}, one_band);
    };
    const NestedAlbedo tiles = of(std::make_shared<const Texture>(paged, Texture::Edge::clamp));
    const NestedAlbedo memory =
        of(read_map_texture(folder.path() / "a.obt", TextureCoding::linear, [](auto...) {
               return Texture::Edge::clamp;
           }).texture);
    Directions random;
    for (int k = 0; k < 500; ++k) {
        const Vec3 p = 1000 * random();
        const Vec3 a = std::exp2(10 * random.number() - 6) * random(), b = 0.3 * cross(normalized(p), a);
        double one = 0, other = 0;
        tiles.factors(p, a, b, 1, &one);
        memory.factors(p, a, b, 1, &other);
        CHECK_THAT(one, WithinAbs(other, 3.0 / 255)); // levels of u8 are rounded
    }
    // Without waiting, from an empty cache: a value at once, then the exact one.
    const auto fresh = std::make_shared<PagedTexture>(
        std::make_shared<const ObtFile>(folder.path() / "a.obt", 0), std::size_t{32} << 20);
    const NestedAlbedo live = of(std::make_shared<const Texture>(fresh, Texture::Edge::clamp));
    const Vec3 p = 1000 * at_latitude(0.3, 1.1);
    fresh->set_waiting(false);
    const std::uint64_t before = fresh->coarser_lookups();
    const double coarse = at(live, p), exact = at(memory, p);
    CHECK(fresh->coarser_lookups() > before);
    CHECK_THAT(coarse, WithinAbs(exact, 0.5));
    for (int k = 0; k < 60'000 && std::abs(at(live, p) - exact) > 1e-5; ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    CHECK_THAT(at(live, p), WithinAbs(exact, 1e-5));
}

TEST_CASE("Files that cannot be albedo maps are refused in one line") {
    const TempFolder folder;
    const auto file = write(folder, "a.fits", 16, 8, std::vector<float>(128, 0.5F));
    CHECK(refusal({whole((folder.path() / "absent.fits").string())}) != "accepted");
    AlbedoTable unplaced;
    unplaced.file = file;
    CHECK_THAT(refusal({unplaced}), ContainsSubstring("a.fits: the file has no label with its place"));
    CHECK_THAT(refusal({whole(file)}, SurfaceDomain::plane(10)),
               ContainsSubstring("a.fits: a map of a planet on a plane"));
    AlbedoTable planar = whole(file);
    planar.map.projection = ProjectionKind::planar;
    planar.map.pixel_m = 1;
    CHECK_THAT(refusal({planar}), ContainsSubstring("a.fits: a planar map on a planet"));
    CHECK_THAT(refusal({whole(write(folder, "n.fits", 16, 8, std::vector<float>(128, none)))}),
               ContainsSubstring("n.fits: no pixel has data"));
    CHECK_THAT(refusal({part(file, 0, 400, 90, -90)}),
               ContainsSubstring("a.fits: a map of 16 columns of which"));
    images::write_fits_float(folder.path() / "c.fits", 16, 8, 2, std::vector<float>(256, 0.5F), "", {});
    CHECK_THAT(refusal({whole((folder.path() / "c.fits").string())}),
               ContainsSubstring("c.fits: 2 planes: allowed are 1, red, green and blue, or one for each of "
                                 "the 1 bands"));
    FunctionSource source([](std::uint32_t, std::int64_t, std::int64_t) { return 1.0F; });
    (void)write_obt(folder.path() / "h.obt", planar_metadata(SampleType::f32, 64, 64), source);
    AlbedoTable heights;
    heights.file = (folder.path() / "h.obt").string();
    CHECK_THAT(refusal({heights}, SurfaceDomain::plane(10)),
               ContainsSubstring("h.obt: a giant texture of heights, wanted is one of albedo"));
}

TEST_CASE("A planet with an albedo map looks like one of that albedo") {
    const TempFolder folder;
    // West dark, east bright; the camera looks from +x at the meridian of 0 degrees.
    const auto halves = whole(
        write(folder, "h.fits", 64, 32, texels(64, 32, [](int x, int) { return x < 32 ? 0.25 : 0.75; })));
    const auto picture = [&](const std::vector<AlbedoTable>& tables, double albedo) {
        PlanetParameters planet;
        planet.radii_m = {500, 500, 500};
        planet.relief.albedos = tables;
        planet.relief.cells_per_face = 256;
        scene::Scene s = sphere_scene(renderer::LambertParameters{albedo}, 0.6, 20, 64);
        s.bodies[0].shape = planet;
        s.camera = camera_at({1e5, 0, 0}, 64, 500 / 1e5 / 20);
        s.sun.position_m = astronomical_unit_m * normalized(Vec3{1, 0.2, 0.3});
        s.camera.psf_sigma_px = 0;
        RenderSettings settings;
        settings.threads = 1;
        const Renderer r(s, settings);
        return render(r);
    };
    const Image plain = picture({}, 0.4), mapped = picture({halves}, 0.4);
    int compared = 0;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            if (std::abs(x - 31.5) < 3 || std::hypot(x - 31.5, y - 31.5) > 17 || plain.at(x, y) == 0)
                continue;
            const double ratio = static_cast<double>(mapped.at(x, y)) / static_cast<double>(plain.at(x, y));
            // East is on the right where north is up.
            CHECK_THAT(ratio, WithinAbs(x > 31 ? 0.75 : 0.25, 1e-3));
            ++compared;
        }
    CHECK(compared > 400);
}

} // namespace nested_albedo_test
