// SPDX-License-Identifier: Apache-2.0
// Maps from files: projections of labels and keys, real data of the Moon, and files that are refused.
#include "core/error.hpp"
#include "terrain/maps/height_stack.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/obt/obt_writer.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

namespace map_source_test {

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double moon_m = 1737400;
const SurfaceDomain moon = SurfaceDomain::ellipsoid({moon_m, moon_m, moon_m});

Vec3 direction(double longitude_deg, double latitude_deg) {
    return {std::cos(latitude_deg * degree) * std::cos(longitude_deg * degree),
            std::cos(latitude_deg * degree) * std::sin(longitude_deg * degree),
            std::sin(latitude_deg * degree)};
}

HeightRaster open(const std::filesystem::path& file, MapFindings* found = nullptr) {
    MapFindings lines;
    MapKeys keys;
    keys.file = file;
    HeightRaster raster = open_map(keys, moon, found != nullptr ? *found : lines);
    return raster;
}

/// A PDS3 file of 8 x 4 bytes with an attached label.
std::filesystem::path pds3(const std::filesystem::path& folder, const std::string& map,
                           const std::string& image = {}) {
    const std::filesystem::path file = folder / "map.lbl";
    std::string label =
        "PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 2048\r\n^IMAGE = 2\r\nOBJECT = IMAGE\r\n LINES = 4\r\n "
        "LINE_SAMPLES = 8\r\n SAMPLE_TYPE = UNSIGNED_INTEGER\r\n SAMPLE_BITS = 8\r\n" +
        image + "END_OBJECT = IMAGE\r\nOBJECT = IMAGE_MAP_PROJECTION\r\n" + map +
        "END_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n";
    label.resize(2048, ' ');
    for (int i = 0; i < 32; ++i)
        label += static_cast<char>(i);
    std::ofstream(file, std::ios::binary) << label;
    return file;
}

const std::string cylindrical =
    " MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\r\n A_AXIS_RADIUS = 1737.4 <km>\r\n C_AXIS_RADIUS = "
    "1737.4 <km>\r\n"
    " MAP_RESOLUTION = 0.0222222222222222 <pix/deg>\r\n CENTER_LONGITUDE = 180 <deg>\r\n"
    " SAMPLE_PROJECTION_OFFSET = 3.5\r\n LINE_PROJECTION_OFFSET = 1.5\r\n";

} // namespace

TEST_CASE("The global LOLA map is where its label says") {
    const auto file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    if (!file) return;
    MapFindings found;
    const HeightRaster map = open(*file, &found);
    CHECK(found.warnings.empty());
    CHECK(map.meaning == HeightMeaning::radius);
    CHECK(map.raster->whole());
    Raster::Reader reader(*map.raster);
    const auto height = [&](double longitude, double latitude) {
        return map.offset_m + map.scale_m * reader.at(direction(longitude, latitude), 0) - moon_m;
    };
    // gdallocationinfo -valonly LDEM_4.LBL: DN of half a metre at columns and rows
    CHECK_THAT(height(0.125, 59.625), WithinAbs(-4939 * 0.5, 2e-4));
    CHECK_THAT(height(359.875, -59.625), WithinAbs(-3035 * 0.5, 2e-4));
    CHECK_THAT(height(175.125, 2.375), WithinAbs(4939 * 0.5, 2e-4));
    CHECK_THAT(height(0.125 - 360, -59.625), WithinAbs(-2370 * 0.5, 2e-4));
    // numpy: 1.125 mean(row 0) - 0.125 mean(row 1), the cubic across the pole in the mean of all longitudes
    CHECK_THAT(height(30, 90), WithinAbs(-61.54375 * 0.5, 1e-3));
    CHECK_THAT(height(30, -90), WithinAbs(157.896701 * 0.5, 1e-3));
}

