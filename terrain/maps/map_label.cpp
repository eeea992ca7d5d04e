// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/input_file.hpp"
#include "core/text/length_unit.hpp"
#include "core/text/text.hpp"
#include "core/units.hpp"
#include "images/readers/geo_tiff.hpp"
#include "images/readers/pds3_layout.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/maps/pds3_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace obscura::terrain {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
    throw InputError(fmt::format("{}: {}", file.string(), what));
}

// PDS3, with the data elements of the Planetary Science Data Dictionary.

MapLabel read_pds3(const std::filesystem::path& file, std::int64_t width, std::int64_t height) {
    const images::PdsLabel label(file);
    MapLabel map;
    const images::PdsNumbers numbers = images::pds3_values(label);
    map.scale_m = metres_of_unit(numbers.unit).value_or(1);
    map.number_scale = numbers.scale;
    map.number_offset = numbers.offset;
    map.states_scale = !numbers.unit.empty() || numbers.scale != 1 || numbers.offset != 0;
    const double radius = pds3_radii_m(label).x;
    const double offset = numbers.offset * map.scale_m;
    // With the reference radius as OFFSET the numbers are distances from the centre.
    if (radius > 0) map.meaning = offset > 0.5 * radius ? HeightMeaning::radius : HeightMeaning::height;
    if (!has_pds3_map(label)) return map;
    constexpr std::string_view hint = "; give `projection` and its keys";
    const Pds3Place place =
        read_pds3_place(label, width, height, file.string(), {.radius_hint = hint, .edges_hint = hint});
    if (place.foreign)
        refuse(
            file,
            fmt::format(
                "a map in {} projection, allowed are SIMPLE CYLINDRICAL, EQUIRECTANGULAR and POLAR STEREOGRAPHIC; "
                "`obscura import map` reads others",
                upper_case(label.text("IMAGE_MAP_PROJECTION.MAP_PROJECTION_TYPE")).substr(0, 60)));
    map.projection = place.projection;
    map.transform = place.transform;
    map.registration = place.registration;
    map.warnings = place.warnings;
    return map;
}

bool is_pds3(const std::filesystem::path& file) {
    const InputFile in = open_input(file);
    std::array<char, 512> bytes{};
    const std::string_view start(bytes.data(), std::fread(bytes.data(), 1, bytes.size(), in.get()));
    return start.find("PDS_VERSION_ID") != std::string_view::npos;
}

// GeoTIFF 1.1 (OGC 19-008): numbers of keys and of their values.
enum GeoKey : std::uint16_t {
    model_type = 1024,
    raster_type = 1025,
    angular_units = 2054,
    semi_major_axis = 2057,
    semi_minor_axis = 2058,
    inverse_flattening = 2059,
    coordinate_transformation = 3075,
    linear_units = 3076,
    first_standard_parallel = 3078,
    natural_origin_longitude = 3080,
    natural_origin_latitude = 3081,
    false_easting = 3082,
    false_northing = 3083,
    centre_longitude = 3088,
    centre_latitude = 3089,
    scale_at_natural_origin = 3092,
    vertical_pole_longitude = 3095,
};
constexpr int model_projected = 1, model_geographic = 2, raster_is_point = 2;
constexpr int polar_stereographic = 15, equirectangular = 17;
constexpr int unit_metre = 9001, unit_radian = 9101, unit_degree = 9102;

class GeoTiffMap {
public:
    explicit GeoTiffMap(const std::filesystem::path& file)
        : file_(file), tags_(images::read_geo_tiff(file)) {}

