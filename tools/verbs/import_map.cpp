// SPDX-License-Identifier: Apache-2.0
// Verb `obscura import map`: giant texture (.obt) from map files, read through GDAL in a helper process.
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "tools/check/report.hpp"
#include "tools/import/map/map_import.hpp"
#include "tools/scene/progress.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

namespace obscura::tools {
namespace {

using terrain::HeightMeaning;
using terrain::Latitudes;
using terrain::ObtKind;
using terrain::Registration;

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

/// Numbers separated by commas. Throws UsageError.
template<std::size_t N>
std::array<double, N> numbers_of(const std::string& text, std::string_view option, std::string_view wanted) {
    std::array<double, N> out{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (std::size_t i = 0; i < N; ++i) {
        const auto [next, error] = std::from_chars(at, end, out[i]);
        const bool separated = i + 1 < N ? next != end && *next == ',' : next == end;
        if (error != std::errc{} || !separated || !std::isfinite(out[i]))
            throw host::UsageError(
                fmt::format("obscura import map: {} \"{}\": wanted {}", option, text.substr(0, 60), wanted));
        at = next + 1;
    }
    return out;
}

template<typename Enum>
void name_choices(host::Option& option) {
    const std::vector<std::string_view> names = names_of_enum<Enum>();
    option.choices.assign(names.begin(), names.end());
}

std::optional<double> given(double value) {
    return std::isnan(value) ? std::nullopt : std::optional(value);
}

class ImportMap final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "makes a giant texture (.obt) from maps of heights or albedo";
        line.description =
            "Reads maps (PDS3, PDS4, ISIS cubes, GeoTIFF, JPEG 2000, PNG, JPEG, FITS, ENVI, VRT) through GDAL, in a process of its own (Debian's package obscura-gdal), and writes one texture with all its levels of detail. "
            "Of PDS files name the label (.lbl, .xml) or the data beside it. "
            "Samples are copied as they are, in the file's own projection: simple cylindrical, polar stereographic or a plane; "
            "other projections are resampled. "
            "Several maps of one grid are put together; where they overlap the first counts. "
            "Numbers become values by the label's scale and offset; radii become heights. "
            "What the labels leave open or have wrong is said in the options. "
            "An interrupted import goes on when it is started again.";
        line.positional("FILE", &task_.files, "Maps, the one that goes before the others first");
        line.option("-o,--output", &output_, "FILE", "Texture to write (.obt)").required = true;
        line.flag("--height", height_, "Heights or radii (the default)");
        line.flag("--albedo", albedo_,
                  "Factors of the reflectance; files of three or four bands are red, green and blue");
        line.option("--parameter", &task_.settings.parameter, "NAME",
                    "Another quantity: a parameter of a material");
        line.number("--band", &band_, "N", "Band of the files, counted from 1", 1, 64);
        line.option("--unit", &unit_, "UNIT", "Unit of heights (default: by the label)").choices = {"m",
                                                                                                    "km"};
        line.number("--radius", &radius_, "M",
                    "Radius in metres of the sphere from which heights count (default: the label's)", 1e-3,
                    1e12);
        line.option("--radii", &radii_, "A,B,C",
                    "Semi-axes in metres of the ellipsoid from which heights count");
        name_choices<HeightMeaning>(line.option(
            "--values", &values_, "KIND",
            "What heights are: along the radius, along the normal of the ellipsoid, or distances from the centre (default: as they look)"));
        line.option(
            "--edges", &edges_, "L,R,T,B",
            "Degrees of the left, right, top and bottom edge of a simple cylindrical map, in place of what the file says: --edges=-180,180,90,-90");
        line.flag("--west-positive", task_.settings.west_positive,
                  "Longitudes of labels and of --edges grow westwards");
        name_choices<Latitudes>(
            line.option("--latitudes", &latitudes_, "KIND", "What latitudes are (default: by the label)"));
        name_choices<Registration>(
            line.option("--registration", &registration_, "KIND",
                        "What the file's places are of: edges of pixels, or nodes, the samples themselves"));
        line.option("--shift", &shift_, "X,Y",
                    "Moves all samples by so many pixels to the right and down: --shift=0,-1");
        line.number(
            "--planar", &planar_, "M",
            "A plane with pixels of M metres and its middle at the origin; 0: pixels as the file says", 0,
            1e9);
        line.number("--scale", &scale_, "S", "Value = offset + scale * number (default: the label's)", -1e30,
                    1e30);
        line.number("--offset", &offset_, "O", "See --scale", -1e30, 1e30);
        line.number("--nodata", &nodata_, "N", "Number of missing samples (default: the label's)", -1e300,
                    1e300);
        line.option("--fill", &fill_, "HOW",
                    "Fill missing samples: smoothly, from those around (default: they stay missing)")
            .choices = {"gaussian"};
        line.option("--mask", &mask_, "FILE",
                    "Writes a texture (.obt) that is 1 where a sample was missing, else 0");
        line.option("--title", &task_.title, "TEXT", "Title of the texture (default: its name)");
        line.option("--licence", &task_.licence, "TEXT", "Licence of the data, for the texture's header");
        line.flag("--restart", task_.restart, "Begin anew what was interrupted");
        line.number("--time-limit", &time_limit_s_, "S",
                    "Seconds that the helper process may take for a block", 0.1, 1e6);
        line.number("--helper-memory", &memory_mib_, "MIB", "Addresses that the helper process may use", 64,
                    1 << 20);
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura import map LDEM_16.LBL -o moon.obt",
            "obscura import map mars_45n.lbl mars_45s.lbl -o mars.obt --fill gaussian --mask holes.obt",
            "obscura import map io.png -o io.obt --albedo --edges=0,360,90,-90",
            "obscura import map mdim21.tif -o mars-albedo.obt --albedo --scale 0.0012",
            "obscura import map valley.tif -o valley.obt --planar 0",
        };
    }

