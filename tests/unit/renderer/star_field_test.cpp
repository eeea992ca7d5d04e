// SPDX-License-Identifier: Apache-2.0
// Stars of a catalogue file: the same image and irradiances as the same stars in a table, the rows that they
// are assigned to, and the scene's keys.
#include "core/error.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "renderer/integrators/star_rows.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/renderer.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/view.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace star_field_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::Contains;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr std::int32_t size = 96;

/// Stars around the x axis, some of them outside the field.
std::vector<ephemeris::CatalogueStar> some_stars(int count, double within_rad) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform;
    std::vector<ephemeris::CatalogueStar> stars;
    for (int i = 0; i < count; ++i) {
        ephemeris::CatalogueStar star;
        star.direction = ephemeris::direction_of((uniform(random) - 0.5) * 2 * within_rad,
                                                 (uniform(random) - 0.5) * 2 * within_rad);
        star.magnitude_v = std::round(8000 * uniform(random)) / 1000;
        if (i % 3 != 0) star.colour_b_v = std::round(-300 + 2000 * uniform(random)) / 1000;
        if (i % 2 != 0) {
            star.type_number = std::round(699 * uniform(random)) / 100;
            star.luminosity = static_cast<ephemeris::Luminosity>(i % 4);
        }
        stars.push_back(star);
    }
    return stars;
}

scene::StarCatalogue catalogue_of(const std::vector<ephemeris::CatalogueStar>& stars) {
    return {
        std::make_shared<const ephemeris::StarFile>(ephemeris::star_file_bytes(stars, "test", {}), "test")};
}

scene::Scene scene_of(double slew_deg_s) {
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.bands = {SpectralBand{400e-9, 550e-9}, SpectralBand{550e-9, 900e-9}};
    s.camera.width = s.camera.height = size;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = s.camera.pixel_pitch_m * size / 2 / std::tan(6 * degree);
    s.camera.motion.samples[0].pose.orientation = look_along({1, 0, 0}, {0, 0, 1});
    s.camera.motion.spin_axis = {1, 0.4, 0.2};
    s.camera.motion.spin_rate_rad_s = slew_deg_s * degree;
    return s;
}

std::vector<RowTime> rolling(std::int64_t row_ns, std::int64_t exposure_ns) {
    std::vector<RowTime> rows;
    for (std::int32_t y = 0; y < size; ++y)
        rows.push_back({Time{y * row_ns}, Time{y * row_ns + exposure_ns}});
    return rows;
}

std::vector<float> image_of(const Renderer& renderer, const std::vector<RowTime>& rows, std::int32_t first,
                            std::int32_t count) {
    RenderRequest request;
    request.window = {0, 0, size, size};
    request.first_row = first;
    request.rows = count;
    request.row_times =
        std::span(rows).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count));
    std::vector<float> image(renderer.band_count() * static_cast<std::size_t>(count) * size);
    REQUIRE(renderer.render(request, image));
    return image;
}

} // namespace

TEST_CASE("a catalogue file gives the irradiances of the same stars in a table", "[stars]") {
    for (const scene::StarSpectrum spectrum :
         {scene::StarSpectrum::measured, scene::StarSpectrum::black_body}) {
        scene::Scene s = scene_of(0);
        s.catalogue = catalogue_of(some_stars(500, 0.5));
        s.catalogue.spectrum = spectrum;
        const StarField field(s);
        REQUIRE(field.size() == 500);
        for (std::uint32_t i = 0; i < field.size(); ++i) {
            const scene::Star star = scene::star_of(s, i);
            CHECK(star.spectrum == spectrum);
            for (std::size_t b = 0; b < s.bands.size(); ++b)
                CHECK(field.irradiance(i, b) ==
                      Approx(star_irradiance_w_m2(star, s.bands[b])).epsilon(1e-12));
        }
    }
}

TEST_CASE("a catalogue file gives the image of the same stars in a table", "[stars]") {
    scene::Scene file = scene_of(0), table = scene_of(0);
    file.catalogue = catalogue_of(some_stars(400, 8 * degree));
    const StarField field(file);
    for (std::uint32_t i = 0; i < field.size(); ++i)
        if (scene::star_of(file, i).magnitude_v <= 6) table.stars.push_back(scene::star_of(file, i));
    file.catalogue.limiting_v = 6;
    CHECK(scene::star_totals(file).count == table.stars.size());
    CHECK(scene::star_totals(file).faintest_v == scene::star_totals(table).faintest_v);
    const std::vector<RowTime> rows = rolling(0, 0);
    const Renderer with_file(file, {}), with_table(table, {});
    const std::vector<float> a = image_of(with_file, rows, 0, size), b = image_of(with_table, rows, 0, size);
    const float most = *std::max_element(b.begin(), b.end());
    REQUIRE(most > 0);
    for (std::size_t i = 0; i < a.size(); ++i)
        CHECK(std::abs(a[i] - b[i]) <= 1e-6F * most);
    CHECK(with_file.view(Time{0}).stars == with_table.view(Time{0}).stars);
    CHECK(with_file.view(Time{0}).stars > 50);
}

