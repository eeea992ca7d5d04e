// SPDX-License-Identifier: Apache-2.0
#include "images/writers/truth_table.hpp"

#include "core/text/text.hpp"
#include "images/writers/fits_writer.hpp"
#include "images/writers/raw.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cmath>
#include <utility>

namespace obscura::images {
namespace {

constexpr std::array columns{
    TruthColumn{"frame", "", "1K",
                [](const SceneTruth& t, const TruthEntry&) -> TruthCell {
                    return static_cast<std::int64_t>(t.frame_id);
                }},
    TruthColumn{"kind", "", "10A",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return name_of(e.kind); }},
    TruthColumn{"name", "", "32A",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.name.view(); }},
    TruthColumn{"object", "", "1J",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return std::int64_t{e.object}; }},
    TruthColumn{"item", "", "1J",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return std::int64_t{e.item}; }},
    TruthColumn{"window", "", "1J",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return std::int64_t{e.window}; }},
    TruthColumn{"x_px", "px", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.x_px; }},
    TruthColumn{"y_px", "px", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.y_px; }},
    TruthColumn{"visibility", "", "8A",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return name_of(e.visibility); }},
    TruthColumn{"visible_share", "", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.visible_share; }},
    TruthColumn{"lit", "", "1J",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return std::int64_t{e.lit}; }},
    TruthColumn{
        "saturated", "", "1J",
        [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return std::int64_t{e.saturated}; }},
    TruthColumn{"time_ns", "ns", "1K",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.time.ns; }},
    TruthColumn{"exposure_ns", "ns", "1K",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.exposure_ns; }},
    TruthColumn{"range_m", "m", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.range_m; }},
    TruthColumn{"magnitude_v", "mag", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.magnitude_v; }},
    TruthColumn{"irradiance_w_m2", "W/m2", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.irradiance_w_m2; }},
    TruthColumn{"signal_e", "electron", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.signal_e; }},
    TruthColumn{"peak_e", "electron", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.peak_e; }},
    TruthColumn{"snr", "", "1D", [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.snr; }},
    TruthColumn{"psf_x_px", "px", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.psf_x_px; }},
    TruthColumn{"psf_y_px", "px", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.psf_y_px; }},
    TruthColumn{"latitude_deg", "deg", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.latitude_deg; }},
    TruthColumn{"longitude_deg", "deg", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.longitude_deg; }},
    TruthColumn{"diameter_m", "m", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.diameter_m; }},
    TruthColumn{"point_x_m", "m", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.point_m.x; }},
    TruthColumn{"point_y_m", "m", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.point_m.y; }},
    TruthColumn{"point_z_m", "m", "1D",
                [](const SceneTruth&, const TruthEntry& e) -> TruthCell { return e.point_m.z; }},
};

/// Columns of poses, after those of objects in CSV files.
struct PoseColumn {
    const char* name;
    const char* unit;
};
constexpr std::array pose_columns{PoseColumn{"position_x_m", "m"}, PoseColumn{"position_y_m", "m"},
                                  PoseColumn{"position_z_m", "m"}, PoseColumn{"q_w", ""},
                                  PoseColumn{"q_x", ""},           PoseColumn{"q_y", ""},
                                  PoseColumn{"q_z", ""},           PoseColumn{"sun_x", ""},
                                  PoseColumn{"sun_y", ""},         PoseColumn{"sun_z", ""}};
using PoseCells = std::array<double, pose_columns.size()>;

PoseCells cells_of(const TruthPose& p) {
    const Vec3 x = p.pose.position_m;
    const Quat q = p.pose.orientation;
    return {x.x, x.y, x.z, q.w, q.x, q.y, q.z, p.sun.x, p.sun.y, p.sun.z};
}

