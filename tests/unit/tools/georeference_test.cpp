// SPDX-License-Identifier: Apache-2.0
// Places of map samples from labels and coordinate systems, each trap of theirs as a label of its own.
#include "core/error.hpp"
#include "terrain/maps/map_source.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/import/map/georeference.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace georeference_test {

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using terrain::Latitudes;
using terrain::MapFrame;
using terrain::ProjectionKind;
using terrain::Registration;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// A label as LDEM_4's, with other values for some of its keywords; an empty value leaves one out.
images::PdsLabel label(const test::TempFolder& folder, const std::map<std::string, std::string>& changes) {
    std::map<std::string, std::string> keys{{"MAP_PROJECTION_TYPE", "\"SIMPLE CYLINDRICAL\""},
                                            {"MAP_RESOLUTION", "4 <pix/deg>"},
                                            {"MAP_SCALE", "7580.84 <m/pix>"},
                                            {"A_AXIS_RADIUS", "1737.4 <km>"},
                                            {"B_AXIS_RADIUS", "1737.4 <km>"},
                                            {"C_AXIS_RADIUS", "1737.4 <km>"},
                                            {"POSITIVE_LONGITUDE_DIRECTION", "\"EAST\""},
                                            {"CENTER_LATITUDE", "0 <deg>"},
                                            {"CENTER_LONGITUDE", "180 <deg>"},
                                            {"MAXIMUM_LATITUDE", "90 <deg>"},
                                            {"MINIMUM_LATITUDE", "-90 <deg>"},
                                            {"WESTERNMOST_LONGITUDE", "0 <deg>"},
                                            {"EASTERNMOST_LONGITUDE", "360 <deg>"},
                                            {"LINE_PROJECTION_OFFSET", "359.5 <pix>"},
                                            {"SAMPLE_PROJECTION_OFFSET", "719.5 <pix>"},
                                            {"COORDINATE_SYSTEM_NAME", "\"MEAN EARTH/POLAR AXIS OF DE421\""}};
    for (const auto& [key, value] : changes)
        keys[key] = value;
    std::string text = "PDS_VERSION_ID = PDS3\nOBJECT = IMAGE_MAP_PROJECTION\n";
    for (const auto& [key, value] : keys)
        if (!value.empty()) text += fmt::format("  {} = {}\n", key, value);
    return images::PdsLabel(folder.write("map.lbl", text + "END_OBJECT = IMAGE_MAP_PROJECTION\nEND\n"));
}

struct Placed {
    Georeference place;
    MapFrame frame;
    MapRemarks remarks;
    /// Degrees of a sample; longitudes from 0 to 360.
    [[nodiscard]] double longitude(double x, double y) const {
        const double l = place.projection.longitude_rad(frame.position({x, y})) / degree;
        return l < -1e-9 ? l + 360 : l;
    }
    [[nodiscard]] double latitude(double x, double y) const {
        return place.projection.latitude_rad(frame.position({x, y})) / degree;
    }
    [[nodiscard]] bool warned(const std::string& part) const {
        for (const std::string& w : remarks.warnings())
            if (w.find(part) != std::string::npos) return true;
        return false;
    }
};

Placed placed(const std::map<std::string, std::string>& changes, std::int64_t width = 1440,
              std::int64_t height = 720, const MapSettings& settings = {}) {
    const test::TempFolder folder;
    const images::PdsLabel l = label(folder, changes);
    GdalMap map;
    map.width = width;
    map.height = height;
    Placed out;
    out.place = georeference(map, &l, settings, "map.lbl", out.remarks);
    if (!out.place.foreign)
        out.frame = {out.place.projection, out.place.transform, out.place.registration, width, height};
    return out;
}

GdalMap with_system(GdalSystem system, std::array<double, 6> transform, std::int64_t width,
                    std::int64_t height) {
    GdalMap map;
    map.width = width;
    map.height = height;
    map.system = system;
    map.transform = transform;
    map.semi_major_m = map.semi_minor_m = 1737400;
    return map;
}

Placed placed_by(const GdalMap& map, const MapSettings& settings = {}) {
    Placed out;
    out.place = georeference(map, nullptr, settings, "map.tif", out.remarks);
    if (!out.place.foreign)
        out.frame = {out.place.projection, out.place.transform, out.place.registration, map.width,
                     map.height};
    return out;
}

} // namespace