    [[nodiscard]] bool keeps_work() const override { return true; }

    int run() override {
        settle();
        std::unique_ptr<Progress> shown;
        std::string step;
        MapImportReport report =
            import_map(task_, [&](const std::string& name, std::uint64_t done, std::uint64_t total) {
                if (name != step) {
                    shown = nullptr;
                    shown = std::make_unique<Progress>("import map: " + name, total);
                    step = name;
                }
                shown->done(done);
                return !host::interrupted();
            });
        shown = nullptr;
        for (const std::string& warning : report.remarks.warnings())
            print_message(fmt::format("warning: {}", warning));
        if (!report.written.finished)
            throw Error(exit_failure, fmt::format("{}: interrupted: the same command goes on", output_));
        print(report);
        return exit_ok;
    }

private:
    void settle() {
        MapSettings& s = task_.settings;
        const int kinds = (height_ ? 1 : 0) + (albedo_ ? 1 : 0) + (s.parameter.empty() ? 0 : 1);
        if (kinds > 1)
            throw host::UsageError(
                "obscura import map: only one of --height, --albedo and --parameter is allowed");
        s.kind = albedo_ ? ObtKind::albedo : s.parameter.empty() ? ObtKind::heights : ObtKind::parameter;
        if (s.kind != ObtKind::heights && (!unit_.empty() || !values_.empty()))
            throw host::UsageError("obscura import map: --unit and --values are of heights only");
        if (band_ > 0) s.band = band_;
        if (!unit_.empty()) s.unit_m = unit_ == "km" ? 1000 : 1;
        if (!std::isnan(radius_)) s.radii_m = Vec3{radius_, radius_, radius_};
        if (!radii_.empty()) {
            const auto [a, b, c] =
                numbers_of<3>(radii_, "--radii", "three lengths in metres: 3396190,3396190,3376200");
            if (!std::isnan(radius_))
                throw host::UsageError("obscura import map: only one of --radius and --radii is allowed");
            if (!(a > 0 && b > 0 && c > 0))
                throw host::UsageError("obscura import map: --radii: lengths above 0 are wanted");
            s.radii_m = Vec3{a, b, c};
        }
        s.meaning = enum_named<HeightMeaning>(values_);
        if (!edges_.empty())
            s.edges_deg = numbers_of<4>(edges_, "--edges", "four angles in degrees: 0,360,90,-90");
        s.latitudes = enum_named<Latitudes>(latitudes_);
        s.registration = enum_named<Registration>(registration_);
        if (!shift_.empty()) {
            const auto [x, y] = numbers_of<2>(shift_, "--shift", "two numbers of pixels: 0.5,-1");
            s.shift_columns = x;
            s.shift_rows = y;
        }
        s.planar_pixel_m = given(planar_);
        if (s.planar_pixel_m && s.edges_deg)
            throw host::UsageError("obscura import map: only one of --planar and --edges is allowed");
        s.scale = given(scale_);
        s.offset = given(offset_);
        s.nodata = given(nodata_);
        task_.output = output_;
        task_.mask = mask_;
        task_.fill = !fill_.empty();
        task_.limits.answer = std::chrono::milliseconds(std::llround(time_limit_s_ * 1000));
        task_.limits.memory_bytes = std::uint64_t{memory_mib_} << 20;
    }