/// A cell of text for CSV files, in quotes where it needs them.
std::string csv_text(std::string_view text) {
    if (text.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(text);
    std::string out = "\"";
    for (const char c : text)
        out += c == '"' ? "\"\"" : std::string(1, c);
    return out + '"';
}

/// Rows of equal times, from `first_row` on.
struct RowBlock {
    std::int64_t first_row;
    RowTime time;
};

std::vector<RowBlock> blocks_of(std::span<const RowTime> rows) {
    std::vector<RowBlock> blocks;
    for (std::size_t i = 0; i < rows.size(); ++i)
        if (i == 0 || rows[i] != rows[i - 1]) blocks.push_back({static_cast<std::int64_t>(i), rows[i]});
    return blocks;
}

} // namespace

std::span<const TruthColumn> truth_columns() {
    return columns;
}

std::string truth_text(const TruthColumn& column, const TruthCell& cell) {
    if (const auto* text = std::get_if<std::string_view>(&cell)) return std::string(*text);
    if (const auto* whole = std::get_if<std::int64_t>(&cell)) return fmt::format("{}", *whole);
    const double value = std::get<double>(cell);
    if (std::isnan(value)) return {};
    return column.unit == "px" ? fmt::format("{:.5f}", value) : fmt::format("{:.10g}", value);
}

TruthTableFile::TruthTableFile(std::filesystem::path file) : file_(std::move(file)) {
    const std::filesystem::path ending = file_.extension();
    if (ending != ".csv" && ending != ".fits")
        throw OutputError(fmt::format("{}: truth table: the name must end in .csv or .fits", file_.string()));
    const std::filesystem::path folder = file_.parent_path();
    require_writable(folder.empty() ? "." : folder);
}

void TruthTableFile::add(SceneTruth truth, std::span<const RowTime> rows) {
    frames_.push_back({std::move(truth), {rows.begin(), rows.end()}});
}

void TruthTableFile::write() const {
    if (file_.extension() == ".csv")
        write_csv();
    else
        write_fits();
}

std::string truth_csv_header() {
    std::string text;
    for (const TruthColumn& column : columns)
        text.append(column.name).append(",");
    for (std::size_t i = 0; i < pose_columns.size(); ++i)
        text.append(pose_columns[i].name).append(i + 1 < pose_columns.size() ? "," : "\n");
    return text;
}

std::string truth_csv_lines(const SceneTruth& truth, std::span<const RowTime> rows) {
    std::string text;
    // Cells of a line that is no entry; by column.
    const auto begin_line = [&](std::string_view kind, std::string_view name, std::int64_t item, Time time,
                                std::int64_t exposure_ns) {
        for (const TruthColumn& column : columns) {
            if (column.name == "frame") text += fmt::format("{}", truth.frame_id);
            if (column.name == "kind") text += kind;
            if (column.name == "name") text += csv_text(name);
            if (column.name == "item") text += fmt::format("{}", item);
            if (column.name == "time_ns") text += fmt::format("{}", time.ns);
            if (column.name == "exposure_ns") text += fmt::format("{}", exposure_ns);
            text += ',';
        }
    };
    const std::string no_pose = std::string(pose_columns.size() - 1, ',') + '\n';
    std::int64_t number = 0;
    for (const TruthPose& pose : truth.poses) {
        begin_line("pose", pose.name.view(), number++, truth.mid_exposure, 0);
        const PoseCells cells = cells_of(pose);
        for (std::size_t i = 0; i < cells.size(); ++i)
            text += fmt::format("{}{}", cells[i], i + 1 < cells.size() ? "," : "\n");
    }
    for (const RowBlock& block : blocks_of(rows)) {
        begin_line("rows", "", block.first_row, block.time.mid(), block.time.exposure_ns());
        text += no_pose;
    }
    for (const TruthEntry& entry : truth.entries) {
        for (const TruthColumn& column : columns) {
            const TruthCell cell = column.cell(truth, entry);
            const auto* words = std::get_if<std::string_view>(&cell);
            text += words != nullptr ? csv_text(*words) : truth_text(column, cell);
            text += ',';
        }
        text += no_pose;
    }
    return text;
}

void TruthTableFile::write_csv() const {
    std::string text = truth_csv_header();
    for (const FrameTable& frame : frames_)
        text += truth_csv_lines(frame.truth, frame.rows);
    write_text(file_, text);
}

