// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura texture info`, `sample`, `check` and `export`: giant textures (.obt).
#include "tools/verbs/texture.hpp"

#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "terrain/geometry/map_frame.hpp"
#include "terrain/obt/obt_file.hpp"
#include "tools/check/report.hpp"
#include "tools/scene/map_tiff.hpp"
#include "tools/scene/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>

namespace obscura::tools {
namespace {

using namespace terrain;

constexpr double degrees = 180 / std::numbers::pi;

/// The value itself, as few digits as name it.
std::string number_text(double value) {
    return fmt::format("{:.7g}", value);
}

class TextureInfo final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints what a giant texture holds";
        line.description =
            "Prints the header of a giant texture (.obt): what its samples are, where they lie on the body, their range, the size of each level, the licence.";
        line.positional("FILE", &file_, "Giant texture");
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura texture info moon.obt", "obscura texture info moon.obt --json"};
    }

    int run() override {
        const ObtFile texture(file_);
        const ObtMetadata& m = texture.metadata();
        Report report;
        report.add("file", "file", file_);
        report.add("uuid", "uuid", uuid_text(m.uuid));
        report.add("title", "title", m.title);
        report.add("licence", "licence", m.licence);
        report.add("source", "source", m.source);
        report.add("kind", "kind", name_of(m.kind));
        report.add("type", "sample type", name_of(m.type));
        report.add("lattice", "steps by tile", m.lattice);
        report.add("unit", "unit", m.unit);
        report.add("scale", "scale", number_text(m.scale), m.scale);
        report.add("offset", "offset", fmt::format("{}", m.offset), m.offset);
        report.add("planes", "planes", std::int64_t{m.planes});
        report.add("rgb", "red, green, blue", m.rgb);
        report.add("width", "width", m.width);
        report.add("height", "height", m.height);
        report.add("levels", "levels", std::int64_t{texture.levels()});
        report.add("bytes", "size", bytes_text(texture.bytes()), static_cast<double>(texture.bytes()));
        report.add("registration", "registration", name_of(m.registration));
        const Projection& p = m.projection;
        report.add("projection", "projection", name_of(p.kind));
        if (p.kind != ProjectionKind::planar) {
            report.add("latitudes", "latitudes", name_of(p.latitudes));
            report.add("equatorial_radius_m", "equatorial radius", p.equatorial_radius_m, "m", 1);
            report.add("polar_radius_m", "polar radius", p.polar_radius_m, "m", 1);
            report.add("centre_longitude_deg", "centre longitude", p.centre_longitude_rad * degrees, "deg",
                       6);
            report.add("true_scale_latitude_deg", "latitude of true scale",
                       p.true_scale_latitude_rad * degrees, "deg", 6);
        }
        report.add("sample_m", "distance of samples on the map", std::hypot(m.transform[1], m.transform[4]),
                   "m", 3);
        std::string transform;
        for (const double t : m.transform)
            transform += fmt::format("{}{}", transform.empty() ? "" : ", ", t);
        report.add_line("transform", transform);
        report.add_object("transform", "[" + transform + "]");
        if (m.kind == ObtKind::heights)
            report.add("height_meaning", "heights are", name_of(m.height_meaning));
        std::string planes;
        for (std::uint32_t k = 0; k < m.planes; ++k) {
            const ObtPlaneStatistics s = texture.statistics(k);
            report.add_line(fmt::format("plane {}", k),
                            fmt::format("{} to {} {}, mean {}{}", number_text(s.least),
                                        number_text(s.largest), m.unit, number_text(s.mean),
                                        s.holes ? ", samples are missing" : ""));
            planes += fmt::format("{}{{\"least\": {}, \"largest\": {}, \"mean\": {}, \"holes\": {}}}",
                                  planes.empty() ? "" : ", ", s.least, s.largest, s.mean, s.holes);
        }
        report.add_object("plane_values", "[" + planes + "]");
        report.print(json_);
        return exit_ok;
    }

private:
    static std::string bytes_text(std::uint64_t bytes) {
        constexpr std::array units{"B", "kB", "MB", "GB", "TB"};
        auto value = static_cast<double>(bytes);
        std::size_t k = 0;
        for (; value >= 1000 && k + 1 < units.size(); ++k)
            value /= 1000;
        return fmt::format("{:.{}f} {}", value, k == 0 ? 0 : 1, units[k]);
    }

    std::string file_;
    bool json_ = false;
};