    void print(const MapImportReport& report) const {
        const terrain::ObtMetadata& m = report.written.metadata;
        Report out;
        out.add("output", "written", std::string_view(output_));
        out.add("kind", "kind", name_of(m.kind));
        out.add("width", "columns", m.width);
        out.add("height", "rows", m.height);
        out.add("planes", "planes", std::int64_t{m.planes});
        out.add("source_type", "samples of the files", std::string_view(report.type));
        out.add("type", "samples of the texture", name_of(m.type));
        out.add("projection", "projection", name_of(m.projection.kind));
        out.add("registration", "registration", name_of(m.registration));
        out.add("latitudes", "latitudes", name_of(m.projection.latitudes));
        if (m.kind == ObtKind::heights) out.add("values", "values", name_of(m.height_meaning));
        out.add("unit", "unit", std::string_view(m.unit));
        out.add("scale", "scale", fmt::format("{:.10g}", m.scale), m.scale);
        out.add("offset", "offset", fmt::format("{:.10g}", m.offset), m.offset);
        if (m.semi_axes_m.x > 0)
            out.add("radius_m", "radius", fmt::format("{:.10g} m", m.semi_axes_m.x), m.semi_axes_m.x);
        if (!m.statistics.empty()) {
            const terrain::ObtPlaneStatistics& s = m.statistics.front();
            out.add("least", "smallest value", fmt::format("{:.7g}", s.least), s.least);
            out.add("largest", "largest value", fmt::format("{:.7g}", s.largest), s.largest);
            out.add("mean", "mean value", fmt::format("{:.7g}", s.mean), s.mean);
        }
        if (report.missing_known)
            out.add("missing", "missing samples", static_cast<std::int64_t>(report.missing));
        else
            out.add("missing", "missing samples", std::nullopt, "", 0);
        out.add("filled", "of these filled", static_cast<std::int64_t>(report.filled));
        out.add("tiles", "tiles", static_cast<std::int64_t>(report.written.tiles));
        out.add("resumed_tiles", "of an earlier run", static_cast<std::int64_t>(report.written.resumed));
        out.add("bytes", "bytes", static_cast<std::int64_t>(report.written.bytes));
        out.add("seconds", "time", report.seconds, "s", 2);
        out.add("mb_per_s", "read",
                static_cast<double>(report.source_bytes) * 1e-6 / std::max(report.seconds, 1e-3), "MB/s", 1);
        for (const std::string& note : report.remarks.notes())
            out.add_line("note", note);
        out.add_object("notes", nlohmann::json(report.remarks.notes())
                                    .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
        out.add_object("warnings", nlohmann::json(report.remarks.warnings())
                                       .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
        out.print(json_);
    }

    MapImportTask task_;
    std::string output_, unit_, radii_, values_, edges_, latitudes_, registration_, shift_, fill_, mask_;
    std::uint32_t band_ = 0;
    double radius_ = no_value, planar_ = no_value, scale_ = no_value, offset_ = no_value, nodata_ = no_value;
    double time_limit_s_ = 120;
    std::uint32_t memory_mib_ = 4096;
    bool height_ = false, albedo_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_import_map() {
    return std::make_unique<ImportMap>();
}

} // namespace obscura::tools
