// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/georeference.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace obscura::tools {
namespace {

using images::PdsLabel;
using terrain::Latitudes;
using terrain::Projection;
using terrain::ProjectionKind;
using terrain::Registration;

constexpr double degree = std::numbers::pi / 180;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

bool contains(const std::string& text, std::string_view part) {
    return text.find(part) != std::string::npos;
}

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
    return text;
}

/// Sets the projection's spheroid: the longest axis and the third.
void set_radii(Projection& projection, Vec3 radii_m) {
    projection.equatorial_radius_m = std::max(radii_m.x, radii_m.y);
    projection.polar_radius_m = std::min(radii_m.z, projection.equatorial_radius_m);
}

/// Reads a map projection's number; "N/A" and other texts are none.
class ProjectionKeys {
public:
    explicit ProjectionKeys(const PdsLabel& label) : label_(label) {}

    [[nodiscard]] bool present() const { return label_.has(key("MAP_PROJECTION_TYPE")); }
    [[nodiscard]] std::string text(std::string_view name) const { return upper(label_.text(key(name), "")); }
    [[nodiscard]] double number(std::string_view name) const {
        if (!label_.has(key(name))) return none;
        const std::string value = label_.text(key(name), "");
        if (value.find_first_not_of("0123456789+-.eEdD") != std::string::npos || value.empty()) return none;
        return label_.number(key(name), none);
    }
    [[nodiscard]] std::string unit(std::string_view name) const { return label_.unit(key(name)); }
    /// A length in metres; without a unit it counts in `metres`.
    [[nodiscard]] double length(std::string_view name, double metres) const {
        const double value = number(name);
        if (std::isnan(value)) return none;
        const std::string unit_name = unit(name);
        if (unit_name.substr(0, 1) == "K") return value * 1000;
        return unit_name.substr(0, 1) == "M" ? value : value * metres;
    }

private:
    static std::string key(std::string_view name) { return "IMAGE_MAP_PROJECTION." + std::string(name); }
    const PdsLabel& label_;
};

/// Index, counted from 0, of the sample in the middle of the projection, as a label states it. Labels count
/// from 0 or from 1.
struct OriginChoice {
    double index = none;
    double misfit = none; ///< pixels to the edges that the label states
};

/// Chooses how to count `offset` so that the first edge lies at `edge` (in pixels from the projection's
/// origin, modulo `turn`); `edge` NaN: from 0 unless the origin is in the middle if it counts from 1.
OriginChoice origin_of(double offset, double edge, double turn, double samples) {
    if (std::isnan(edge))
        return {std::abs(offset - 1 - (samples - 1) / 2) < 1e-6 ? offset - 1 : offset, none};
    OriginChoice best;
    for (const double index : {offset, offset - 1, -offset, -offset - 1}) {
        const double difference = -index - 0.5 - edge;
        const double misfit = std::abs(turn > 0 ? std::remainder(difference, turn) : difference);
        if (std::isnan(best.misfit) || misfit < best.misfit - 1e-6) best = {index, misfit};
    }
    return best;
}

class LabelReader {
public:
    LabelReader(const GdalMap& map, const PdsLabel& label, const MapSettings& settings,
                const std::string& name, MapRemarks& remarks)
        : keys_(label),
          settings_(settings),
          name_(name),
          remarks_(remarks),
          columns_(map.width),
          rows_(map.height) {}

