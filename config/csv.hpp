// SPDX-License-Identifier: Apache-2.0
// Strict reader of comma-separated tables of numbers; every error names file:line:column.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::config {

/// One data row of a table, with its position for error messages.
struct CsvRow {
    const std::filesystem::path& file;
    std::size_t line = 0;
    std::span<const double> values; ///< one per column; NaN: a text, an empty optional cell or no such column
    std::span<const std::string_view> cells; ///< as written, one per column; empty: none
    std::span<const std::size_t> column_at;  ///< text column of each value, from 1

    /// Throws ConfigError `file:line:column: name: what`.
    [[noreturn]] void fail(std::size_t index, std::string_view name, std::string_view what) const;
};

/// Column of a table.
struct CsvColumn {
    std::string_view name;
    bool optional = false; ///< the table may lack the column, and a cell may be empty
    bool text = false;     ///< any text instead of a number
};

/// Reads `file`: the header, exactly `columns` (comma separated), then rows of as many finite decimal
/// numbers. Lines that start with # and empty lines are skipped. Calls `row` for each data row. Throws
/// ConfigError.
void read_csv(const std::filesystem::path& file, std::string_view columns,
              const std::function<void(const CsvRow&)>& row);

/// As above, with columns that the table may lack; those that it has are in the order of `columns`.
void read_csv(const std::filesystem::path& file, std::span<const CsvColumn> columns,
              const std::function<void(const CsvRow&)>& row);

/// Whether the header of `file` has a column of that name; false also where it has no header or cannot be
/// read, of which read_csv() says why.
[[nodiscard]] bool has_csv_column(const std::filesystem::path& file, std::string_view name);

} // namespace obscura::config
