// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/georeference.hpp"

#include "core/error.hpp"
#include "core/units.hpp"
#include "terrain/maps/pds3_map.hpp"

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

/// Part of a pixel by which samples of a rounded label miss their place.
constexpr double same_sample = 0.02;

/// Samples by which the transform of a rounded label misses a turn or the poles over `samples`.
double rounded_samples(double samples) {
    return std::min(0.5, 1e-4 * samples);
}

/// A simple cylindrical map whose rows are parallels.
bool is_upright(const Georeference& place) {
    const terrain::PixelTransform& t = place.transform;
    return !place.foreign && place.projection.kind == ProjectionKind::simple_cylindrical &&
           std::isnormal(t[1]) && std::isnormal(t[5]) && std::isfinite(t[0]) && std::isfinite(t[3]) &&
           t[2] == 0 && t[4] == 0;
}

/// Sets the projection's spheroid: the longest axis and the third.
void set_radii(Projection& projection, Vec3 radii_m) {
    projection.equatorial_radius_m = std::max(radii_m.x, radii_m.y);
    projection.polar_radius_m = std::min(radii_m.z, projection.equatorial_radius_m);
}

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
    if (label != nullptr)
        place.radii_m = terrain::pds3_radii_m(*label);
    else if (map.semi_major_m > 0)
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

Georeference by_label(const GdalMap& map, const PdsLabel& label, const MapSettings& settings,
                      const std::string& name, MapRemarks& remarks) {
    const terrain::Pds3Place found = terrain::read_pds3_place(label, map.width, map.height, name,
                                                              {.radii_m = settings.radii_m,
                                                               .latitudes = settings.latitudes,
                                                               .west_positive = settings.west_positive,
                                                               .radius_hint = ": --radius says the body's",
                                                               .edges_hint = " (--edges says the place)"});
    for (const std::string& line : found.warnings)
        remarks.warn(line);
    for (const std::string& line : found.notes)
        remarks.note(line);
    Georeference place;
    place.projection = found.projection;
    place.transform = found.transform;
    place.registration = found.registration;
    place.radii_m = found.radii_m;
    place.foreign = found.foreign;
    return place;
}

} // namespace

void crop(Georeference& place, const std::string& name, MapRemarks& remarks) {
    if (!is_upright(place)) return;
    terrain::PixelTransform& t = place.transform;
    const double offset = place.registration == Registration::pixel ? 0.5 : 0;
    const double pole = std::numbers::pi / 2 * place.projection.equatorial_radius_m;
    const auto beyond = [&](std::int64_t row) {
        return std::abs(t[3] + (static_cast<double>(row) + offset) * t[5]) - pole >
               same_sample * std::abs(t[5]);
    };
    // Latitudes of rows are monotonic: rows from `first` to before `end` are within the poles.
    const double to_first = (std::copysign(pole, -t[5]) - t[3]) / t[5] - offset - same_sample,
                 to_last = (std::copysign(pole, t[5]) - t[3]) / t[5] - offset + same_sample;
    const auto rows = static_cast<double>(place.height);
    if (!(to_first <= rows - 1 && to_last >= 0))
        throw InputError(name + ": all its rows lie beyond a pole (--edges says where its samples are)");
    auto first = static_cast<std::int64_t>(std::ceil(std::max(to_first, 0.0)));
    auto end = static_cast<std::int64_t>(std::floor(std::min(to_last, rows - 1))) + 1;
    while (first < end && beyond(first)) // rounding
        ++first;
    while (first < end && beyond(end - 1))
        --end;
    if (first >= end)
        throw InputError(name + ": all its rows lie beyond a pole (--edges says where its samples are)");
    if (end - first < place.height) {
        remarks.warn(fmt::format("{}: {} of its rows lie beyond a pole: they are left out", name,
                                 place.height - (end - first)));
        t[3] += static_cast<double>(first) * t[5];
        place.first_row = first;
        place.height = end - first;
    }
    // One column more than a turn has is the first again.
    const double turn = std::abs(place.projection.turn_m() / t[1]);
    const auto columns = static_cast<double>(place.width);
    const bool whole = std::abs(turn - std::round(turn)) < std::max(2e-3, rounded_samples(columns));
    const double most = whole ? std::round(turn) + 1 : std::floor(turn);
    if (columns > most && columns > turn) {
        if (most < 1) throw InputError(name + ": one of its columns is more than a full turn");
        remarks.warn(
            fmt::format("{}: {} columns, of which {:.6g} are a full turn: the last {:.0f} are left out "
                        "(--edges says where its samples are)",
                        name, place.width, turn, columns - most));
        place.width = static_cast<std::int64_t>(most);
    }
}