    Georeference read() {
        Georeference place;
        const double a = keys_.length("A_AXIS_RADIUS", 1000), b = keys_.length("B_AXIS_RADIUS", 1000),
                     c = keys_.length("C_AXIS_RADIUS", 1000);
        if (a > 0) place.radii_m = {a, b > 0 ? b : a, c > 0 ? c : a};
        const Vec3 radii = settings_.radii_m.value_or(place.radii_m);
        if (!(radii.x > 0))
            throw InputError(
                fmt::format("{}: the label has no A_AXIS_RADIUS: --radius says the body's", name_));
        // The map's own radii: another reference surface does not change where samples are.
        set_radii(place.projection, place.radii_m.x > 0 ? place.radii_m : radii);
        if (contains(keys_.text("COORDINATE_SYSTEM_NAME") + keys_.text("PROJECTION_LATITUDE_TYPE"),
                     "PLANETOGRAPHIC"))
            place.projection.latitudes = Latitudes::planetographic;
        if (settings_.latitudes) place.projection.latitudes = *settings_.latitudes;
        west_ = settings_.west_positive || keys_.text("POSITIVE_LONGITUDE_DIRECTION") == "WEST";
        const std::string type = keys_.text("MAP_PROJECTION_TYPE");
        if (contains(type, "POLAR") && contains(type, "STEREO"))
            polar(place);
        else if (contains(type, "CYLINDRICAL") || contains(type, "EQUIRECT") || contains(type, "EQUIDIST"))
            cylindrical(place);
        else
            place.foreign = true;
        return place;
    }

private:
    [[nodiscard]] double east(double longitude) const { return west_ ? -longitude : longitude; }

    /// Left and right, or top and bottom edge in degrees; what they are of.
    struct Axis {
        double first, last;                ///< edges that the label states
        double origin, offset;             ///< of the projection: degrees, pixels
        double pixels_per_degree, samples; ///< degrees grow with the index
        double turn;                       ///< pixels; 0: none
        std::string_view offset_name, edge_names;
    };
    struct Edge {
        double first_deg = 0; ///< of the outer edge of the first pixel, or of the first node
        bool node = false;
    };
    Edge edge_of(const Axis& axis) {
        const bool stated = std::isfinite(axis.first) && std::isfinite(axis.last);
        double span = stated ? (axis.last - axis.first) * axis.pixels_per_degree : none;
        // Of a turn labels say 0 and 360, -180 and 180, or 0 twice.
        if (stated && axis.turn > 0 && span < 0.5) span += axis.turn * std::ceil((0.5 - span) / axis.turn);
        if (stated && axis.turn > 0 && span > axis.turn + 1.5) span -= axis.turn;
        const bool offset_stated = std::isfinite(axis.offset) && std::isfinite(axis.origin);
        constexpr double exact = 0.05; // pixels; labels round degrees
        const bool is_pixels = std::abs(span - axis.samples) < exact;
        const bool is_nodes = std::abs(span - (axis.samples - 1)) < exact;
        if (is_pixels || is_nodes) {
            if (offset_stated) {
                const double shift = is_nodes ? 0.5 : 0;
                const OriginChoice origin =
                    origin_of(axis.offset, (axis.first - axis.origin) * axis.pixels_per_degree - shift,
                              axis.turn, axis.samples);
                if (origin.misfit > 0.26)
                    remarks_.warn(fmt::format(
                        "{}: {} {} is {:.3g} pixels off the edges that the label states ({}): the "
                        "edges are taken",
                        name_, axis.offset_name, axis.offset, origin.misfit, axis.edge_names));
            }
            return {axis.first, is_nodes};
        }
        if (!offset_stated)
            throw InputError(
                fmt::format("{}: the label does not say where the samples are: {} differ by {:.6g} pixels, "
                            "the image has {}, and {} is missing (--edges says it)",
                            name_, axis.edge_names, span, axis.samples, axis.offset_name));
        const double edge = stated ? (axis.first - axis.origin) * axis.pixels_per_degree : none;
        const OriginChoice origin = origin_of(axis.offset, edge, axis.turn, axis.samples);
        if (!stated)
            remarks_.warn(fmt::format("{}: the label has no {}: {} is taken to count from {}", name_,
                                      axis.edge_names, axis.offset_name,
                                      origin.index == axis.offset ? 0 : 1));
        else
            remarks_.warn(
                fmt::format("{}: {} differ by {:.6g} pixels, the image has {}: the place is by {} {}", name_,
                            axis.edge_names, span, axis.samples, axis.offset_name, axis.offset));
        return {axis.origin - (origin.index + 0.5) / axis.pixels_per_degree, false};
    }

