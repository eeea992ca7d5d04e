// SPDX-License-Identifier: Apache-2.0
// Strict reading of comma-separated tables of numbers; every complaint names file:line:column.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::config {

/// One data row of a table, and the means to complain about it.
struct CsvRow {
    const std::filesystem::path& file;
    std::size_t line = 0;
    std::span<const double> values;         ///< one per column of the header
    std::span<const std::size_t> column_at; ///< text column of each value, from 1

    /// Throws ConfigError `file:line:column: name: what`.
    [[noreturn]] void fail(std::size_t index, std::string_view name, std::string_view what) const;
};

/// Reads `file`: lines that start with # and empty lines are passed over, then exactly the header `columns`
/// (comma separated), then rows of as many finite decimal numbers; `row` is called for each. Throws
/// ConfigError.
void read_csv(const std::filesystem::path& file, std::string_view columns,
              const std::function<void(const CsvRow&)>& row);

} // namespace obscura::config