    MapLabel read() {
        MapLabel map;
        map.scale_m = tags_.scale.value_or(1);
        map.offset_m = tags_.offset.value_or(0);
        map.states_scale = tags_.scale || tags_.offset || !tags_.unit.empty();
        const double unit_m = metres_of_unit(tags_.unit).value_or(1);
        map.scale_m *= unit_m;
        map.offset_m *= unit_m;
        const bool placed = !tags_.transformation.empty() || !tags_.pixel_scale.empty();
        const int model = whole(model_type);
        if (!placed || (model != model_projected && model != model_geographic)) return map;
        PixelTransform t = transform();
        Projection p;
        p.equatorial_radius_m = value(semi_major_axis, 0);
        if (!(p.equatorial_radius_m > 0))
            refuse(file_, "a GeoTIFF whose system is a number of a list (EPSG) rather than its own spheroid; "
                          "give `projection` and its keys, or use `obscura import map`");
        const double flattening = value(inverse_flattening, 0);
        p.polar_radius_m =
            value(semi_minor_axis,
                  flattening > 0 ? p.equatorial_radius_m * (1 - 1 / flattening) : p.equatorial_radius_m);
        // Latitudes of a spheroid are geodetic in GeoTIFF.
        if (p.polar_radius_m != p.equatorial_radius_m) p.latitudes = Latitudes::planetographic;
        const double angle = whole(angular_units) == unit_radian ? 1 : degree;
        if (model == model_geographic) {
            const double metres = p.equatorial_radius_m * angle;
            for (double& v : t)
                v *= metres;
        } else {
            projected(p, t, angle);
        }
        map.projection = p;
        map.transform = t;
        return map;
    }

private:
    [[nodiscard]] double value(std::uint16_t key, double fallback) const {
        const auto found = tags_.keys.find(key);
        return found == tags_.keys.end() ? fallback : found->second;
    }
    [[nodiscard]] int whole(std::uint16_t key) const {
        const double v = value(key, 0);
        return v >= 0 && v < 65536 ? static_cast<int>(v) : 0;
    }
    /// From the outer corner of the first pixel.
    [[nodiscard]] PixelTransform transform() const {
        PixelTransform t{};
        const std::vector<double>& m = tags_.transformation;
        const std::vector<double>& scale = tags_.pixel_scale;
        const std::vector<double>& tie = tags_.tie_points;
        if (m.size() >= 16) {
            t = {m[3], m[0], m[1], m[7], m[4], m[5]};
        } else if (scale.size() >= 2 && tie.size() >= 6) {
            t = {tie[3] - tie[0] * scale[0], scale[0], 0, tie[4] + tie[1] * scale[1], 0, -scale[1]};
        } else {
            refuse(file_, "a GeoTIFF placed by several tie points, which cannot be used; "
                          "`obscura import map` reads it");
        }
        if (whole(raster_type) == raster_is_point) { // the tie point is the middle of its pixel
            t[0] -= 0.5 * (t[1] + t[2]);
            t[3] -= 0.5 * (t[4] + t[5]);
        }
        return t;
    }
    void projected(Projection& p, PixelTransform& t, double angle) const {
        const int units = whole(linear_units);
        if (units != 0 && units != unit_metre)
            refuse(file_, fmt::format("a GeoTIFF in units {}, allowed are metres", units));
        t[0] -= value(false_easting, 0);
        t[3] -= value(false_northing, 0);
        if (whole(coordinate_transformation) == equirectangular) {
            p.kind = ProjectionKind::simple_cylindrical;
            p.centre_longitude_rad = value(centre_longitude, value(natural_origin_longitude, 0)) * angle;
            p.true_scale_latitude_rad = value(first_standard_parallel, 0) * angle;
            const double origin = value(centre_latitude, value(natural_origin_latitude, 0)) * angle;
            t[3] += p.equatorial_radius_m * origin;
            return;
        }
        if (whole(coordinate_transformation) != polar_stereographic)
            refuse(
                file_,
                fmt::format(
                    "a GeoTIFF in projection {}, allowed are equirectangular ({}) and polar stereographic ({}); "
                    "`obscura import map` reads others",
                    whole(coordinate_transformation), equirectangular, polar_stereographic));
        const double origin = value(natural_origin_latitude, 90) * angle;
        p.kind = origin < 0 ? ProjectionKind::south_polar_stereographic
                            : ProjectionKind::north_polar_stereographic;
        p.centre_longitude_rad = value(vertical_pole_longitude, value(natural_origin_longitude, 0)) * angle;
        p.true_scale_latitude_rad = origin;
        // Variant A: a scale at the pole itself.
        const double k = value(scale_at_natural_origin, 1);
        if (!(k > 0)) refuse(file_, "a GeoTIFF whose scale at the pole is not above 0");
        for (double& v : t)
            v /= k;
    }

    const std::filesystem::path& file_;
    images::GeoTiff tags_;
};

} // namespace

MapLabel read_map_label(const std::filesystem::path& file, std::int64_t width, std::int64_t height) {
    if (is_pds3(file)) return read_pds3(file, width, height);
    if (images::is_tiff(file)) return GeoTiffMap(file).read();
    return {};
}

} // namespace obscura::terrain