TEST_CASE("every row has the stars that light it, whatever the camera's motion", "[stars]") {
    // 1 to 300 degrees a second, 2 s from the first row to the last at most.
    for (const double slew_deg_s : {0.0, 1.0, 30.0, 300.0})
        for (const std::int64_t exposure_ns : {0, 10'000'000}) {
            scene::Scene s = scene_of(slew_deg_s);
            s.catalogue = catalogue_of(some_stars(3000, slew_deg_s > 100  ? 3.0
                                                        : slew_deg_s > 10 ? 0.5
                                                                          : 12 * degree));
            const std::vector<BuiltBody> bodies;
            const auto lens = make_projection(s.camera);
            const StarField field(s);
            constexpr double reach = 3;
            const StarRows star_rows(s, bodies, *lens, field, reach);
            const std::vector<RowTime> rows = rolling(20'000'000, exposure_ns);
            StarsInView view;
            const Region window{16, 0, 64, size};
            star_rows.assign(rows, window, 0, false, view);
            std::size_t lit = 0, listed = 0;
            for (std::size_t r = 0; r < rows.size(); ++r) {
                const auto in_row = view.in_row(r);
                CHECK(std::is_sorted(in_row.begin(), in_row.end()));
                listed += in_row.size();
                std::vector<std::uint32_t> numbers;
                for (const std::uint32_t i : in_row)
                    numbers.push_back(view.stars.numbers[i]);
                for (const Time t : {rows[r].reset, rows[r].mid(), rows[r].read}) {
                    const Quat attitude = camera_pose(s, bodies, to_seconds(t.ns)).orientation;
                    for (std::uint32_t i = 0; i < field.size(); ++i) {
                        const auto at = lens->project(rotate(conjugate(attitude), field.place(i).direction));
                        if (!at || std::abs(at->y - static_cast<double>(r)) > reach ||
                            at->x < window.x - reach || at->x > window.x + window.width - 1 + reach)
                            continue;
                        ++lit;
                        CHECK(std::binary_search(numbers.begin(), numbers.end(), i));
                    }
                }
            }
            CAPTURE(slew_deg_s, exposure_ns, lit, listed);
            CHECK(lit > 100);
            // Slow cameras do not get every star in every row.
            if (slew_deg_s <= 1) CHECK(listed < 12 * lit / 3);
        }
}

