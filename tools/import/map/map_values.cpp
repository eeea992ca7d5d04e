// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/map_values.hpp"

#include "core/error.hpp"
#include "core/text/length_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::tools {
namespace {

using terrain::HeightMeaning;
using terrain::ObtKind;
using terrain::SampleType;

/// Whether all values may be distances from the centre of a body of about that radius; Eros: 0.37 to 2.1.
bool are_radii(double min_m, double largest_m, double radius_m) {
    return min_m > 0.3 * radius_m && largest_m < 2.2 * radius_m;
}

double mean(Vec3 radii) {
    return (radii.x + radii.y + radii.z) / 3;
}

class Heights {
public:
    Heights(const MapSource& map, const NumberProbe& probe, const MapSettings& settings, MapRemarks& remarks)
        : map_(map), probe_(probe), settings_(settings), remarks_(remarks) {}

    MapValues values(SampleType type) {
        MapValues out;
        const bool planar = map_.place().projection.kind == terrain::ProjectionKind::planar;
        if (!planar) out.semi_axes_m = reference();
        const double radius = planar ? 0 : mean(out.semi_axes_m);
        const double unit = unit_m(radius);
        out.unit = "m";
        out.meaning = settings_.meaning.value_or(planar ? HeightMeaning::height : guessed(unit, radius));
        if (planar && out.meaning != HeightMeaning::height)
            throw InputError(map_.name() + ": a planar map has heights only (--values height)");
        const MapNumbers& n = map_.numbers();
        out.scale = n.scale * unit;
        out.offset = n.offset * unit;
        const bool sphere = out.semi_axes_m.x == out.semi_axes_m.y && out.semi_axes_m.y == out.semi_axes_m.z;
        if (out.meaning == HeightMeaning::radius && sphere && !planar) {
            // Heights need fewer digits.
            out.meaning = HeightMeaning::height;
            out.offset -= radius;
            remarks_.note(
                fmt::format("{}: its values are radii: {:.10g} m was taken off", map_.name(), radius));
        }
        if (type == SampleType::f32) shift(out);
        check(out, radius);
        return out;
    }

private:
    [[nodiscard]] Vec3 reference() {
        const Vec3 own = map_.place().radii_m;
        if (!settings_.radii_m) {
            if (!(own.x > 0))
                throw InputError(
                    map_.name() +
                    ": it does not say the body's radius: heights count from --radius METRES or --radii A,B,C");
            return own;
        }
        const Vec3 radii = *settings_.radii_m;
        if (own.x > 0 && std::abs(mean(radii) / mean(own) - 1) > 1e-3)
            remarks_.warn(fmt::format(
                "{}: its body has a radius of {:.8g} m, --radius says {:.8g} m: is it another body?",
                map_.name(), mean(own), mean(radii)));
        return radii;
    }
    [[nodiscard]] double value(double number) const {
        return map_.numbers().offset + map_.numbers().scale * number;
    }

    [[nodiscard]] bool are_radii_in(double unit, double radius) const {
        const double a = value(probe_.least) * unit, b = value(probe_.largest) * unit;
        return probe_.any && are_radii(std::min(a, b), std::max(a, b), radius);
    }