TEST_CASE("MAP_RESOLUTION goes before a rounded MAP_SCALE") {
    const Placed moon = placed({});
    // LDEM_4.LBL: column 0 at 0.125 E, row 0 at 89.875 N.
    CHECK_THAT(moon.longitude(0, 0), WithinAbs(0.125, 1e-12));
    CHECK_THAT(moon.longitude(1439, 0), WithinAbs(359.875, 1e-12));
    CHECK_THAT(moon.latitude(0, 0), WithinAbs(89.875, 1e-12));
    CHECK_THAT(moon.latitude(0, 719), WithinAbs(-89.875, 1e-12));
    CHECK(moon.frame.period() == 1440);
    CHECK_FALSE(std::isnan(moon.frame.first_pole_y()));
    CHECK(moon.remarks.warnings().empty());
    // 512 pixels per degree and three decimals of a metre: half a pixel over the map.
    const std::map<std::string, std::string> fine{{"MAP_RESOLUTION", "512 <pix/deg>"},
                                                  {"MAP_SCALE", "59.225 <m/pix>"},
                                                  {"LINE_PROJECTION_OFFSET", "46079.5"},
                                                  {"SAMPLE_PROJECTION_OFFSET", "92159.5"}};
    const Placed large = placed(fine, 184320, 92160);
    CHECK_THAT(large.longitude(184319, 0), WithinAbs(360 - 0.5 / 512, 1e-11));
    REQUIRE(large.remarks.notes().size() == 1);
    CHECK_THAT(large.remarks.notes()[0], ContainsSubstring("MAP_SCALE is rounded, 0.91"));
    // Only the scale is there: whole pixels per degree are taken.
    const Placed scale_only = placed({{"MAP_RESOLUTION", ""}});
    CHECK_THAT(scale_only.longitude(1439, 0), WithinAbs(359.875, 1e-9));
}

TEST_CASE("projection offsets that count from 0 and from 1 are told apart by the edges") {
    // MOLA's MEGDR labels count from 1.
    const Placed mars = placed({{"LINE_PROJECTION_OFFSET", "360.5"}, {"SAMPLE_PROJECTION_OFFSET", "720.5"}});
    CHECK_THAT(mars.longitude(0, 0), WithinAbs(0.125, 1e-12));
    CHECK_THAT(mars.latitude(0, 0), WithinAbs(89.875, 1e-12));
    CHECK(mars.remarks.warnings().empty());
    // A regional map whose edges are rounded: its place is by the offsets, and that is said.
    const std::map<std::string, std::string> region{
        {"MAXIMUM_LATITUDE", "30.1"},        {"MINIMUM_LATITUDE", "0"},
        {"WESTERNMOST_LONGITUDE", "45.1"},   {"EASTERNMOST_LONGITUDE", "90.3"},
        {"LINE_PROJECTION_OFFSET", "119.5"}, {"SAMPLE_PROJECTION_OFFSET", "539.5"}};
    const Placed part = placed(region, 180, 120);
    CHECK_THAT(part.longitude(0, 0), WithinAbs(45.125, 1e-12));
    CHECK_THAT(part.latitude(0, 0), WithinAbs(29.875, 1e-12));
    CHECK(part.warned("SAMPLE_PROJECTION_OFFSET 539.5"));
    // Edges that fit and an offset that does not.
    CHECK(
        placed({{"LINE_PROJECTION_OFFSET", "300"}}).warned("LINE_PROJECTION_OFFSET 300 is 59.5 pixels off"));
}

TEST_CASE("a grid of nodes has one more sample") {
    const Placed nodes = placed({}, 1441, 721);
    CHECK(nodes.place.registration == Registration::node);
    CHECK_THAT(nodes.longitude(0, 0), WithinAbs(0, 1e-12));
    CHECK_THAT(nodes.longitude(4, 300), WithinAbs(1, 1e-12));
    CHECK_THAT(nodes.latitude(0, 0), WithinAbs(90, 1e-12));
    CHECK_THAT(nodes.latitude(0, 720), WithinAbs(-90, 1e-12));
    // The same from a GeoTIFF whose outer samples lie at the poles: GDAL gives the corners of pixels.
    const Placed tiff = placed_by(with_system(GdalSystem::geographic, {-0.5, 1, 0, 90.5, 0, -1}, 361, 181));
    CHECK(tiff.place.registration == Registration::node);
    CHECK_THAT(tiff.longitude(10, 90), WithinAbs(10, 1e-12));
    CHECK_THAT(tiff.latitude(10, 180), WithinAbs(-90, 1e-12));
}