TEST_CASE("The maps of the lunar south pole agree where they overlap") {
    const auto strip_file = data_file("dem_moon_southpole/gld100_64ppd_216-232E_42-90S.tif");
    const auto site_file = data_file("dem_moon_southpole/lola_site01_10m.tif");
    if (!strip_file || !site_file) return;
    const HeightRaster strip = open(*strip_file), site = open(*site_file);
    Raster::Reader strip_reader(*strip.raster), site_reader(*site.raster);
    const auto of = [](const HeightRaster& map, double sample) {
        return map.offset_m + map.scale_m * sample;
    };
    // gdallocationinfo -valonly -geoloc, at middles of pixels
    CHECK_THAT(of(strip, strip_reader.at(direction(222.5078125, -60.0078125), 0)), WithinAbs(-4270, 1e-6));
    CHECK_THAT(of(strip, strip_reader.at(direction(231.9921875, -42.0078125), 0)), WithinAbs(-780, 1e-6));
    const MapFrame& frame = site.raster->frame();
    const auto dn = [](double value) { return -523.2 + 0.0378835736629282 * value; };
    const auto at = [&](double x_m, double y_m) {
        return of(site, site_reader.at(frame.projection().inverse({x_m, y_m}), 0));
    };
    CHECK_THAT(at(-10995, -12005), WithinAbs(dn(65133), 1e-3));
    CHECK_THAT(at(-18995, -4005), WithinAbs(dn(32518), 1e-3));
    CHECK_THAT(at(-3005, -19995), WithinAbs(dn(19915), 1e-3));

    // All pixels of the site inside the strip; a shift of one row of the strip would give 88 m.
    double sum = 0, squares = 0;
    int count = 0;
    for (int j = 0; j < 1600; ++j)
        for (int i = 0; i < 1600; ++i) {
            const Vec3 p = frame.position({static_cast<double>(i), static_cast<double>(j)});
            double longitude = frame.projection().longitude_rad(p) / degree;
            if (longitude < 0) longitude += 360;
            if (longitude < 216.1 || longitude > 231.9) continue;
            const double difference = of(strip, strip_reader.bilinear(p)) - of(site, site_reader.bilinear(p));
            if (!std::isfinite(difference)) continue;
            sum += difference;
            squares += difference * difference;
            ++count;
        }
    const double mean = sum / count;
    CHECK(count > 800000);
    CHECK_THAT(mean, WithinAbs(-2.06, 0.05));
    CHECK_THAT(std::sqrt(squares / count - mean * mean), WithinAbs(6.44, 0.05));
}

TEST_CASE("Three maps of the Moon nest") {
    const auto global_file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    const auto strip_file = data_file("dem_moon_southpole/gld100_64ppd_216-232E_42-90S.tif");
    const auto site_file = data_file("dem_moon_southpole/lola_site01_10m.tif");
    if (!global_file || !strip_file || !site_file) return;
    std::vector<HeightSource> sources(3);
    sources[0] = {"global", open(*global_file)};
    sources[1] = {"strip", open(*strip_file), 1, 4000};
    sources[2] = {"site", open(*site_file), 2, 1000};
    const HeightStack stack = make_height_stack(moon, sources);
    REQUIRE(stack.overlaps.size() == 2);
    CHECK(stack.overlaps[0].points > 200000);
    CHECK(stack.overlaps[0].rms_m < 250);
    CHECK(std::abs(stack.overlaps[0].mean_m) < 10);
    CHECK(stack.overlaps[1].rms_m < 250);
    // C0 along the last 30 km to the site, and beyond its far edge: steps of 0.1 m, slopes of up to 45
    // degrees.
    std::vector<Vec3> path;
    for (double d = 0; d < 40000; d += 0.1) {
        const double latitude = -88.6 - d / moon_m / degree;
        path.push_back(moon_m * direction(222.5, latitude));
    }
    const std::vector<double> heights = heights_at(stack.layers, path, 0);
    double steepest = 0;
    for (std::size_t i = 1; i < heights.size(); ++i)
        steepest = std::max(steepest, std::abs(heights[i] - heights[i - 1]) / 0.1);
    CHECK(steepest < 1.2);
    CHECK(steepest > 0.3); // it is the ridge of Shackleton's rim
    // At 1000 km each has its own: the layers above must not reach beyond their edges.
    const Vec3 far = moon_m * direction(100, 20);
    CHECK(heights_at(stack.layers, {&far, 1}, 0).front() ==
          heights_at({stack.layers[0]}, {&far, 1}, 0).front());
}

