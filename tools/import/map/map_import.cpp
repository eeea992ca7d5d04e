// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/map_import.hpp"

#include "core/error.hpp"
#include "tools/import/map/hole_filler.hpp"
#include "tools/import/map/map_mosaic.hpp"
#include "tools/import/map/map_values.hpp"
#include "tools/import/map/read_ahead.hpp"
#include "tools/import/map/resampled_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

namespace obscura::tools {
namespace {

using terrain::ObtKind;
using terrain::SampleType;

/// Rows that are looked at before the import.
constexpr std::int64_t probe_rows = 24;
constexpr std::int64_t probe_columns = 4096;

NumberProbe probe(std::vector<std::unique_ptr<MapSource>>& maps) {
    std::vector<float> numbers, row;
    const std::int64_t each = std::max<std::int64_t>(1, probe_rows / static_cast<std::int64_t>(maps.size()));
    for (const auto& map : maps)
        for (std::int64_t i = 0; i < each; ++i) {
            const std::int64_t columns = std::min(map->width(), probe_columns);
            const std::int64_t y = (2 * i + 1) * map->height() / (2 * each);
            const std::int64_t x = (map->width() - columns) * i / each;
            row.resize(static_cast<std::size_t>(columns));
            map->read(0, x, y, static_cast<int>(columns), 1, row);
            std::copy_if(row.begin(), row.end(), std::back_inserter(numbers),
                         [](float v) { return std::isfinite(v); });
        }
    NumberProbe out;
    if (numbers.empty()) return out;
    const auto [least, largest] = std::minmax_element(numbers.begin(), numbers.end());
    out = {static_cast<double>(*least), static_cast<double>(*largest), true};
    return out;
}

/// Finest samples for the writer, looked at as they pass.
class CountedSource final : public terrain::ObtSource {
public:
    explicit CountedSource(RasterReader& raster) : raster_(raster) {}

    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override {
        raster_.read(plane, x, y, columns, rows, out);
        float least = least_, largest = largest_;
        std::uint64_t missing = 0;
        for (const float v : out) {
            missing += std::isnan(v) ? 1U : 0U;
            least = v < least ? v : least;
            largest = v > largest ? v : largest;
        }
        least_ = least;
        largest_ = largest;
        missing_ += missing;
    }
    [[nodiscard]] bool by_rows() const override { return raster_.by_rows(); }
    [[nodiscard]] float least() const { return least_; }
    [[nodiscard]] float largest() const { return largest_; }
    [[nodiscard]] std::uint64_t missing() const { return missing_; }

private:
    RasterReader& raster_;
    float least_ = std::numeric_limits<float>::infinity(), largest_ = -std::numeric_limits<float>::infinity();
    std::uint64_t missing_ = 0;
};

/// 1 where a sample is missing, else 0.
class MaskSource final : public terrain::ObtSource {
public:
    explicit MaskSource(RasterReader& raster) : raster_(raster) {}
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override {
        raster_.read(plane, x, y, columns, rows, out);
        for (float& v : out)
            v = std::isnan(v) ? 1.F : 0.F;
    }
    [[nodiscard]] bool by_rows() const override { return raster_.by_rows(); }

private:
    RasterReader& raster_;
};

/// Whether what an earlier run left is of the files as they are now.
bool still_current(const MapImportTask& task) {
    std::error_code error;
    const auto left = std::filesystem::last_write_time(task.output.string() + ".part", error);
    if (error) return true;
    return std::none_of(task.files.begin(), task.files.end(), [&](const std::string& file) {
        std::error_code unknown;
        const auto changed = std::filesystem::last_write_time(file, unknown);
        return !unknown && changed > left;
    });
}

std::string source_text(const std::vector<std::string>& files) {
    std::string names;
    for (const std::string& file : files) {
        const std::string name = std::filesystem::path(file).filename().string();
        if (names.size() + name.size() > 480) return names + ", ...";
        names += (names.empty() ? "" : ", ") + name;
    }
    return one_line(names);
}

void compare_with_label(const MapSource& map, const MapImportReport& report, MapRemarks& remarks) {
    const MapNumbers& n = map.numbers();
    for (const auto& [key, stated, found] : {std::tuple{"MINIMUM", n.stated_least, report.min_number},
                                             {"MAXIMUM", n.stated_largest, report.largest_number}}) {
        if (!stated || !std::isfinite(found)) continue;
        // Labels state numbers or values.
        const double value = n.offset + n.scale * found;
        const double step = std::max(1e-6 * std::abs(found), 1e-9);
        if (std::abs(*stated - found) > step &&
            std::abs(*stated - value) > std::max(1e-6 * std::abs(value), 1e-9))
            remarks.warn(fmt::format("{}: the label's {} is {:.8g}, the data's {:.8g}: the data are taken",
                                     map.name(), key, *stated, found));
    }
}

/// Files as one raster.
struct ImportRaster {
    std::unique_ptr<RasterReader> raster;
    terrain::MapFrame frame;
    bool holes; ///< samples may be missing
};

/// Takes the maps over where it is a mosaic of them.
ImportRaster raster_of(const MapImportTask& task, std::vector<std::unique_ptr<MapSource>>& opened,
                       MapRemarks& remarks) {
    const MapSource& first = *opened.front();
    bool holes =
        std::any_of(opened.begin(), opened.end(), [](const auto& map) { return map->may_have_holes(); });
    std::unique_ptr<RasterReader> raster;
    terrain::MapFrame frame;
    const auto foreign =
        std::find_if(opened.begin(), opened.end(), [](const auto& map) { return map->place().foreign; });
    if (foreign != opened.end()) {
        if (opened.size() > 1)
            throw InputError(fmt::format(
                "{}: its projection ({}) is resampled, of one file at a time: gdalbuildvrt makes one of several",
                (*foreign)->name(), (*foreign)->map().method));
        auto made = std::make_unique<ResampledMap>(*opened.front(), task.settings, remarks);
        frame = made->frame();
        raster = std::move(made);
        holes = true;
    } else {
        const bool one_nodata = std::all_of(opened.begin(), opened.end(), [&](const auto& map) {
            return map->numbers().missing == first.numbers().missing &&
                   map->numbers().masked == first.numbers().masked;
        });
        if (!one_nodata) holes = true;
        auto made = std::make_unique<MapMosaic>(std::move(opened));
        frame = made->frame();
        holes = holes || made->has_gaps();
        raster = std::move(made);
    }
    return {std::move(raster), frame, holes};
}

terrain::ObtMetadata metadata_of(const MapImportTask& task, const MapSource& first,
                                 const RasterReader& raster, const terrain::MapFrame& frame,
                                 const MapType& type, const MapValues& values) {
    terrain::ObtMetadata metadata;
    metadata.kind = task.settings.kind;
    metadata.type = type.type;
    metadata.planes = raster.planes();
    metadata.rgb = first.rgb();
    metadata.width = frame.width();
    metadata.height = frame.height();
    metadata.scale = values.scale;
    metadata.offset = values.offset;
    metadata.nodata = type.nodata;
    metadata.registration = frame.registration();
    metadata.transform = frame.transform();
    metadata.projection = frame.projection();
    metadata.semi_axes_m = values.semi_axes_m;
    metadata.height_meaning = values.meaning;
    metadata.unit = values.unit;
    metadata.title = task.title.empty() ? one_line(task.output.stem().string()).substr(0, 127) : task.title;
    metadata.licence = task.licence;
    metadata.source = source_text(task.files);
    if (task.settings.kind == ObtKind::parameter) metadata.title = task.settings.parameter;
    terrain::validate(metadata, task.output.string());
    return metadata;
}

void write_mask(
    const MapImportTask& task, const terrain::ObtMetadata& metadata, RasterReader& raster,
    const terrain::ObtWriteOptions& options,
    const std::function<bool(const std::string& step, std::uint64_t done, std::uint64_t total)>& progress) {
    terrain::ObtMetadata mask = metadata;
    mask.kind = ObtKind::parameter;
    mask.type = SampleType::u8;
    mask.nodata.reset();
    mask.scale = 1;
    mask.offset = 0;
    mask.unit.clear();
    mask.title = "missing samples of " + metadata.source.substr(0, 100);
    mask.rgb = false;
    MaskSource source(raster);
    terrain::ObtWriteOptions as_before = options;
    as_before.progress = [&](std::uint64_t done, std::uint64_t total) {
        return progress("mask", done, total);
    };
    if (!terrain::write_obt(task.mask, mask, source, as_before).finished)
        throw Error(exit_failure,
                    fmt::format("{}: interrupted: the same command goes on", task.mask.string()));
}

} // namespace

MapImportReport import_map(
    const MapImportTask& task,
    const std::function<bool(const std::string& step, std::uint64_t done, std::uint64_t total)>& progress) {
    const auto start = std::chrono::steady_clock::now();
    MapImportReport report;
    GdalProcess process(task.limits);
    std::vector<std::unique_ptr<MapSource>> opened;
    for (const std::string& file : task.files)
        opened.push_back(std::make_unique<MapSource>(process, file, task.settings, report.remarks));
    const MapSource& first = *opened.front();
    const NumberProbe numbers = probe(opened);
    std::vector<MapSource*> maps;
    for (const auto& map : opened)
        maps.push_back(map.get());
    const bool resampled =
        std::any_of(opened.begin(), opened.end(), [](const auto& map) { return map->place().foreign; });
    auto [raster, frame, holes] = raster_of(task, opened, report.remarks);
    const bool keeps_holes = holes && !task.fill;
    const MapType type = map_type(first.numbers(), first.map().driver, resampled, keeps_holes);
    const MapValues values = map_values(first, numbers, type.type, task.settings, report.remarks);
    for (MapSource* map : maps)
        map->set_shift(values.shift);
    if (type.type == SampleType::f32 && numbers.any &&
        std::max(std::abs(numbers.least - values.shift), std::abs(numbers.largest - values.shift)) >
            16777216 &&
        (first.numbers().type == GdalType::i32 || first.numbers().type == GdalType::u32))
        report.remarks.warn(first.name() + ": numbers of more than 24 bits are rounded to f32");

    const terrain::ObtMetadata metadata = metadata_of(task, first, *raster, frame, type, values);
    terrain::ObtWriteOptions options;
    options.keep_on_error = false;
    options.resume = !task.restart && still_current(task);
    const std::filesystem::path folder =
        task.output.parent_path().empty() ? std::filesystem::path(".") : task.output.parent_path();
    const bool wraps =
        frame.period() > 0 && std::abs(frame.period() - static_cast<double>(frame.width())) < 0.5;
    RasterReader* finest = raster.get();
    std::unique_ptr<HoleFiller> filler;
    if (task.fill && holes) {
        const std::uint64_t total =
            std::uint64_t{raster->planes()} * static_cast<std::uint64_t>(raster->height());
        filler = std::make_unique<HoleFiller>(
            *raster, wraps, type.type != SampleType::f32, folder, [&](std::uint64_t rows) {
                if (!progress("looking for holes", rows, total))
                    throw Error(exit_failure, fmt::format("{}: interrupted", task.output.string()));
            });
        report.missing = report.filled = filler->holes().samples;
        report.missing_known = true;
        if (report.filled > 0) finest = filler.get();
    } else if (task.fill) {
        report.missing_known = true;
    }
    if (!task.mask.empty()) write_mask(task, metadata, *raster, options, progress);
    ReadAhead ahead(*finest);
    CountedSource source(ahead);
    options.progress = [&](std::uint64_t done, std::uint64_t total) {
        return progress(task.output.filename().string(), done, total);
    };
    report.written = terrain::write_obt(task.output, metadata, source, options);
    report.min_number = static_cast<double>(source.least()) + values.shift;
    report.largest_number = static_cast<double>(source.largest()) + values.shift;
    if (!report.missing_known && finest->by_rows() && report.written.resumed == 0) {
        report.missing = source.missing();
        report.missing_known = true;
    }
    if (!resampled && maps.size() == 1 && report.written.resumed == 0)
        compare_with_label(first, report, report.remarks);
    report.type = std::string(name_of(first.numbers().type));
    for (const MapSource* map : maps)
        report.source_bytes += static_cast<std::uint64_t>(map->width()) *
                               static_cast<std::uint64_t>(map->height()) * map->planes() *
                               bytes_of(map->numbers().type);
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return report;
}

} // namespace obscura::tools
