// SPDX-License-Identifier: Apache-2.0
// Patch table: what is known of each patch of a body that receives light, as columns.
#pragma once

#include "core/geometry.hpp"
#include "renderer/received/received_light.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Column of numbers, one for each patch.
struct PatchColumn {
    std::string name; ///< with the number of the band, from 1, where there are several
    std::string unit;
    std::vector<float> values;
};

/// Patches of a body with their columns; geometry in the body frame.
struct PatchTable {
    std::string body;
    std::vector<Vec3> vertices_m;
    std::vector<std::vector<std::uint32_t>> faces; ///< corners of each patch, counter-clockwise from outside
    std::size_t rows = 0; ///< cells from pole to pole; columns are twice as many; 0: the patches are facets
    std::vector<PatchColumn> columns;
    /// Colour of each patch, of the light that it absorbs.
    std::vector<std::array<std::uint8_t, 3>> colours;
};

[[nodiscard]] PatchTable patch_table(const renderer::BodyReceivedLight& light);

/// Endings of the files that can be written, with what they are.
[[nodiscard]] std::vector<std::pair<std::string_view, std::string_view>> patch_file_endings();
/// Writes the table by the ending of the name: PLY and VTK with geometry, CSV and FITS as tables, EXR as an
/// image of cells. Throws OutputError, or InputError where a file of that kind cannot hold the table.
void write_patch_table(const std::filesystem::path& file, const PatchTable& table);

} // namespace obscura::tools