class TextureSample final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints the value of a giant texture at a place";
        line.description =
            "Prints the sample of a giant texture (.obt) that is nearest to a place, its column and row, and the value interpolated linearly between the four samples about the place. "
            "LAT and LON are the planetocentric latitude and the longitude in degrees, east positive.";
        line.positional("FILE", &file_, "Giant texture");
        line.positional("LAT", &first_, "Latitude, degrees; with --map: y; with --pixel: row");
        line.positional("LON", &second_, "Longitude, degrees; with --map: x; with --pixel: column");
        line.flag("--map", map_, "The place is y and x of the map, m");
        line.flag("--pixel", pixel_, "The place is row and column of the level");
        line.number("--level", &level_, "N", "Level: 0 is the finest, each further one has half the samples",
                    0, 40);
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura texture sample moon.obt -89.46 222.69",
                         "obscura texture sample site01.obt --map -- -3000 1250"};
    }

    int run() override {
        const ObtFile texture(file_);
        const ObtMetadata& m = texture.metadata();
        if (map_ && pixel_)
            throw host::UsageError("obscura texture sample: --map and --pixel exclude each other");
        if (level_ >= texture.levels())
            throw host::UsageError(fmt::format("obscura texture sample: --level {}: {} has levels 0 to {}",
                                               level_, file_, texture.levels() - 1));
        if (m.projection.kind == ProjectionKind::planar && !map_ && !pixel_)
            throw host::UsageError(fmt::format(
                "obscura texture sample: {} is planar: add --map, for y and x in m, or --pixel", file_));
        const MapFrame frame = m.frame();
        const SamplePlace place = place_in(frame);
        const double period = pixel_ ? 0 : frame.period() * std::ldexp(1.0, -level_);
        const auto column = inside(std::llround(place.x), texture.width(level_), period);
        const auto row = inside(std::llround(place.y), texture.height(level_), 0);
        if (!column || !row)
            throw InputError(
                fmt::format("{}: column {:.1f}, row {:.1f} of level {}: outside of its {} x {} samples",
                            file_, place.x, place.y, level_, texture.width(level_), texture.height(level_)));
        Report report;
        report.add("column", "column", *column);
        report.add("row", "row", *row);
        std::string list;
        for (std::uint32_t plane = 0; plane < m.planes; ++plane) {
            const auto sample = [&](std::int64_t x, std::int64_t y) {
                const auto i = inside(x, texture.width(level_), period);
                std::array<float, 1> value{};
                texture.read(plane, level_,
                             i.value_or(std::clamp<std::int64_t>(x, 0, texture.width(level_) - 1)),
                             std::clamp<std::int64_t>(y, 0, texture.height(level_) - 1), 1, 1, value);
                return static_cast<double>(value[0]);
            };
            const double nearest = sample(*column, *row);
            const double left = std::floor(place.x), top = std::floor(place.y);
            const auto x = static_cast<std::int64_t>(left), y = static_cast<std::int64_t>(top);
            const double fx = place.x - left, fy = place.y - top;
            const auto mix = [&](std::int64_t line) {
                return fx > 0 ? (1 - fx) * sample(x, line) + fx * sample(x + 1, line) : sample(x, line);
            };
            const double value = fy > 0 ? (1 - fy) * mix(y) + fy * mix(y + 1) : mix(y);
            const auto known = [](double v) { return std::isnan(v) ? std::nullopt : std::optional(v); };
            const std::string tail = m.planes > 1 ? fmt::format("_{}", plane) : "";
            const std::string of = m.planes > 1 ? fmt::format(" of plane {}", plane) : "";
            report.add("nearest" + tail, "nearest sample" + of, known(nearest), m.unit, 6);
            report.add("value" + tail, "interpolated" + of, known(value), m.unit, 6);
        }
        report.print(json_);
        return exit_ok;
    }