void TruthTableFile::write_fits() const {
    FitsWriter writer(file_);
    write_entries(writer);
    write_poses(writer);
    write_rows(writer);
    writer.commit();
}

void TruthTableFile::write_entries(FitsWriter& writer) const {
    std::vector<const SceneTruth*> truths; // of each entry
    std::vector<const TruthEntry*> entries;
    for (const FrameTable& frame : frames_)
        for (const TruthEntry& entry : frame.truth.entries) {
            truths.push_back(&frame.truth);
            entries.push_back(&entry);
        }
    std::vector<std::string> texts;
    texts.reserve(3 * columns.size());
    const auto keep = [&](std::string text) { return texts.emplace_back(std::move(text)).c_str(); };
    std::vector<FitsWriter::Column> list;
    for (const TruthColumn& column : columns)
        list.push_back(
            {keep(upper_case(column.name)), keep(std::string(column.form)), keep(std::string(column.unit))});
    writer.create_table("TRUTH", entries.size(), list);
    writer.write({"PIXCENTR", std::string("0, 0"), "coordinates of the centre of the first pixel"});
    for (std::size_t c = 0; c < columns.size(); ++c) {
        std::vector<std::int64_t> whole;
        std::vector<double> real;
        std::vector<std::string> text;
        for (std::size_t i = 0; i < entries.size(); ++i) {
            const TruthCell cell = columns[c].cell(*truths[i], *entries[i]);
            if (const auto* t = std::get_if<std::string_view>(&cell))
                text.emplace_back(*t);
            else if (const auto* w = std::get_if<std::int64_t>(&cell))
                whole.push_back(*w);
            else
                real.push_back(std::get<double>(cell));
        }
        const int number = static_cast<int>(c) + 1;
        if (!text.empty())
            writer.write_column(number, text);
        else if (!whole.empty())
            writer.write_column(number, whole);
        else
            writer.write_column(number, real);
    }
}

void TruthTableFile::write_poses(FitsWriter& writer) const {
    std::vector<std::int64_t> ids, times;
    std::vector<std::string> names;
    std::array<std::vector<double>, pose_columns.size()> cells;
    for (const FrameTable& frame : frames_)
        for (const TruthPose& pose : frame.truth.poses) {
            ids.push_back(static_cast<std::int64_t>(frame.truth.frame_id));
            names.emplace_back(pose.name.view());
            times.push_back(frame.truth.mid_exposure.ns);
            const PoseCells of_pose = cells_of(pose);
            for (std::size_t i = 0; i < of_pose.size(); ++i)
                cells[i].push_back(of_pose[i]);
        }
    std::vector<std::string> pose_texts;
    pose_texts.reserve(pose_columns.size());
    std::vector<FitsWriter::Column> list = {
        {"FRAME", "1K", ""}, {"NAME", "32A", ""}, {"TIME_NS", "1K", "ns"}};
    for (const auto& [name, unit] : pose_columns)
        list.push_back({pose_texts.emplace_back(upper_case(name)).c_str(), "1D", unit});
    writer.create_table("POSES", ids.size(), list);
    writer.write_column(1, ids);
    writer.write_column(2, names);
    writer.write_column(3, times);
    for (std::size_t i = 0; i < cells.size(); ++i)
        writer.write_column(static_cast<int>(i) + 4, cells[i]);
}

void TruthTableFile::write_rows(FitsWriter& writer) const {
    std::vector<std::int64_t> ids, first, reset, read;
    for (const FrameTable& frame : frames_)
        for (const RowBlock& block : blocks_of(frame.rows)) {
            ids.push_back(static_cast<std::int64_t>(frame.truth.frame_id));
            first.push_back(block.first_row);
            reset.push_back(block.time.reset.ns);
            read.push_back(block.time.read.ns);
        }
    writer.create_table(
        "ROWS", ids.size(),
        {{"FRAME", "1K", ""}, {"ROW", "1J", ""}, {"RESET", "1K", "ns"}, {"READ", "1K", "ns"}});
    int number = 0;
    for (const auto* column : {&ids, &first, &reset, &read})
        writer.write_column(++number, *column);
}

} // namespace obscura::images