TEST_CASE("longitudes that grow westwards, and twins of one product with other edges") {
    const Placed west = placed({{"POSITIVE_LONGITUDE_DIRECTION", "\"WEST\""},
                                {"WESTERNMOST_LONGITUDE", "360"},
                                {"EASTERNMOST_LONGITUDE", "0"}});
    // 360 W at the left is 0 E.
    CHECK_THAT(west.longitude(0, 0), WithinAbs(0.125, 1e-12));
    CHECK_THAT(west.longitude(100, 0), WithinAbs(25.125, 1e-12));
    CHECK(west.remarks.warnings().empty());
    const Placed west_180 = placed({{"POSITIVE_LONGITUDE_DIRECTION", "\"WEST\""},
                                    {"WESTERNMOST_LONGITUDE", "180"},
                                    {"EASTERNMOST_LONGITUDE", "-180"},
                                    {"CENTER_LONGITUDE", "0"}});
    CHECK_THAT(west_180.longitude(0, 0), WithinAbs(180.125, 1e-12));
    const Placed half = placed(
        {{"WESTERNMOST_LONGITUDE", "-180"}, {"EASTERNMOST_LONGITUDE", "180"}, {"CENTER_LONGITUDE", "0"}});
    CHECK_THAT(half.longitude(0, 0), WithinAbs(180.125, 1e-12));
    // Edges that are the same meridian.
    const Placed turn = placed(
        {{"WESTERNMOST_LONGITUDE", "180"}, {"EASTERNMOST_LONGITUDE", "180"}, {"CENTER_LONGITUDE", "0"}});
    CHECK_THAT(turn.longitude(0, 0), WithinAbs(180.125, 1e-12));
    CHECK(turn.frame.period() == 1440);
}

TEST_CASE("planetographic latitudes of Mars are 20 km from planetocentric ones") {
    const std::map<std::string, std::string> radii{{"A_AXIS_RADIUS", "3396.19 <km>"},
                                                   {"B_AXIS_RADIUS", "3396.19 <km>"},
                                                   {"C_AXIS_RADIUS", "3376.2 <km>"}};
    std::map<std::string, std::string> graphic = radii;
    graphic["COORDINATE_SYSTEM_NAME"] = "PLANETOGRAPHIC";
    const Placed a = placed(radii), b = placed(graphic);
    CHECK(a.place.projection.latitudes == Latitudes::planetocentric);
    CHECK(b.place.projection.latitudes == Latitudes::planetographic);
    const double apart = std::acos(std::min(
        1.0, dot(normalized(a.frame.position({0, 179.5})), normalized(b.frame.position({0, 179.5})))));
    CHECK_THAT(apart / degree, WithinAbs(0.338, 0.001));
    MapSettings forced;
    forced.latitudes = Latitudes::planetocentric;
    CHECK(placed(graphic, 1440, 720, forced).place.projection.latitudes == Latitudes::planetocentric);
}

TEST_CASE("polar stereographic labels") {
    // LDEM_80S_80M: 7584 x 7584 pixels of 80 m, the pole in the middle.
    const std::map<std::string, std::string> pole{{"MAP_PROJECTION_TYPE", "\"POLAR STEREOGRAPHIC\""},
                                                  {"MAP_RESOLUTION", "379.04 <pix/deg>"},
                                                  {"MAP_SCALE", "80 <m/pix>"},
                                                  {"CENTER_LATITUDE", "-90"},
                                                  {"CENTER_LONGITUDE", "0"},
                                                  {"MAXIMUM_LATITUDE", "-80"},
                                                  {"LINE_PROJECTION_OFFSET", "3791.5"},
                                                  {"SAMPLE_PROJECTION_OFFSET", "3791.5"}};
    std::map<std::string, std::string> from_one = pole;
    from_one["LINE_PROJECTION_OFFSET"] = from_one["SAMPLE_PROJECTION_OFFSET"] = "3792.5";
    for (const auto& keys : {pole, from_one}) {
        const Placed south = placed(keys, 7584, 7584);
        CHECK(south.place.projection.kind == ProjectionKind::south_polar_stereographic);
        CHECK_THAT(south.latitude(3791.5, 3791.5), WithinAbs(-90, 1e-9));
        // x = rho sin lon, y = rho cos lon, y up; rho = 2 R tan(colatitude / 2).
        CHECK_THAT(south.longitude(4791.5, 3791.5), WithinAbs(90, 1e-9));
        CHECK_THAT(south.longitude(3791.5, 2791.5), WithinAbs(0, 1e-9));
        CHECK_THAT(90 + south.latitude(4791.5, 3791.5),
                   WithinAbs(2 * std::atan(80e3 / 2 / 1737400) / degree, 1e-9));
    }
    std::map<std::string, std::string> north = pole;
    north["CENTER_LATITUDE"] = "90";
    CHECK_THAT(placed(north, 7584, 7584).longitude(3791.5, 4791.5), WithinAbs(0, 1e-9));
}