    double unit_m(double radius) {
        const std::string& stated = map_.numbers().unit;
        const std::optional<double> known = metres_of_unit(stated);
        if (settings_.unit_m) {
            if (known && *known != *settings_.unit_m)
                remarks_.note(
                    fmt::format("{}: the file says {}: --unit goes before it", map_.name(), stated));
            return *settings_.unit_m;
        }
        if (known) return *known;
        const double unit = radius > 0 && are_radii_in(1000, radius) && !are_radii_in(1, radius) ? 1000 : 1;
        remarks_.note(fmt::format("{}: {}: {} are taken (--unit)", map_.name(),
                                  stated.empty() ? "no unit is stated"
                                                 : "unit \"" + one_line(stated) + "\" is not known",
                                  unit == 1 ? "metres" : "kilometres"));
        return unit;
    }
    HeightMeaning guessed(double unit, double radius) {
        if (are_radii_in(unit, radius)) return HeightMeaning::radius;
        const terrain::Projection& p = map_.place().projection;
        if (p.latitudes == terrain::Latitudes::planetographic && p.equatorial_radius_m != p.polar_radius_m)
            return HeightMeaning::normal;
        return HeightMeaning::height;
    }
    /// Numbers far from 0 lose digits as floats: their distance from a number near them does not.
    void shift(MapValues& out) const {
        if (!probe_.any) return;
        const double middle = 0.5 * (probe_.least + probe_.largest),
                     half = 0.5 * (probe_.largest - probe_.least);
        if (!(std::abs(middle) > 4 * half) || !(std::abs(middle) > 1)) return;
        // Shift to the number of height 0 if it is not far; else to the rounded middle.
        const double zero = -out.offset / out.scale;
        out.shift = std::abs(zero - middle) < 16 * half ? zero : std::round(middle);
        out.offset = out.shift == zero ? 0 : out.offset + out.scale * out.shift;
    }
    void check(const MapValues& out, double radius) {
        if (!probe_.any || !(radius > 0) || out.meaning == HeightMeaning::radius) return;
        const double least =
            out.offset + out.scale * ((out.scale > 0 ? probe_.least : probe_.largest) - out.shift);
        const double largest =
            out.offset + out.scale * ((out.scale > 0 ? probe_.largest : probe_.least) - out.shift);
        const std::string range =
            fmt::format("{}: heights from {:.6g} to {:.6g} m on a body of radius {:.6g} m", map_.name(),
                        least, largest, radius);
        if (least <= -radius)
            throw InputError(
                range +
                ": they go through its centre: another --unit (m, km), --radius or --values (height, radius) is wanted");
        if (largest - least > 0.6 * radius)
            remarks_.warn(range + ": were metres taken for kilometres? (--unit)");
        else if (largest - least < 1e-5 * radius && largest > least && covers_much())
            remarks_.warn(range + ": were kilometres taken for metres? (--unit)");
    }
    [[nodiscard]] bool covers_much() const {
        const Georeference& g = map_.place();
        return g.projection.kind == terrain::ProjectionKind::simple_cylindrical && !g.foreign &&
               std::abs(g.transform[5]) * static_cast<double>(map_.height()) >
                   0.2 * g.projection.equatorial_radius_m;
    }

    const MapSource& map_;
    const NumberProbe& probe_;
    const MapSettings& settings_;
    MapRemarks& remarks_;
};

} // namespace

MapValues map_values(const MapSource& map, const NumberProbe& probe, SampleType type,
                     const MapSettings& settings, MapRemarks& remarks) {
    if (settings.kind == ObtKind::heights) return Heights(map, probe, settings, remarks).values(type);
    MapValues out;
    const MapNumbers& n = map.numbers();
    out.scale = n.scale;
    out.offset = n.offset;
    out.unit = one_line(n.unit).substr(0, 31);
    out.semi_axes_m = settings.radii_m.value_or(map.place().radii_m);
    if (settings.kind != ObtKind::albedo) return out;
    out.unit.clear();
    const bool whole = n.type != GdalType::f32 && n.type != GdalType::f64;
    if (whole && !n.scaled) {
        const double full = n.type == GdalType::u8 || n.type == GdalType::i8 ? 255 : 65535;
        out.scale = 1 / full;
        out.offset = 0;
        remarks.note(fmt::format(
            "{}: numbers from 0 to {} without a scale: they become factors from 0 to 1, as shown on a screen and not calibrated (--scale)",
            map.name(), full));
    }
    if (probe.any &&
        (out.offset + out.scale * probe.largest > 1.5 || out.offset + out.scale * probe.least < -0.05))
        remarks.warn(fmt::format(
            "{}: factors of reflectance from {:.4g} to {:.4g}: 0 to 1 is usual (--scale, --offset)",
            map.name(), out.offset + out.scale * probe.least, out.offset + out.scale * probe.largest));
    return out;
}

MapType map_type(const MapNumbers& numbers, const std::string& driver, bool resampled, bool holes) {
    MapType out;
    switch (numbers.type) {
    case GdalType::u8:
        out.type = SampleType::u8;
        break;
    case GdalType::i8:
    case GdalType::i16:
        out.type = SampleType::i16;
        break;
    case GdalType::u16:
        out.type = SampleType::u16;
        break;
    default:
        out.type = SampleType::f32;
        break;
    }
    if (resampled) out.type = SampleType::f32;
    if (!holes || out.type == SampleType::f32) return out;
    // A number that no sample has: the file's own, one that ISIS keeps free, or one of a wider type.
    if (driver == "ISIS3" || driver == "ISIS2") {
        out.nodata = out.type == SampleType::i16 ? -32768 : 0;
    } else if (numbers.type == GdalType::u8 || numbers.type == GdalType::i8) {
        if (numbers.missing.size() == 1 && !numbers.masked && numbers.type == GdalType::u8)
            out.nodata = static_cast<std::int32_t>(numbers.missing.front());
        else {
            out.type = SampleType::i16;
            out.nodata = -32768;
        }
    } else if (!numbers.missing.empty() && !numbers.masked) {
        out.nodata = static_cast<std::int32_t>(numbers.missing.front());
    } else {
        out.type = SampleType::f32;
    }
    return out;
}

} // namespace obscura::tools
