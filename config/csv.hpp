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
    std::span<const double> values;         ///< one per column of the header
    std::span<const std::size_t> column_at; ///< text column of each value, from 1

    /// Throws ConfigError `file:line:column: name: what`.
    [[noreturn]] void fail(std::size_t index, std::string_view name, std::string_view what) const;
};

/// Reads `file`: the header, exactly `columns` (comma separated), then rows of as many finite decimal
/// numbers. Lines that start with # and empty lines are skipped. Calls `row` for each data row. Throws
/// ConfigError.
void read_csv(const std::filesystem::path& file, std::string_view columns,
              const std::function<void(const CsvRow&)>& row);

} // namespace obscura::config