TEST_CASE("Labels of PDS3 maps place them") {
    const TempFolder folder;
    HeightRaster map = open(pds3(folder.path(), cylindrical));
    CHECK(map.meaning == HeightMeaning::height);
    Raster::Reader reader(*map.raster);
    const auto value = [&](const HeightRaster& m, Vec3 p) {
        Raster::Reader r(*m.raster);
        return m.offset_m + m.scale_m * r.at(p, 0);
    };
    CHECK_THAT(value(map, direction(22.5, 22.5)), WithinAbs(8, 1e-6));
    CHECK_THAT(value(map, direction(22.5 + 45 * 3, -22.5)), WithinAbs(19, 1e-6));
    // Kilometres, a number for missing data, radii with the reference as offset.
    map = open(pds3(folder.path(), cylindrical,
                    " UNIT = KILOMETER\r\n MISSING_CONSTANT = 3\r\n OFFSET = 1737.4\r\n"
                    " SCALING_FACTOR = 0.1\r\n"));
    CHECK(map.meaning == HeightMeaning::radius);
    CHECK(map.raster->samples().has_holes());
    CHECK_THAT(value(map, direction(22.5 + 45 * 3, -22.5)), WithinAbs(1737400 + 1900, 1e-3));
    CHECK(std::isnan(value(map, direction(22.5 + 45 * 3, 67.5))));
    // Polar stereographic, pole in the middle.
    map = open(pds3(folder.path(),
                    " MAP_PROJECTION_TYPE = \"POLAR STEREOGRAPHIC\"\r\n A_AXIS_RADIUS = 1737.4 <km>\r\n"
                    " CENTER_LATITUDE = -90 <deg>\r\n MAP_SCALE = 100 <m/pix>\r\n"
                    " SAMPLE_PROJECTION_OFFSET = 3.5\r\n LINE_PROJECTION_OFFSET = 1.5\r\n"));
    const Projection south = Projection::of_sphere(ProjectionKind::south_polar_stereographic, moon_m);
    CHECK_THAT(value(map, south.inverse({-350, 150})), WithinAbs(0, 1e-6));
    CHECK_THAT(value(map, south.inverse({50, -50})), WithinAbs(8 * 2 + 4, 1e-6));
    // Numbers of the label that contradict each other.
    MapFindings found;
    (void)open(pds3(folder.path(), cylindrical + " MAP_SCALE = 1300 <km/pix>\r\n"), &found);
    REQUIRE(!found.warnings.empty());
    CHECK_THAT(found.warnings.back(),
               ContainsSubstring("MAP_SCALE 1.3e+06 m/pixel contradicts MAP_RESOLUTION"));
}

TEST_CASE("A giant texture is a map, in either registration, at any footprint") {
    const TempFolder folder;
    const auto smooth = [](Vec3 p) { return 1000 * (p.x * p.y + 0.7 * p.z * p.z * p.z - 0.4 * p.y); };
    for (const Registration registration : {Registration::pixel, Registration::node}) {
        const bool nodes = registration == Registration::node;
        ObtMetadata metadata;
        metadata.type = SampleType::f32;
        metadata.width = nodes ? 1441 : 1440;
        metadata.height = nodes ? 721 : 720;
        metadata.semi_axes_m = {moon_m, moon_m, moon_m};
        const MapFrame frame = MapFrame::by_edges(
            Projection::of_sphere(ProjectionKind::simple_cylindrical, moon_m), registration, metadata.width,
            metadata.height, -40 * degree, 320 * degree, 90 * degree, -90 * degree);
        metadata.registration = registration;
        metadata.transform = frame.transform();
        metadata.projection = frame.projection();
        class Source final : public ObtSource {
        public:
            Source(const MapFrame& frame, double (*height)(Vec3)) : frame_(frame), height_(height) {}
            void read(std::uint32_t /*plane*/, std::int64_t x, std::int64_t y, int columns, int rows,
                      std::span<float> out) override {
                for (int j = 0; j < rows; ++j)
                    for (int i = 0; i < columns; ++i)
                        out[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                            static_cast<std::size_t>(i)] =
                            static_cast<float>(height_(
                                frame_.position({static_cast<double>(x + i), static_cast<double>(y + j)})));
            }

        private:
            const MapFrame& frame_;
            double (*height_)(Vec3);
        } source(frame, smooth);
        const auto file = folder.path() / (nodes ? "nodes.obt" : "pixels.obt");
        (void)write_obt(file, metadata, source);
        const HeightRaster map = open(file);
        CHECK(map.meaning == HeightMeaning::height);
        CHECK(map.raster->whole());
        Raster::Reader reader(*map.raster);
        for (int k = 0; k < 3000; ++k) {
            const Vec3 p = direction(k * 137.508 - 180, 89 * std::sin(0.73 * k));
            CHECK(std::abs(reader.at(p, 0) - smooth(p)) < 0.01);
            // At the seam, the first and the last node of reduced levels miss their neighbours beyond it.
            const bool seam = nodes && std::abs(std::remainder(std::atan2(p.y, p.x) / degree + 40, 360)) < 4;
            for (const double pixels : {1.5, 3.7, 8.0}) {
                const double footprint = pixels * 0.25 * degree;
                CAPTURE(nodes, k, pixels);
                const bool polar = std::abs(p.z) > std::cos(8 * footprint);
                const double tolerance = 0.05 + 15 * footprint + 900 * footprint * footprint +
                                         (polar  ? 100
                                          : seam ? 300
                                                 : 0) *
                                             footprint;
                REQUIRE(std::abs(reader.at(p, footprint) - smooth(p)) < tolerance);
            }
        }
    }
    // Not a map of heights.
    ObtMetadata metadata;
    metadata.kind = ObtKind::albedo;
    metadata.type = SampleType::u8;
    metadata.width = metadata.height = 4;
    metadata.projection.kind = ProjectionKind::planar;
    class Nothing final : public ObtSource {
        void read(std::uint32_t, std::int64_t, std::int64_t, int, int, std::span<float> out) override {
            std::fill(out.begin(), out.end(), 1.0F);
        }
    } nothing;
    (void)write_obt(folder.path() / "albedo.obt", metadata, nothing);
    CHECK_THROWS_WITH(open(folder.path() / "albedo.obt"),
                      ContainsSubstring("a giant texture of albedo, wanted is one of heights"));
}