private:
    [[nodiscard]] SamplePlace place_in(const MapFrame& frame) const {
        if (pixel_) return {second_, first_};
        SamplePlace finest;
        const PixelTransform& t = frame.transform();
        if (map_) {
            const double determinant = t[1] * t[5] - t[2] * t[4], dx = second_ - t[0], dy = first_ - t[3];
            const double offset = frame.registration() == Registration::pixel ? 0.5 : 0;
            finest = {(dx * t[5] - dy * t[2]) / determinant - offset,
                      (dy * t[1] - dx * t[4]) / determinant - offset};
        } else {
            if (!(std::abs(first_) <= 90) || !(std::abs(second_) <= 360))
                throw host::UsageError(fmt::format(
                    "obscura texture sample: latitude {} and longitude {}: allowed are -90 to 90 and -360 to 360 degrees",
                    first_, second_));
            const double lat = first_ / degrees, lon = second_ / degrees;
            finest =
                frame.place({std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)});
        }
        const double factor = std::ldexp(1.0, -level_);
        const double offset = frame.registration() == Registration::pixel ? 0.5 : 0;
        return {(finest.x + offset) * factor - offset, (finest.y + offset) * factor - offset};
    }

    /// The sample of that number, a full turn on if need be.
    static std::optional<std::int64_t> inside(std::int64_t index, std::int64_t size, double period) {
        if (period > 0 && index < 0) index += std::llround(period);
        if (period > 0 && index >= size) index -= std::llround(period);
        return index >= 0 && index < size ? std::optional(index) : std::nullopt;
    }

    std::string file_;
    double first_ = 0, second_ = 0;
    std::int32_t level_ = 0;
    bool map_ = false, pixel_ = false, json_ = false;
};

class TextureCheck final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "reads a giant texture once and compares its checksums";
        line.description =
            "Reads all of a giant texture (.obt) and its shards and compares the checksums of header, directory and tiles, and the ranges of tiles with their samples. "
            "Prints what is damaged; the exit status is 1 then.";
        line.positional("FILE", &file_, "Giant texture");
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura texture check moon.obt"};
    }

    int run() override {
        const ObtFile texture(file_, 0);
        ObtCheck found;
        {
            std::optional<Progress> progress;
            found = texture.check([&](std::uint64_t done, std::uint64_t total) {
                if (!progress) progress.emplace("check", total);
                progress->done(done);
                return !host::interrupted();
            });
        }
        Report report;
        const auto count = [](std::uint64_t n) { return static_cast<std::int64_t>(n); };
        report.add("tiles", "tiles with samples", count(found.tiles));
        report.add("constant", "tiles of one number", count(found.constant));
        report.add("missing", "tiles without data", count(found.missing));
        report.add("wide", "tiles of f32 in a lattice", count(found.wide));
        report.add("blocks", "blocks of the directory", count(found.blocks));
        report.add("bytes", "bytes of samples", count(found.bytes));
        report.add("damaged", "damaged", count(found.damaged));
        report.print(json_);
        for (const std::string& line : found.findings)
            print_message(line);
        if (found.damaged > found.findings.size())
            print_message(fmt::format("{}: {} more", file_, found.damaged - found.findings.size()));
        if (found.interrupted) print_message(fmt::format("{}: interrupted: not all was read", file_));
        return found.damaged > 0 || found.interrupted ? exit_failure : exit_ok;
    }

private:
    std::string file_;
    bool json_ = false;
};

class TextureExport final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "writes a level of a giant texture as GeoTIFF";
        line.description =
            "Writes one level of a giant texture (.obt) with its projection as an uncompressed GeoTIFF file (BigTIFF above 2 GB), for other programs. "
            "Whole numbers that are their own values stay u8, i16 or u16; all others become 32-bit reals.";
        line.positional("FILE", &file_, "Giant texture");
        line.option("-o,--output", &output_, "TIFF", "File to write").required = true;
        line.number("--level", &level_, "N", "Level: 0 is the finest, each further one has half the samples",
                    0, 40);
        line.examples = {"obscura texture export moon.obt -o moon.tif",
                         "obscura texture export moon.obt --level 4 -o overview.tif"};
    }

    int run() override {
        const ObtFile texture(file_);
        if (level_ >= texture.levels())
            throw host::UsageError(fmt::format("obscura texture export: --level {}: {} has levels 0 to {}",
                                               level_, file_, texture.levels() - 1));
        Progress progress("export",
                          static_cast<std::uint64_t>(texture.height(level_)) * texture.metadata().planes);
        const bool whole = write_map_tiff(output_, texture, level_, [&](std::uint64_t rows) {
            progress.done(rows);
            return !host::interrupted();
        });
        if (!whole) print_message(fmt::format("{}: interrupted: not written", output_));
        return whole ? exit_ok : exit_failure;
    }

private:
    std::string file_, output_;
    std::int32_t level_ = 0;
};

} // namespace

std::unique_ptr<Verb> make_texture_info() {
    return std::make_unique<TextureInfo>();
}
std::unique_ptr<Verb> make_texture_sample() {
    return std::make_unique<TextureSample>();
}
std::unique_ptr<Verb> make_texture_check() {
    return std::make_unique<TextureCheck>();
}
std::unique_ptr<Verb> make_texture_export() {
    return std::make_unique<TextureExport>();
}

} // namespace obscura::tools