void find_nodes(Georeference& place, const std::string& name, MapRemarks& remarks) {
    if (!is_upright(place) || place.registration == Registration::node) return;
    terrain::PixelTransform& t = place.transform;
    const double across = std::abs(place.projection.turn_m() / t[1]);
    const double pole = std::numbers::pi / 2 * place.projection.equatorial_radius_m;
    const double first = std::abs(t[3] + 0.5 * t[5]),
                 last = std::abs(t[3] + (static_cast<double>(place.height) - 0.5) * t[5]);
    const double near = same_sample * std::abs(t[5]);
    const bool at_poles = std::abs(first - pole) < near && std::abs(last - pole) < near;
    if (!at_poles && !(std::abs(static_cast<double>(place.width) - 1 - across) < same_sample)) return;
    place.registration = Registration::node;
    t[0] += 0.5 * t[1];
    t[3] += 0.5 * t[5];
    remarks.note(name + ": its outer samples lie at the poles or a turn apart: a grid of nodes");
}

void make_whole(Georeference& place, const std::string& name, MapRemarks& remarks) {
    if (!is_upright(place)) return;
    terrain::PixelTransform& t = place.transform;
    const double node = place.registration == Registration::node ? 1 : 0;
    const double columns = static_cast<double>(place.width) - node,
                 rows = static_cast<double>(place.height) - node;
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
    if (const double off = std::abs(std::abs(turn / t[1]) - columns);
        off < rounded_samples(columns) && off > 0) {
        const double middle = t[0] + t[1] * columns / 2;
        t[1] = std::copysign(turn / columns, t[1]);
        t[0] = middle - t[1] * columns / 2;
        moved = std::max(moved, off);
    }
    // The poles: both, or the edge that is near one.
    const double first = std::copysign(half_turn / 2, -t[5]);
    const double off = std::abs(std::abs(half_turn / t[5]) - rows);
    if (const double miss = std::abs((t[3] - first) / t[5]); off < rounded_samples(rows) && miss < 0.5) {
        moved = std::max({moved, off, miss});
        t[5] = -2 * first / rows;
        t[3] = first;
    } else
        for (const double pole : {half_turn / 2, -half_turn / 2})
            for (const double row : {0.0, rows}) {
                const double to_pole = (t[3] + t[5] * row - pole) / t[5];
                if (std::abs(to_pole) >= same_sample || to_pole == 0) continue;
                moved = std::max(moved, std::abs(to_pole));
                t[3] -= to_pole * t[5];
            }
    if (moved > 1e-3)
        remarks.note(fmt::format(
            "{}: the file's place is rounded: it was moved by up to {:.2g} pixels to whole degrees, turns and poles",
            name, moved));
}

Georeference georeference(const GdalMap& map, const PdsLabel* label, const MapSettings& settings,
                          const std::string& name, MapRemarks& remarks) {
    Georeference place;
    if (settings.edges_deg)
        place = by_edges(map, label, settings);
    else if (settings.planar_pixel_m)
        place = planar(map, settings, name);
    else if (label != nullptr && terrain::has_pds3_map(*label))
        place = by_label(map, *label, settings, name, remarks);
    else if (map.transform && map.system == GdalSystem::local)
        place = planar(map, settings, name);
    else if (map.transform && map.system != GdalSystem::none)
        place = by_system(map, settings, name);
    else
        throw InputError(fmt::format(
            "{}: it does not say where its samples are: --edges LEFT,RIGHT,TOP,BOTTOM says it in degrees, --planar METRES makes it a plane",
            name));
    if (settings.registration && *settings.registration != place.registration && !settings.edges_deg) {
        // The file's transform is that of its pixels' corners; the user says that it is that of samples, or
        // the other way round.
        place.registration = *settings.registration;
    }
    place.width = map.width;
    place.height = map.height;
    terrain::PixelTransform& t = place.transform;
    const bool turned = t[2] != 0 || t[4] != 0;
    if (turned && place.projection.kind == ProjectionKind::simple_cylindrical) place.foreign = true;
    find_nodes(place, name, remarks);
    crop(place, name, remarks);
    // What is said by hand is not rounded.
    if (!settings.edges_deg) make_whole(place, name, remarks);
    t[0] += settings.shift_columns * t[1] + settings.shift_rows * t[2];
    t[3] += settings.shift_columns * t[4] + settings.shift_rows * t[5];
    if (settings.shift_columns != 0 || settings.shift_rows != 0) place.by_system = false;
    return place;
}

} // namespace obscura::tools