    void cylindrical(Georeference& place) {
        Projection& p = place.projection;
        p.kind = ProjectionKind::simple_cylindrical;
        const double radius = p.equatorial_radius_m;
        // MAP_SCALE is rounded in many labels, MAP_RESOLUTION is not.
        double resolution = keys_.number("MAP_RESOLUTION");
        const double scale = keys_.length("MAP_SCALE", 1000);
        if (!(resolution > 0)) {
            if (!(scale > 0))
                throw InputError(
                    name_ + ": the label has neither MAP_RESOLUTION nor MAP_SCALE (--edges says the place)");
            resolution = radius * degree / scale;
            remarks_.note(fmt::format("{}: no MAP_RESOLUTION: {:.8g} pixels per degree by MAP_SCALE", name_,
                                      resolution));
        } else if (scale > 0) {
            const double off = std::abs(radius * degree / resolution / scale - 1) *
                               static_cast<double>(std::max(columns_, rows_));
            if (off > 0.01)
                remarks_.note(fmt::format(
                    "{}: MAP_SCALE is rounded, {:.2g} pixels over the map: MAP_RESOLUTION is taken", name_,
                    off));
        }
        // Pixels of a map with true scale at another parallel are as wide in metres there as they are high.
        double parallel = keys_.number("CENTER_LATITUDE");
        const std::string type = keys_.text("MAP_PROJECTION_TYPE");
        const bool scaled = contains(type, "EQUIRECT") && std::isfinite(parallel) && parallel != 0;
        const double across = scaled ? resolution * std::cos(parallel * degree) : resolution;
        if (!(across > 0))
            throw InputError(fmt::format("{}: CENTER_LATITUDE {} is out of range", name_, parallel));
        const double width = static_cast<double>(columns_), height = static_cast<double>(rows_);
        double left = east(keys_.number("WESTERNMOST_LONGITUDE")),
               right = east(keys_.number("EASTERNMOST_LONGITUDE"));
        const Edge x =
            edge_of({left, right, east(keys_.number("CENTER_LONGITUDE")),
                     keys_.number("SAMPLE_PROJECTION_OFFSET"), across, width, 360 * across,
                     "SAMPLE_PROJECTION_OFFSET", "WESTERNMOST_LONGITUDE and EASTERNMOST_LONGITUDE"});
        // Rows go south: degrees are counted downwards.
        const Edge y = edge_of({-keys_.number("MAXIMUM_LATITUDE"), -keys_.number("MINIMUM_LATITUDE"), 0,
                                keys_.number("LINE_PROJECTION_OFFSET"), resolution, height, 0,
                                "LINE_PROJECTION_OFFSET", "MAXIMUM_LATITUDE and MINIMUM_LATITUDE"});
        if (x.node != y.node) {
            // One axis says nodes: the other's edges are half a pixel further out.
            remarks_.warn(name_ + ": columns and rows are registered differently");
        }
        const bool node = x.node || y.node;
        const double step_x = radius * degree / across, step_y = radius * degree / resolution;
        place.registration = node ? Registration::node : Registration::pixel;
        const auto start = [&](const Edge& e, double step) {
            return radius * degree * e.first_deg + (node && !e.node ? 0.5 * step : 0);
        };
        place.transform = {start(x, step_x), step_x, 0, -start(y, step_y), 0, -step_y};
    }