TEST_CASE("scenes read the same places from labels") {
    const std::map<std::string, std::string> as_ldem,
        west{{"POSITIVE_LONGITUDE_DIRECTION", "\"WEST\""},
             {"WESTERNMOST_LONGITUDE", "360"},
             {"EASTERNMOST_LONGITUDE", "0"}},
        graphic{{"C_AXIS_RADIUS", "1730 <km>"}, {"COORDINATE_SYSTEM_NAME", "PLANETOGRAPHIC"}},
        pole{{"MAP_PROJECTION_TYPE", "\"POLAR STEREOGRAPHIC\""},
             {"MAP_RESOLUTION", ""},
             {"CENTER_LATITUDE", "90"}},
        from_one{{"LINE_PROJECTION_OFFSET", "360.5"}, {"SAMPLE_PROJECTION_OFFSET", "720.5"}},
        other_sign{{"LINE_PROJECTION_OFFSET", "-359.5"}, {"SAMPLE_PROJECTION_OFFSET", "-719.5"}},
        nowhere{{"LINE_PROJECTION_OFFSET", ""}, {"SAMPLE_PROJECTION_OFFSET", ""}},
        pole_from_one{{"MAP_PROJECTION_TYPE", "\"POLAR STEREOGRAPHIC\""},
                      {"MAP_SCALE", "80 <m/pix>"},
                      {"MAP_RESOLUTION", "379.04"},
                      {"CENTER_LATITUDE", "-90"},
                      {"LINE_PROJECTION_OFFSET", "360.5"},
                      {"SAMPLE_PROJECTION_OFFSET", "720.5"}};
    for (const auto& keys : {as_ldem, west, graphic, pole, from_one, other_sign, nowhere, pole_from_one}) {
        const test::TempFolder folder;
        (void)label(folder, keys);
        const terrain::MapLabel other = terrain::read_map_label(folder.path() / "map.lbl", 1440, 720);
        REQUIRE(other.projection);
        REQUIRE(other.transform);
        const MapFrame theirs(*other.projection, *other.transform, other.registration, 1440, 720);
        const Placed ours = placed(keys);
        for (const terrain::SamplePlace at : {terrain::SamplePlace{0, 0}, {1439, 100}, {333, 719}})
            CHECK(length(theirs.position(at) - ours.frame.position(at)) < 1e-5);
    }
    // A grid of nodes is one in scenes too.
    const test::TempFolder folder;
    (void)label(folder, {});
    CHECK(terrain::read_map_label(folder.path() / "map.lbl", 1441, 721).registration == Registration::node);
}

TEST_CASE("offsets count from the middle of the first pixel, as PDS defines them and GDAL takes them") {
    const auto file = test::data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    if (!file) return;
    const terrain::MapLabel moon = terrain::read_map_label(*file, 1440, 720);
    REQUIRE(moon.transform);
    CHECK(moon.warnings.empty());
    // gdalinfo LDEM_4.LBL (GDAL 3.6.2): Origin = (-5458204.8, 2729102.4), Pixel Size = (7580.84, -7580.84),
    // by a MAP_SCALE that is rounded by 0.0024 m a pixel; here by 4 pixels a degree.
    const terrain::PixelTransform& t = *moon.transform;
    const double from_180 = t[0] + 1737400 * (moon.projection->centre_longitude_rad - std::numbers::pi);
    CHECK_THAT(from_180, WithinAbs(-5458204.8, 0.0025 * 720));
    CHECK_THAT(t[3], WithinAbs(2729102.4, 0.0025 * 360));
    CHECK_THAT(t[1], WithinAbs(7580.84, 0.0025));
    CHECK_THAT(t[5], WithinAbs(-7580.84, 0.0025));
    // The definition: the origin, 180 E on the equator, is SAMPLE_PROJECTION_OFFSET = 719.5 pixels right of
    // and LINE_PROJECTION_OFFSET = 359.5 pixels below the middle of sample 1, line 1, in a raster counted
    // from 0.
    const MapFrame frame(*moon.projection, t, moon.registration, 1440, 720);
    const terrain::SamplePlace origin = frame.place({-1, 0, 0});
    CHECK_THAT(origin.x, WithinAbs(719.5, 1e-9));
    CHECK_THAT(origin.y, WithinAbs(359.5, 1e-9));
}

