// SPDX-License-Identifier: Apache-2.0
#include "config/csv.hpp"

#include "config/document.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace obscura::config {
namespace {

std::string_view trimmed(std::string_view text) {
    const auto first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> cells;
    for (std::size_t at = 0;;) {
        const std::size_t comma = line.find(',', at);
        cells.push_back(line.substr(at, comma - at));
        if (comma == std::string_view::npos) return cells;
        at = comma + 1;
    }
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
    std::string text;
    if (const std::string why = read_text(file, text); !why.empty())
        throw ConfigError(fmt::format("{}: cannot be opened: {}", file.string(), why));

    const std::vector<std::string_view> names = split(columns);
    std::vector<double> values(names.size());
    std::vector<std::size_t> column_at(names.size());
    bool header_seen = false;
    std::size_t number = 0;
    for (std::size_t at = 0; at < text.size();) {
        ++number;
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string_view line(text.data() + at, end - at);
        at = end + 1;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        if (trimmed(line).empty() || trimmed(line).front() == '#') continue;

        const std::vector<std::string_view> cells = split(line);
        if (!header_seen) {
            const bool same = cells.size() == names.size() &&
                              std::equal(cells.begin(), cells.end(), names.begin(),
                                         [](auto cell, auto name) { return trimmed(cell) == name; });
            if (!same)
                fail_at(file, number, 1,
                        fmt::format("header is \"{}\", allowed \"{}\"", printable(line, 80), columns));
            header_seen = true;
            continue;
        }
        if (cells.size() != names.size())
            fail_at(file, number, 1,
                    fmt::format("{} values, the header has {} columns ({})", cells.size(), names.size(),
                                columns));
        for (std::size_t i = 0; i < cells.size(); ++i) {
            const std::string_view cell = trimmed(cells[i]);
            column_at[i] =
                static_cast<std::size_t>((cell.empty() ? cells[i] : cell).data() - line.data()) + 1;
            const auto [rest, error] = std::from_chars(cell.data(), cell.data() + cell.size(), values[i]);
            if (error != std::errc{} || rest != cell.data() + cell.size() || !std::isfinite(values[i]))
                fail_at(file, number, column_at[i],
                        fmt::format("{}: \"{}\" is not a finite number", names[i], printable(cell, 40)));
        }
        row({file, number, values, column_at});
    }
    if (!header_seen)
        fail_at(file, std::max<std::size_t>(number, 1), 1,
                fmt::format("empty, the header \"{}\" is wanted", columns));
}

} // namespace obscura::config