    void polar(Georeference& place) {
        Projection& p = place.projection;
        const double centre = keys_.number("CENTER_LATITUDE");
        const double least = keys_.number("MINIMUM_LATITUDE"), most = keys_.number("MAXIMUM_LATITUDE");
        const bool south = centre < 0 || (!(std::abs(centre) > 0) && least + most < 0);
        p.kind =
            south ? ProjectionKind::south_polar_stereographic : ProjectionKind::north_polar_stereographic;
        p.true_scale_latitude_rad = (south ? -90 : 90) * degree;
        const double longitude = keys_.number("CENTER_LONGITUDE");
        p.centre_longitude_rad = std::isfinite(longitude) ? east(longitude) * degree : 0;
        double scale = keys_.length("MAP_SCALE", 1000);
        if (!(scale > 0)) scale = p.equatorial_radius_m * degree / keys_.number("MAP_RESOLUTION");
        const double line = keys_.number("LINE_PROJECTION_OFFSET"),
                     sample = keys_.number("SAMPLE_PROJECTION_OFFSET");
        if (!(scale > 0) || !std::isfinite(line) || !std::isfinite(sample))
            throw InputError(name_ + ": the label of a polar map needs MAP_SCALE, LINE_PROJECTION_OFFSET and "
                                     "SAMPLE_PROJECTION_OFFSET");
        const double i = origin_of(sample, none, 0, static_cast<double>(columns_)).index;
        const double j = origin_of(line, none, 0, static_cast<double>(rows_)).index;
        place.transform = {-(i + 0.5) * scale, scale, 0, (j + 0.5) * scale, 0, -scale};
    }

    ProjectionKeys keys_;
    const MapSettings& settings_;
    const std::string& name_;
    MapRemarks& remarks_;
    std::int64_t columns_, rows_;
    bool west_ = false;
};

double parameter(const GdalMap& map, std::string_view name, double otherwise) {
    for (const auto& [key, value] : map.parameters)
        if (key == name) return value;
    return otherwise;
}

Georeference by_system(const GdalMap& map, const MapSettings& settings, const std::string& name) {
    Georeference place;
    place.by_system = true;
    if (map.semi_major_m > 0)
        place.radii_m = {map.semi_major_m, map.semi_major_m,
                         map.semi_minor_m > 0 ? map.semi_minor_m : map.semi_major_m};
    const Vec3 radii = place.radii_m.x > 0 ? place.radii_m : settings.radii_m.value_or(Vec3{});
    if (!(radii.x > 0))
        throw InputError(name + ": its coordinate system has no radius: --radius says the body's");
    Projection& p = place.projection;
    set_radii(p, radii);
    p.latitudes =
        p.equatorial_radius_m != p.polar_radius_m ? Latitudes::planetographic : Latitudes::planetocentric;
    if (settings.latitudes) {
        p.latitudes = *settings.latitudes;
        place.by_system = false; // PROJ would take them for planetographic
    }
    place.transform = *map.transform;
    const auto scaled = [&](double x, double y) {
        for (std::size_t i = 0; i < 6; ++i)
            place.transform[i] *= i < 3 ? x : y;
    };
    if (map.system == GdalSystem::geographic) {
        const double to_metres = p.equatorial_radius_m * degree * map.degrees_per_unit;
        scaled(to_metres, to_metres);
        p.centre_longitude_rad = map.prime_meridian_deg * degree;
        return place;
    }
    scaled(map.metres_per_unit, map.metres_per_unit);
    place.transform[0] -= parameter(map, "false_easting", 0);
    place.transform[3] -= parameter(map, "false_northing", 0);
    p.centre_longitude_rad = (parameter(map, "central_meridian", 0) + map.prime_meridian_deg) * degree;
    const double origin = parameter(map, "latitude_of_origin", 0);
    if (map.method == "Equirectangular" || map.method == "Equidistant_Cylindrical" ||
        map.method == "Plate_Carree") {
        p.true_scale_latitude_rad = parameter(map, "standard_parallel_1", 0) * degree;
        place.transform[3] += p.equatorial_radius_m * origin * degree;
        return place;
    }
    const bool polar = map.method == "Polar_Stereographic";
    if (polar || (map.method == "Stereographic" && std::abs(std::abs(origin) - 90) < 1e-9)) {
        p.kind = origin < 0 ? ProjectionKind::south_polar_stereographic
                            : ProjectionKind::north_polar_stereographic;
        p.true_scale_latitude_rad = origin * degree;
        // A scale factor at the pole is the same as a smaller map.
        const double k = parameter(map, "scale_factor", 1);
        if (k > 0) scaled(1 / k, 1 / k);
        return place;
    }
    place.foreign = true;
    return place;
}