TEST_CASE("stars move from J2000.0 to the scene's epoch, and by their parallax", "[stars]") {
    // Barnard's star and a neighbour without motion, seen from 1 au on two sides of the Sun.
    std::vector<ephemeris::CatalogueStar> stars(2);
    stars[0].direction = ephemeris::direction_of(269.45207512 * degree, 4.69339089 * degree);
    stars[0].motion_ra_mas_yr = -801.551;
    stars[0].motion_dec_mas_yr = 10362.394;
    stars[0].parallax_mas = 546.976;
    stars[0].magnitude_v = 9.51;
    stars[1].direction = ephemeris::direction_of(269.5 * degree, 4.7 * degree);
    scene::Scene s = scene_of(0);
    s.catalogue = catalogue_of(stars);
    // 2026-01-01T00:00:00 TAI.
    s.epoch = ephemeris::Epoch{1'767'225'600'000'000'000};
    s.sun.position_m = {0, 0, 0};
    const StarField field(s);
    FieldStars found;
    const double years = (1'767'225'600.0 - (946'728'000 - 32.184)) / (365.25 * 86400);
    for (const double side : {-1.0, 1.0}) {
        const StarObserver observer = star_observer(s, {0, side * 149'597'870'700.0, 0}, 0);
        CHECK(observer.years == Approx(years).epsilon(1e-12));
        field.inside(stars[1].direction, 1 * degree, observer, found);
        REQUIRE(found.numbers.size() == 2);
        for (std::size_t i = 0; i < 2; ++i) {
            const bool moves = s.catalogue.file->star(found.numbers[i]).parallax_mas > 0;
            const Vec3 expected =
                moves ? ephemeris::direction_at(stars[0], years, {0, side, 0}) : stars[1].direction;
            CHECK(length(found.places[i].from(observer) - expected) < 1e-9);
        }
    }
    // A cone about where it will be in 2900 finds it, 2.6 degrees from where it was.
    const StarObserver late{900, {}};
    field.inside(ephemeris::direction_at(stars[0], 900, {}), 0.01 * degree, late, found);
    CHECK(std::any_of(found.places.begin(), found.places.end(),
                      [](const StarPlace& p) { return p.parallax_rad > 0; }));
    s.epoch.reset();
    CHECK(star_observer(s, {1e12, 0, 0}, 1e9).years == 0);
    CHECK(length(star_observer(s, {1e12, 0, 0}, 1e9).position_au) == 0);
}

TEST_CASE("rows have the same stars alone as in their frame", "[stars]") {
    for (const double slew_deg_s : {0.0, 30.0}) {
        scene::Scene s = scene_of(slew_deg_s);
        s.catalogue = catalogue_of(some_stars(1000, 0.6));
        const Renderer renderer(s, {});
        const std::vector<RowTime> rows = rolling(2'000'000, 1'000'000);
        const std::vector<float> whole = image_of(renderer, rows, 0, size);
        for (std::int32_t y = 0; y < size; y += 5) {
            const std::vector<float> row = image_of(Renderer(s, {}), rows, y, 1);
            for (std::size_t b = 0; b < s.bands.size(); ++b)
                for (std::int32_t x = 0; x < size; ++x)
                    CHECK(
                        row[b * size + static_cast<std::size_t>(x)] ==
                        whole[(b * size + static_cast<std::size_t>(y)) * size + static_cast<std::size_t>(x)]);
        }
    }
}

TEST_CASE("a scene names a catalogue file as it names a table", "[stars]") {
    const test::TempFolder folder;
    const auto bytes = ephemeris::star_file_bytes(some_stars(100, 1), "test", {});
    const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    folder.write("some.obstars", text);
    const auto file = folder.write("scene.toml", "[stars]\ncatalogue = \"some.obstars\"\n"
                                                 "limiting_magnitude = 5\nspectrum = \"black-body\"\n");
    const scene::Scene s = scene::load_scene(file);
    CHECK(s.stars.empty());
    REQUIRE(s.catalogue.file);
    CHECK(s.catalogue.file->size() == 100);
    CHECK(s.catalogue.limiting_v == 5);
    CHECK(s.catalogue.spectrum == scene::StarSpectrum::black_body);
    folder.write("some.obstars", text.substr(0, 3000));
    CHECK_THROWS_WITH(scene::load_scene(file),
                      Contains("scene.toml:2:") && Contains("it is truncated or damaged"));
}

TEST_CASE("stars of a table of irradiances give each band what it says", "[stars]") {
    const test::TempFolder folder;
    folder.write("stars.csv", "x,y,z,e1,e2\n2,0,0,1e-9,3e-9\n1,0.05,0.02,0,5e-10\n-1,0,0,1,1\n");
    folder.write("s.toml", R"(
[camera]
width = 96
height = 96
focal_length_mm = 50
pixel_pitch_um = 100
boresight = [1, 0, 0]
up = [0, 0, 1]
[sun]
irradiance_scale = 0
[stars]
irradiances = "stars.csv"
[[band]]
from_nm = 400
to_nm = 550
transmission = [[400, 0.5]]
[[band]]
from_nm = 550
to_nm = 900
)");
    const Renderer renderer(scene::load_scene(folder.path() / "s.toml"), {});
    const std::vector<float> image = image_of(renderer, rolling(0, 0), 0, size);
    double sum[2]{};
    for (std::size_t i = 0; i < image.size(); ++i)
        sum[i / (size * size)] += static_cast<double>(image[i]);
    CHECK(sum[0] == Approx(1e-9).epsilon(1e-5));
    CHECK(sum[1] == Approx(3.5e-9).epsilon(1e-5));
}

TEST_CASE("a table of irradiances that cannot be is refused with one line", "[stars]") {
    const test::TempFolder folder;
    for (const auto& [row, what] : {std::pair{"0,0,0,1", "a direction of length 0"},
                                    {"1,0,0,-1", "is less than 0"},
                                    {"1,0,0", "stars.csv:2"}}) {
        folder.write("stars.csv", std::string("x,y,z,e1\n") + row + "\n");
        folder.write("s.toml", "[stars]\nirradiances = \"stars.csv\"\n");
        CHECK_THROWS_WITH(scene::load_scene(folder.path() / "s.toml"), Contains(what));
    }
}

} // namespace star_field_test
