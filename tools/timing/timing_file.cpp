// SPDX-License-Identifier: Apache-2.0
#include "tools/timing/timing_file.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <istream>
#include <optional>
#include <string_view>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::size_t max_timing_rows = 1'000'000;
constexpr std::size_t max_columns = 256;
/// Numbers are below this: differences of larger ones could overflow.
constexpr std::int64_t number_limit = std::int64_t{1} << 62;

constexpr std::string_view frame_id_column = "frame_id", lateness_column = "row_lateness_us",
                           levels_column = "levels", first_byte_suffix = "_first_byte_ns",
                           last_byte_suffix = "_last_byte_ns", pace_suffix = "_pace_ns";

std::vector<std::string_view> split_line(std::string_view line) {
    std::vector<std::string_view> fields;
    for (std::size_t comma = line.find(','); comma != std::string_view::npos; comma = line.find(',')) {
        fields.push_back(line.substr(0, comma));
        line.remove_prefix(comma + 1);
    }
    fields.push_back(line);
    return fields;
}

/// The columns of one file, by the names in its first line.
class TimingColumns {
public:
    /// Throws InputError when a column is missing.
    TimingColumns(std::string_view header, const std::string& name)
        : name_(name), titles_(split_line(header)) {
        if (std::find(titles_.begin(), titles_.end(), frame_id_column) == titles_.end())
            throw InputError(
                fmt::format("{}:1: this is no timing file, allowed is what obscurad --timing writes", name));
        if (titles_.size() > max_columns)
            throw InputError(
                fmt::format("{}:1: {} columns, allowed are {}", name, titles_.size(), max_columns));
        for (const TimingColumn& column : timing_columns())
            if (const auto at = column.in_first_files ? index_of(column.name) : find(column.name))
                numbers_.push_back({*at, &column});
        for (const std::string_view title : titles_)
            for (const std::string_view suffix : {first_byte_suffix, last_byte_suffix}) {
                if (!title.ends_with(suffix)) continue;
                const std::string kind(title.substr(0, title.size() - suffix.size()));
                // The name goes into pictures (SVG) and tables.
                if (kind.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
                    throw InputError(fmt::format(
                        "{}:1: \"{}\" is no kind of transport: allowed are small letters, digits and _", name,
                        kind.substr(0, 40)));
                if (std::find(transports.begin(), transports.end(), kind) != transports.end()) continue;
                transports.push_back(kind);
                first_byte_.push_back(index_of(kind + std::string(first_byte_suffix)));
                last_byte_.push_back(index_of(kind + std::string(last_byte_suffix)));
                pace_.push_back(find(kind + std::string(pace_suffix)));
            }
        lateness_ = index_of(lateness_column);
        levels_ = find(levels_column);
    }

    /// Throws InputError with line `number` and column.
    [[nodiscard]] TimingRow parse(std::string_view line, std::size_t number) const {
        const std::vector<std::string_view> fields = split_line(line);
        const auto whole = [&](std::size_t column) {
            if (column >= fields.size()) refuse(number, fields.size() - 1);
            std::int64_t value = 0;
            const char* const end = fields[column].data() + fields[column].size();
            const auto [rest, error] = std::from_chars(fields[column].data(), end, value);
            if (error != std::errc() || rest != end || value <= -number_limit || value >= number_limit)
                refuse(number, column);
            return value;
        };
        TimingRow row;
        for (const auto& [place, column] : numbers_)
            column->set(row, whole(place));
        for (std::size_t i = 0; i < transports.size(); ++i) {
            row.first_byte.push_back(whole(first_byte_[i]));
            row.last_byte.push_back(whole(last_byte_[i]));
            row.pace.push_back(pace_[i] ? whole(*pace_[i]) : 0);
        }
        if (fields.size() != titles_.size()) refuse(number, std::min(fields.size(), titles_.size()) - 1);
        row.row_lateness_us = lateness_of(fields[lateness_], number);
        if (levels_) row.levels = levels_of(fields[*levels_], number);
        return row;
    }

    std::vector<std::string> transports; ///< kinds

private:
    [[nodiscard]] std::optional<std::size_t> find(std::string_view title) const {
        const auto found = std::find(titles_.begin(), titles_.end(), title);
        if (found == titles_.end()) return std::nullopt;
        return static_cast<std::size_t>(found - titles_.begin());
    }
    [[nodiscard]] std::size_t index_of(std::string_view title) const {
        const std::optional<std::size_t> found = find(title);
        if (!found)
            throw InputError(fmt::format(
                "{}:1: column {} is missing, allowed are the columns that obscurad --timing writes", name_,
                title));
        return *found;
    }
    /// Numbers with one blank between them, or nothing.
    [[nodiscard]] std::vector<std::int32_t> lateness_of(std::string_view field, std::size_t number) const {
        std::vector<std::int32_t> values;
        const char* at = field.data();
        const char* const end = field.data() + field.size();
        while (at != end) {
            std::int32_t us = 0;
            const auto [rest, error] = std::from_chars(at, end, us);
            const bool good = error == std::errc() && (rest == end || (*rest == ' ' && rest + 1 != end));
            if (!good || values.size() == max_timing_rows) refuse(number, lateness_);
            values.push_back(us);
            at = rest == end ? end : rest + 1;
        }
        return values;
    }
    [[nodiscard]] std::string levels_of(std::string_view field, std::size_t number) const {
        if (field.size() > max_quality_groups || field.find_first_not_of("0123456789") != std::string::npos)
            throw InputError(fmt::format("{}:{}: column {} is no list of levels, allowed are up to {} digits",
                                         name_, number, *levels_ + 1, max_quality_groups));
        return std::string(field);
    }
    [[noreturn]] void refuse(std::size_t line, std::size_t column) const {
        throw InputError(fmt::format(
            "{}:{}: column {} is no whole number, allowed are the {} columns that obscurad --timing writes",
            name_, line, column + 1, titles_.size()));
    }

    const std::string& name_;
    std::vector<std::string_view> titles_;
    std::size_t lateness_ = 0;
    struct NumberAt {
        std::size_t place;
        const TimingColumn* column;
    };
    std::vector<NumberAt> numbers_;
    std::vector<std::size_t> first_byte_, last_byte_;
    std::vector<std::optional<std::size_t>> pace_;
    std::optional<std::size_t> levels_;
};

} // namespace

TimingFile read_timing(std::istream& in, const std::string& name) {
    std::string header;
    std::getline(in, header);
    const TimingColumns columns(header, name);
    TimingFile file;
    file.transports = columns.transports;
    std::string line;
    for (std::size_t number = 2; std::getline(in, line); ++number) {
        TimingRow row = columns.parse(line, number);
        // Older files do not number acquisitions: in each, frames count from 1.
        if (row.acquisition == 0) {
            const bool first = file.rows.empty(), again = !first && row.frame_id <= file.rows.back().frame_id;
            row.acquisition = first ? 1 : file.rows.back().acquisition + (again ? 1 : 0);
        }
        file.rows.push_back(std::move(row));
    }
    return file;
}

std::vector<TimingFile> acquisitions(const TimingFile& file) {
    std::vector<TimingFile> all;
    for (const TimingRow& row : file.rows) {
        if (all.empty() || all.back().rows.back().acquisition != row.acquisition)
            all.push_back({file.transports, {}});
        all.back().rows.push_back(row);
    }
    return all;
}

} // namespace obscura::tools