Georeference planar(const GdalMap& map, const MapSettings& settings, const std::string& name) {
    Georeference place;
    place.projection.kind = ProjectionKind::planar;
    if (settings.planar_pixel_m) {
        double step = *settings.planar_pixel_m;
        if (!(step > 0) && map.transform && map.system != GdalSystem::geographic)
            step = std::abs((*map.transform)[1]) * map.metres_per_unit;
        if (!(step > 0))
            throw InputError(name + ": it does not say the size of its pixels: --planar says it, in metres");
        place.transform = {-0.5 * step * static_cast<double>(map.width), step, 0,
                           0.5 * step * static_cast<double>(map.height), 0,    -step};
        return place;
    }
    place.transform = *map.transform;
    for (double& t : place.transform)
        t *= map.metres_per_unit;
    return place;
}

Georeference by_edges(const GdalMap& map, const PdsLabel* label, const MapSettings& settings) {
    Georeference place;
    if (label != nullptr) {
        const ProjectionKeys keys(*label);
        if (const double a = keys.length("A_AXIS_RADIUS", 1000), c = keys.length("C_AXIS_RADIUS", 1000);
            a > 0)
            place.radii_m = {a, a, c > 0 ? c : a};
    } else if (map.semi_major_m > 0)
        place.radii_m = {map.semi_major_m, map.semi_major_m,
                         map.semi_minor_m > 0 ? map.semi_minor_m : map.semi_major_m};
    const Vec3 radii = place.radii_m.x > 0 ? place.radii_m : settings.radii_m.value_or(Vec3{1, 1, 1});
    set_radii(place.projection, radii);
    place.projection.latitudes = settings.latitudes.value_or(Latitudes::planetocentric);
    place.registration = settings.registration.value_or(Registration::pixel);
    auto [left, right, top, bottom] = *settings.edges_deg;
    if (settings.west_positive) {
        left = -left;
        right = -right;
    }
    const auto frame =
        terrain::MapFrame::by_edges(place.projection, place.registration, map.width, map.height,
                                    left * degree, right * degree, top * degree, bottom * degree);
    place.projection = frame.projection();
    place.transform = frame.transform();
    return place;
}

} // namespace

