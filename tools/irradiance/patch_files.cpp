// SPDX-License-Identifier: Apache-2.0
// Files of patch tables: PLY, VTK, CSV, FITS and EXR.
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "images/writers/exr.hpp"
#include "images/writers/fits_table.hpp"
#include "images/writers/raw.hpp"
#include "tools/irradiance/patch_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <bit>
#include <cstring>
#include <string>

namespace obscura::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers of PLY are written as they lie in memory");

template<typename Number>
void append(std::string& bytes, Number value) {
    std::array<char, sizeof value> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    bytes.append(raw.data(), raw.size());
}

/// Binary PLY, little endian, with the columns as properties of the faces.
void write_ply(const std::filesystem::path& file, const PatchTable& table) {
    std::string out =
        fmt::format("ply\nformat binary_little_endian 1.0\ncomment light received by {}, body "
                    "frame, metres\nelement vertex {}\nproperty float x\nproperty float y\n"
                    "property float z\nelement face {}\nproperty list uchar int vertex_indices\n"
                    "property uchar red\nproperty uchar green\nproperty uchar blue\n",
                    printable(table.body), table.vertices_m.size(), table.faces.size());
    for (const PatchColumn& column : table.columns)
        out += fmt::format("property float {}\n", column.name);
    out += "end_header\n";
    for (const Vec3 v : table.vertices_m)
        for (const double x : {v.x, v.y, v.z})
            append(out, static_cast<float>(x));
    for (std::size_t f = 0; f < table.faces.size(); ++f) {
        append(out, static_cast<std::uint8_t>(table.faces[f].size()));
        for (const std::uint32_t corner : table.faces[f])
            append(out, static_cast<std::int32_t>(corner));
        for (const std::uint8_t c : table.colours[f])
            append(out, c);
        for (const PatchColumn& column : table.columns)
            append(out, column.values[f]);
    }
    images::write_text(file, out);
}

/// Legacy VTK in text: an unstructured grid with scalars of the cells.
void write_vtk(const std::filesystem::path& file, const PatchTable& table) {
    std::string out =
        fmt::format("# vtk DataFile Version 3.0\nlight received by {}, body frame, metres\nASCII\n"
                    "DATASET POLYDATA\nPOINTS {} double\n",
                    printable(table.body), table.vertices_m.size());
    for (const Vec3 v : table.vertices_m)
        out += fmt::format("{} {} {}\n", v.x, v.y, v.z);
    std::size_t numbers = 0;
    for (const auto& face : table.faces)
        numbers += 1 + face.size();
    out += fmt::format("POLYGONS {} {}\n", table.faces.size(), numbers);
    for (const auto& face : table.faces)
        out += fmt::format("{} {}\n", face.size(), fmt::join(face, " "));
    out += fmt::format("CELL_DATA {}\n", table.faces.size());
    for (const PatchColumn& column : table.columns) {
        out += fmt::format("SCALARS {} float 1\nLOOKUP_TABLE default\n", column.name);
        for (const float value : column.values)
            out += fmt::format("{}\n", value);
    }
    images::write_text(file, out);
}

void write_csv(const std::filesystem::path& file, const PatchTable& table) {
    std::string out = "patch";
    for (const PatchColumn& column : table.columns)
        out += "," + column.name;
    out += '\n';
    for (std::size_t f = 0; f < table.faces.size(); ++f) {
        out += fmt::format("{}", f);
        for (const PatchColumn& column : table.columns)
            out += fmt::format(",{}", column.values[f]);
        out += '\n';
    }
    images::write_text(file, out);
}

void write_fits(const std::filesystem::path& file, const PatchTable& table) {
    std::vector<images::FitsTableColumn> columns;
    for (const PatchColumn& column : table.columns)
        columns.push_back({column.name, column.unit, {column.values.begin(), column.values.end()}});
    images::write_fits_table(file, "PATCHES", columns,
                             {{"BODY", table.body, "body that receives the light"}});
}

/// Image by longitude and latitude: a pixel for each cell.
void write_cells(const std::filesystem::path& file, const PatchTable& table) {
    if (table.rows == 0)
        throw InputError(fmt::format(
            "{}: the patches of body '{}' are the facets of its mesh, which make no image: allowed are .ply, .vtk, .csv and .fits",
            file.string(), printable(table.body)));
    std::vector<images::ExrChannel> channels;
    for (const PatchColumn& column : table.columns)
        channels.push_back({column.name, column.unit, column.values});
    const auto rows = static_cast<std::int32_t>(table.rows);
    images::write_exr(file, 2 * rows, rows, channels, {});
}

/// A kind of file.
struct PatchFile {
    std::string_view ending, what;
    void (*write)(const std::filesystem::path&, const PatchTable&);
};
constexpr std::array patch_files{
    PatchFile{".ply", "mesh with colours and numbers by facet, binary", write_ply},
    PatchFile{".vtk", "mesh for ParaView, text", write_vtk},
    PatchFile{".csv", "table", write_csv},
    PatchFile{".fits", "binary table", write_fits},
    PatchFile{".exr", "image by longitude and latitude, of bodies without facets", write_cells},
};

} // namespace

std::vector<std::pair<std::string_view, std::string_view>> patch_file_endings() {
    std::vector<std::pair<std::string_view, std::string_view>> out;
    for (const PatchFile& kind : patch_files)
        out.emplace_back(kind.ending, kind.what);
    return out;
}

void write_patch_table(const std::filesystem::path& file, const PatchTable& table) {
    for (const PatchFile& kind : patch_files)
        if (file.extension() == kind.ending) return kind.write(file, table);
    throw InputError(fmt::format("{}: no ending of a file of patches", file.string()));
}

} // namespace obscura::tools