TEST_CASE("Files that are no map are refused by name") {
    const TempFolder folder;
    const auto refused = [&](const std::string& map, const std::string& what) {
        CHECK_THROWS_WITH(open(pds3(folder.path(), map)), ContainsSubstring("map.lbl: " + what));
    };
    refused("", "the file has no label with its place on the body");
    refused(" MAP_PROJECTION_TYPE = SINUSOIDAL\r\n A_AXIS_RADIUS = 1737.4\r\n MAP_RESOLUTION = 4\r\n",
            "a map in SINUSOIDAL projection, allowed are");
    refused(" MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\r\n MAP_RESOLUTION = 4\r\n",
            "the label's map has no A_AXIS_RADIUS");
    refused(" MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\r\n A_AXIS_RADIUS = 1737.4\r\n",
            "the label's map has neither");
    refused(" MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\r\n A_AXIS_RADIUS = 1737.4\r\n MAP_RESOLUTION = "
            "0.01\r\n",
            "the label does not say where the samples are: it has neither WESTERNMOST_LONGITUDE and "
            "EASTERNMOST_LONGITUDE nor SAMPLE_PROJECTION_OFFSET; give");
    refused(" MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\r\n A_AXIS_RADIUS = 1737.4\r\n MAP_RESOLUTION = "
            "0.01\r\n CENTER_LONGITUDE = 0\r\n SAMPLE_PROJECTION_OFFSET = 3.5\r\n LINE_PROJECTION_OFFSET = "
            "1.5\r\n",
            "a map of 8 columns of which 3.6 are a full turn");
    // Radii where heights are expected, and the other way round.
    MapKeys keys;
    keys.file = pds3(folder.path(), cylindrical);
    keys.meaning = HeightMeaning::radius;
    MapFindings found;
    CHECK_THROWS_WITH(open_map(keys, moon, found),
                      ContainsSubstring("if these are heights, set values = \"height\""));
    keys.meaning = HeightMeaning::height;
    keys.scale_m = 1e5;
    CHECK_THROWS_WITH(open_map(keys, moon, found), ContainsSubstring("set values = \"radius\""));
    // A planet's map on a plane.
    keys.scale_m = 1;
    CHECK_THROWS_WITH(open_map(keys, SurfaceDomain::plane(10), found),
                      ContainsSubstring("a map of a planet on a plane"));
    keys.projection = ProjectionKind::planar;
    keys.left_m = -8;
    keys.top_m = 4;
    keys.pixel_m = 2;
    const HeightRaster map = open_map(keys, SurfaceDomain::plane(4), found);
    Raster::Reader reader(*map.raster);
    CHECK_THAT(map.offset_m + reader.at({-7, 3, 0}, 0), WithinAbs(0, 1e-9));
    CHECK_THAT(map.offset_m + reader.at({7, -3, 0}, 0), WithinAbs(31, 1e-9));
}

} // namespace map_source_test