void make_whole(Georeference& place, std::int64_t width, std::int64_t height, const std::string& name,
                MapRemarks& remarks) {
    if (place.foreign || place.projection.kind != ProjectionKind::simple_cylindrical) return;
    terrain::PixelTransform& t = place.transform;
    if (t[1] == 0 || t[5] == 0 || t[2] != 0 || t[4] != 0) return;
    if (place.registration == Registration::pixel) {
        // Grids of nodes come as pixels whose outer samples, not edges, lie at the poles or a turn apart.
        const double across = std::abs(place.projection.turn_m() / t[1]);
        const double pole = std::numbers::pi / 2 * place.projection.equatorial_radius_m;
        const double first = std::abs(t[3] + 0.5 * t[5]),
                     last = std::abs(t[3] + (static_cast<double>(height) - 0.5) * t[5]);
        const bool at_poles =
            std::abs(first - pole) < 0.02 * std::abs(t[5]) && std::abs(last - pole) < 0.02 * std::abs(t[5]);
        if (at_poles || std::abs(static_cast<double>(width) - 1 - across) < 0.02) {
            place.registration = Registration::node;
            t[0] += 0.5 * t[1];
            t[3] += 0.5 * t[5];
            remarks.note(name + ": its outer samples lie at the poles or a turn apart: a grid of nodes");
        }
    }
    const double node = place.registration == Registration::node ? 1 : 0;
    const double columns = static_cast<double>(width) - node, rows = static_cast<double>(height) - node;
    const double turn = place.projection.turn_m(),
                 half_turn = std::numbers::pi * place.projection.equatorial_radius_m;
    double moved = 0;
    // A whole number of pixels per degree, about the origin that the transform counts from.
    const double per_degree[2] = {std::abs(turn / 360 / t[1]), std::abs(half_turn / 180 / t[5])};
    for (int axis = 0; axis < 2; ++axis) {
        const double whole = std::round(per_degree[axis]);
        const double off = whole > 0 ? std::abs(per_degree[axis] / whole - 1) : 1;
        const double samples = axis == 0 ? columns : rows;
        if (off > 1e-5 || off * samples > 0.5 || off < 1e-14) continue;
        moved = std::max(moved, off * samples);
        const double ratio = per_degree[axis] / whole;
        t[axis == 0 ? 0 : 3] *= ratio;
        t[axis == 0 ? 1 : 5] *= ratio;
    }
    if (const double off = std::abs(std::abs(turn / t[1]) - columns); off < 0.5 && off > 0) {
        const double middle = t[0] + t[1] * columns / 2;
        t[1] = std::copysign(turn / columns, t[1]);
        t[0] = middle - t[1] * columns / 2;
        moved = std::max(moved, off);
    }
    // The poles: both, or the edge that is near one.
    if (const double off = std::abs(std::abs(half_turn / t[5]) - rows); off < 0.5) {
        const double first = std::copysign(half_turn / 2, -t[5]);
        moved = std::max({moved, off, std::abs((t[3] - first) / t[5])});
        t[5] = -2 * first / rows;
        t[3] = first;
    } else
        for (const double pole : {half_turn / 2, -half_turn / 2})
            for (const double row : {0.0, rows}) {
                const double miss = (t[3] + t[5] * row - pole) / t[5];
                if (std::abs(miss) >= 0.02 || miss == 0) continue;
                moved = std::max(moved, std::abs(miss));
                t[3] -= miss * t[5];
            }
    if (moved > 1e-3)
        remarks.note(fmt::format(
            "{}: the file's place is rounded: it was moved by up to {:.2g} pixels to whole degrees, "
            "turns and poles",
            name, moved));
}

Georeference georeference(const GdalMap& map, const PdsLabel* label, const MapSettings& settings,
                          const std::string& name, MapRemarks& remarks) {
    Georeference place;
    bool projected_label = false;
    if (label != nullptr) projected_label = ProjectionKeys(*label).present();
    if (settings.edges_deg)
        place = by_edges(map, label, settings);
    else if (settings.planar_pixel_m)
        place = planar(map, settings, name);
    else if (projected_label)
        place = LabelReader(map, *label, settings, name, remarks).read();
    else if (map.transform && map.system == GdalSystem::local)
        place = planar(map, settings, name);
    else if (map.transform && map.system != GdalSystem::none)
        place = by_system(map, settings, name);
    else
        throw InputError(
            fmt::format("{}: it does not say where its samples are: --edges LEFT,RIGHT,TOP,BOTTOM says it in "
                        "degrees, --planar METRES makes it a plane",
                        name));
    if (settings.registration && *settings.registration != place.registration && !settings.edges_deg) {
        // The file's transform is that of its pixels' corners; the user says that it is that of samples, or
        // the other way round.
        place.registration = *settings.registration;
    }
    if (!settings.planar_pixel_m && !place.foreign) make_whole(place, map.width, map.height, name, remarks);
    terrain::PixelTransform& t = place.transform;
    t[0] += settings.shift_columns * t[1] + settings.shift_rows * t[2];
    t[3] += settings.shift_columns * t[4] + settings.shift_rows * t[5];
    if (settings.shift_columns != 0 || settings.shift_rows != 0) place.by_system = false;
    return place;
}

} // namespace obscura::tools
