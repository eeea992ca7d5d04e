// SPDX-License-Identifier: Apache-2.0
// Reader of truth tables (docs/truth.md), CSV and FITS, as text.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::images {

/// Lines of the table of one frame, or of all. Lines of kind `pose` and `rows` of CSV files are left out.
struct TruthLines {
    std::vector<std::string> columns; ///< names, in the order of the file, in small letters
    std::vector<std::vector<std::string>> lines;

    /// Index of a column; columns.size(): there is none.
    [[nodiscard]] std::size_t column(std::string_view name) const;
};

/// Whether the file is a truth table, not a picture.
[[nodiscard]] bool is_truth_table(const std::filesystem::path& file);

/// Reads the lines of frame `frame`; empty: of all frames. Throws InputError with file, line or column.
[[nodiscard]] TruthLines read_truth_table(const std::filesystem::path& file, const std::string& frame);

} // namespace obscura::images