TEST_CASE("coordinate systems of GDAL") {
    // Degrees, the corner of a pixel.
    const Placed strip =
        placed_by(with_system(GdalSystem::geographic, {216, 1. / 64, 0, -42, 0, -1. / 64}, 1024, 3071));
    CHECK_THAT(strip.longitude(0, 0), WithinAbs(216 + 0.5 / 64, 1e-12));
    CHECK_THAT(strip.latitude(0, 3070), WithinAbs(-42 - 3070.5 / 64, 1e-12));
    CHECK(strip.place.registration == Registration::pixel);
    // Metres, rounded to a centimetre.
    GdalMap eqc =
        with_system(GdalSystem::projected, {-5458204.8, 7580.84, 0, 2729102.4, 0, -7580.84}, 1440, 720);
    eqc.method = "Equirectangular";
    eqc.parameters = {{"central_meridian", 180}, {"standard_parallel_1", 0}};
    const Placed whole = placed_by(eqc);
    CHECK(whole.frame.period() == 1440);
    CHECK_THAT(whole.longitude(0, 0), WithinAbs(0.125, 1e-11));
    CHECK_THAT(whole.latitude(0, 719), WithinAbs(-89.875, 1e-11));
    // A scale factor at the pole; false origin in kilometres.
    GdalMap stereo = with_system(GdalSystem::projected, {990, 0.01, 0, 1010, 0, -0.01}, 2000, 2000);
    stereo.method = "Polar_Stereographic";
    stereo.metres_per_unit = 1000;
    stereo.parameters = {{"latitude_of_origin", -90},
                         {"central_meridian", 0},
                         {"scale_factor", 0.994},
                         {"false_easting", 1e6},
                         {"false_northing", 1e6}};
    const Placed pole = placed_by(stereo);
    CHECK_THAT(pole.latitude(999.5, 999.5), WithinAbs(-90, 1e-9));
    CHECK_THAT(90 + pole.latitude(1999.5, 999.5),
               WithinAbs(2 * std::atan(10e3 / 0.994 / 2 / 1737400) / degree, 1e-9));
    GdalMap other = eqc;
    other.method = "Sinusoidal";
    CHECK(placed_by(other).place.foreign);
}

TEST_CASE("the command line goes before the file") {
    GdalMap picture = with_system(GdalSystem::none, {}, 360, 180);
    picture.transform.reset();
    picture.semi_major_m = picture.semi_minor_m = 0;
    CHECK_THROWS_WITH(placed_by(picture),
                      ContainsSubstring("map.tif: it does not say where its samples are: --edges"));
    MapSettings edges;
    edges.edges_deg = {-180, 180, 90, -90};
    CHECK_THAT(placed_by(picture, edges).longitude(0, 0), WithinAbs(180.5, 1e-12));
    edges.west_positive = true;
    edges.edges_deg = {360, 0, 90, -90};
    CHECK_THAT(placed_by(picture, edges).longitude(0, 0), WithinAbs(0.5, 1e-12));
    MapSettings down;
    down.shift_rows = 1;
    CHECK_THAT(
        placed({{"MAXIMUM_LATITUDE", "45"}, {"MINIMUM_LATITUDE", "-45"}, {"LINE_PROJECTION_OFFSET", "179.5"}},
               1440, 360, down)
            .latitude(0, 0),
        WithinAbs(44.625, 1e-9));
    MapSettings plane;
    plane.planar_pixel_m = 10;
    const Placed flat = placed_by(picture, plane);
    CHECK(flat.place.projection.kind == ProjectionKind::planar);
    CHECK_THAT(flat.frame.position({0, 0}).x, WithinAbs(-1795, 1e-9));
    CHECK_THAT(flat.frame.position({0, 0}).y, WithinAbs(895, 1e-9));
    CHECK_THROWS_AS(placed({{"A_AXIS_RADIUS", ""}}), InputError);
    CHECK_THROWS_AS(placed({{"MAP_RESOLUTION", ""}, {"MAP_SCALE", ""}}), InputError);
    CHECK(placed({{"MAP_PROJECTION_TYPE", "\"SINUSOIDAL\""}}).place.foreign);
}

} // namespace georeference_test
