// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/pds3_map.hpp"

#include "core/error.hpp"
#include "core/text/text.hpp"
#include "core/units.hpp"
#include "images/readers/pds_label.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::terrain {
namespace {

using images::PdsLabel;

constexpr double none = std::numeric_limits<double>::quiet_NaN();

bool contains(const std::string& text, std::string_view part) {
    return text.find(part) != std::string::npos;
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
    [[nodiscard]] std::string text(std::string_view name) const {
        return upper_case(label_.text(key(name), ""));
    }
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
    LabelReader(const PdsLabel& label, std::int64_t columns, std::int64_t rows, const std::string& name,
                const Pds3Overrides& overrides)
        : label_(label), keys_(label), overrides_(overrides), name_(name), columns_(columns), rows_(rows) {}

    Pds3Place read() {
        Pds3Place place;
        read(place);
        place.warnings = std::move(warnings_);
        place.notes = std::move(notes_);
        return place;
    }

private:
    void read(Pds3Place& place) {
        place.radii_m = pds3_radii_m(label_);
        const Vec3 radii = overrides_.radii_m.value_or(place.radii_m);
        if (!(radii.x > 0))
            throw InputError(
                fmt::format("{}: the label's map has no A_AXIS_RADIUS{}", name_, overrides_.radius_hint));
        // The map's own radii: another reference surface does not change where samples are.
        set_radii(place.projection, place.radii_m.x > 0 ? place.radii_m : radii);
        if (contains(keys_.text("COORDINATE_SYSTEM_NAME") + keys_.text("PROJECTION_LATITUDE_TYPE"),
                     "PLANETOGRAPHIC"))
            place.projection.latitudes = Latitudes::planetographic;
        if (overrides_.latitudes) place.projection.latitudes = *overrides_.latitudes;
        west_ = overrides_.west_positive || keys_.text("POSITIVE_LONGITUDE_DIRECTION") == "WEST";
        const std::string type = keys_.text("MAP_PROJECTION_TYPE");
        if (contains(type, "POLAR") && contains(type, "STEREO"))
            polar(place);
        else if (contains(type, "CYLINDRICAL") || contains(type, "EQUIRECT") || contains(type, "EQUIDIST"))
            cylindrical(place);
        else
            place.foreign = true;
    }

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
        // For a whole turn labels say 0 and 360, -180 and 180, or 0 twice.
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
                    warnings_.push_back(fmt::format(
                        "{}: {} {} is {:.3g} pixels off the edges that the label states ({}): the edges are taken",
                        name_, axis.offset_name, axis.offset, origin.misfit, axis.edge_names));
            }
            return {axis.first, is_nodes};
        }
        if (!offset_stated && !stated)
            throw InputError(
                fmt::format("{}: the label does not say where the samples are: it has neither {} nor {}{}",
                            name_, axis.edge_names, axis.offset_name, overrides_.edges_hint));
        if (!offset_stated)
            throw InputError(fmt::format(
                "{}: the label does not say where the samples are: {} differ by {:.6g} pixels, the image has {}, and {} is missing{}",
                name_, axis.edge_names, span, axis.samples, axis.offset_name, overrides_.edges_hint));
        const double edge = stated ? (axis.first - axis.origin) * axis.pixels_per_degree : none;
        const OriginChoice origin = origin_of(axis.offset, edge, axis.turn, axis.samples);
        if (!stated)
            (origin.index == axis.offset ? notes_ : warnings_)
                .push_back(fmt::format("{}: the label has no {}: {} is taken to count from {}", name_,
                                       axis.edge_names, axis.offset_name,
                                       origin.index == axis.offset ? 0 : 1));
        else
            warnings_.push_back(
                fmt::format("{}: {} differ by {:.6g} pixels, the image has {}: the place is by {} {}", name_,
                            axis.edge_names, span, axis.samples, axis.offset_name, axis.offset));
        return {axis.origin - (origin.index + 0.5) / axis.pixels_per_degree, false};
    }

    void cylindrical(Pds3Place& place) {
        Projection& p = place.projection;
        p.kind = ProjectionKind::simple_cylindrical;
        const double radius = p.equatorial_radius_m;
        // MAP_SCALE is rounded in many labels, MAP_RESOLUTION is not.
        double resolution = keys_.number("MAP_RESOLUTION");
        const double scale = keys_.length("MAP_SCALE", 1000);
        if (!(resolution > 0)) {
            if (!(scale > 0))
                throw InputError(fmt::format("{}: the label's map has neither MAP_RESOLUTION nor MAP_SCALE{}",
                                             name_, overrides_.edges_hint));
            resolution = radius * degree / scale;
            notes_.push_back(fmt::format("{}: no MAP_RESOLUTION: {:.8g} pixels per degree by MAP_SCALE",
                                         name_, resolution));
        } else if (scale > 0) {
            const double by_degree = radius * degree / resolution;
            const double share = std::abs(by_degree / scale - 1);
            const double off = share * static_cast<double>(std::max(columns_, rows_));
            if (share > 1e-3)
                warnings_.push_back(fmt::format(
                    "{}: MAP_SCALE {:.6g} m/pixel contradicts MAP_RESOLUTION, which makes {:.6g}; "
                    "MAP_RESOLUTION is taken",
                    name_, scale, by_degree));
            else if (off > 0.01)
                notes_.push_back(fmt::format(
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
            warnings_.push_back(name_ + ": columns and rows are registered differently");
        }
        const bool node = x.node || y.node;
        const double step_x = radius * degree / across, step_y = radius * degree / resolution;
        place.registration = node ? Registration::node : Registration::pixel;
        const auto start = [&](const Edge& e, double step) {
            return radius * degree * e.first_deg + (node && !e.node ? 0.5 * step : 0);
        };
        place.transform = {start(x, step_x), step_x, 0, -start(y, step_y), 0, -step_y};
    }

    void polar(Pds3Place& place) {
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
            throw InputError(
                name_ +
                ": the label of a polar map needs MAP_SCALE, LINE_PROJECTION_OFFSET and SAMPLE_PROJECTION_OFFSET");
        const double i = origin_of(sample, none, 0, static_cast<double>(columns_)).index;
        const double j = origin_of(line, none, 0, static_cast<double>(rows_)).index;
        place.transform = {-(i + 0.5) * scale, scale, 0, (j + 0.5) * scale, 0, -scale};
    }

    const PdsLabel& label_;
    ProjectionKeys keys_;
    const Pds3Overrides& overrides_;
    const std::string& name_;
    std::vector<std::string> warnings_, notes_;
    std::int64_t columns_, rows_;
    bool west_ = false;
};

} // namespace

bool has_pds3_map(const PdsLabel& label) {
    return ProjectionKeys(label).present();
}

Vec3 pds3_radii_m(const PdsLabel& label) {
    const ProjectionKeys keys(label);
    const double a = keys.length("A_AXIS_RADIUS", 1000), b = keys.length("B_AXIS_RADIUS", 1000),
                 c = keys.length("C_AXIS_RADIUS", 1000);
    return a > 0 ? Vec3{a, b > 0 ? b : a, c > 0 ? c : a} : Vec3{};
}

Pds3Place read_pds3_place(const PdsLabel& label, std::int64_t columns, std::int64_t rows,
                          const std::string& name, const Pds3Overrides& overrides) {
    return LabelReader(label, columns, rows, name, overrides).read();
}

} // namespace obscura::terrain
