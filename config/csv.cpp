// SPDX-License-Identifier: Apache-2.0
#include "config/csv.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/number.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace obscura::config {
namespace {

std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> cells;
    for (std::size_t at = 0;;) {
        const std::size_t comma = line.find(',', at);
        cells.push_back(line.substr(at, comma - at));
        if (comma == std::string_view::npos) return cells;
        at = comma + 1;
    }
}

/// The columns as a header, optional ones in brackets.
std::string header_of(std::span<const CsvColumn> columns) {
    std::string header;
    for (const CsvColumn& column : columns)
        header += fmt::format("{}{}{}{}", column.optional ? "[" : "", header.empty() ? "" : ",", column.name,
                              column.optional ? "]" : "");
    return header;
}

/// Whether the cells name columns in their order, with only optional ones left out; sets their indices.
bool match_header(const std::vector<std::string_view>& cells, std::span<const CsvColumn> columns,
                  std::vector<std::size_t>& present) {
    present.clear();
    for (std::size_t i = 0; i < columns.size(); ++i) {
        if (present.size() < cells.size() && trimmed(cells[present.size()]) == columns[i].name)
            present.push_back(i);
        else if (!columns[i].optional)
            return false;
    }
    return present.size() == cells.size();
}

[[noreturn]] void fail_at(const std::filesystem::path& file, std::size_t line, std::size_t column,
                          std::string_view what) {
    throw ConfigError(fmt::format("{}:{}:{}: {}", file.string(), line, column, what));
}

} // namespace

void CsvRow::fail(std::size_t index, std::string_view name, std::string_view what) const {
    fail_at(file, line, column_at[index], fmt::format("{}: {}", name, what));
}

void read_csv(const std::filesystem::path& file, std::string_view columns,
              const std::function<void(const CsvRow&)>& row) {
    std::vector<CsvColumn> list;
    for (const std::string_view name : split(columns))
        list.push_back({name});
    read_csv(file, list, row);
}

void read_csv(const std::filesystem::path& file, std::span<const CsvColumn> columns,
              const std::function<void(const CsvRow&)>& row) {
    std::string text;
    if (const std::string why = read_text(file, text); !why.empty())
        throw ConfigError(fmt::format("{}: cannot be opened: {}", file.string(), why));

    const std::string allowed = header_of(columns);
    std::vector<std::size_t> present; // columns of the table, as indices of `columns`
    std::string header;
    std::vector<double> values(columns.size());
    std::vector<std::string_view> texts(columns.size());
    std::vector<std::size_t> column_at(columns.size());
    bool header_seen = false;
    std::size_t number = 0;
    for (std::size_t at = 0; at < text.size();) {
        ++number;
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string_view line(text.data() + at, end - at);
        at = end + 1;
        if (trimmed(line).empty() || trimmed(line).front() == '#') continue;

        const std::vector<std::string_view> cells = split(line);
        if (!header_seen) {
            if (cells.size() == 1 && line.find(';') != std::string_view::npos)
                fail_at(file, number, 1, "columns are separated by semicolons, allowed are commas");
            if (!match_header(cells, columns, present))
                fail_at(file, number, 1,
                        fmt::format("header is \"{}\", allowed \"{}\"", printable(line, 80), allowed));
            for (const std::size_t i : present)
                header += fmt::format("{}{}", header.empty() ? "" : ",", columns[i].name);
            header_seen = true;
            continue;
        }
        if (cells.size() != present.size())
            fail_at(file, number, 1,
                    fmt::format("{} values, the header has {} columns ({})", cells.size(), present.size(),
                                header));
        std::fill(values.begin(), values.end(), std::numeric_limits<double>::quiet_NaN());
        std::fill(texts.begin(), texts.end(), std::string_view{});
        std::fill(column_at.begin(), column_at.end(), 1);
        for (std::size_t i = 0; i < cells.size(); ++i) {
            const CsvColumn& column = columns[present[i]];
            const std::string_view cell = trimmed(cells[i]);
            const std::size_t place =
                static_cast<std::size_t>((cell.empty() ? cells[i] : cell).data() - line.data()) + 1;
            texts[present[i]] = cell;
            column_at[present[i]] = place;
            if (column.text || (column.optional && cell.empty())) continue;
            const std::optional<double> value = decimal_number(cell);
            if (!value)
                fail_at(file, number, place,
                        fmt::format("{}: \"{}\" is not a finite number", column.name, printable(cell, 40)));
            values[present[i]] = *value;
        }
        row({file, number, values, texts, column_at});
    }
    if (!header_seen)
        fail_at(file, std::max<std::size_t>(number, 1), 1,
                fmt::format("empty, the header \"{}\" is wanted", allowed));
}

bool has_csv_column(const std::filesystem::path& file, std::string_view name) {
    std::string text;
    if (!read_text(file, text).empty()) return false;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line(text.data() + at, end - at);
        at = end + 1;
        if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
        const std::vector<std::string_view> cells = split(line);
        return std::any_of(cells.begin(), cells.end(),
                           [&](std::string_view cell) { return trimmed(cell) == name; });
    }
    return false;
}

} // namespace obscura::config
