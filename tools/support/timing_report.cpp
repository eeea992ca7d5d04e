// SPDX-License-Identifier: Apache-2.0
#include "tools/support/timing_report.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <istream>
#include <numeric>
#include <string_view>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::size_t most_rows = 1'000'000;
constexpr std::size_t most_columns = 256;
/// Numbers are below this: differences of larger ones could overflow.
constexpr std::int64_t number_limit = std::int64_t{1} << 62;
constexpr std::size_t worst_count = 10;

struct NumberColumn {
    std::string_view name;
    std::int64_t TimingRow::*value;
};

constexpr NumberColumn number_columns[] = {
    {"edge_ns", &TimingRow::edge},
    {"seen_ns", &TimingRow::seen},
    {"pose_ns", &TimingRow::pose},
    {"render_begin_ns", &TimingRow::render_begin},
    {"render_end_ns", &TimingRow::render_end},
    {"detector_end_ns", &TimingRow::detector_end},
    {"due_ns", &TimingRow::due},
    {"first_ns", &TimingRow::first},
    {"last_due_ns", &TimingRow::last_due},
    {"last_ns", &TimingRow::last},
    {"rows", &TimingRow::rows},
    {"late_rows", &TimingRow::late_rows},
    {"worst_row_ns", &TimingRow::worst_row},
    {"worst_row", &TimingRow::worst_row_number},
    {"flags", &TimingRow::flags},
};
constexpr std::string_view frame_id_column = "frame_id", trigger_id_column = "trigger_id",
                           lateness_column = "row_lateness_us", first_byte_suffix = "_first_byte_ns",
                           last_byte_suffix = "_last_byte_ns";

std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> fields;
    for (std::size_t comma = line.find(','); comma != std::string_view::npos; comma = line.find(',')) {
        fields.push_back(line.substr(0, comma));
        line.remove_prefix(comma + 1);
    }
    fields.push_back(line);
    return fields;
}

/// The columns of one file, by the names in its first line.
class Columns {
public:
    /// Throws InputError when a column is missing.
    Columns(std::string_view header, const std::string& name) : name_(name), titles_(split(header)) {
        if (std::find(titles_.begin(), titles_.end(), frame_id_column) == titles_.end())
            throw InputError(
                fmt::format("{}:1: this is no timing file, allowed is what obscurad --timing writes", name));
        if (titles_.size() > most_columns)
            throw InputError(
                fmt::format("{}:1: {} columns, allowed are {}", name, titles_.size(), most_columns));
        frame_id_ = index_of(frame_id_column);
        trigger_id_ = index_of(trigger_id_column);
        for (const NumberColumn& column : number_columns)
            numbers_.push_back(index_of(column.name));
        for (const std::string_view title : titles_)
            for (const std::string_view suffix : {first_byte_suffix, last_byte_suffix}) {
                if (!title.ends_with(suffix)) continue;
                const std::string kind(title.substr(0, title.size() - suffix.size()));
                // The name goes into pictures (SVG) and tables.
                if (kind.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
                    throw InputError(fmt::format("{}:1: \"{}\" is no kind of transport: allowed are small "
                                                 "letters, digits and _",
                                                 name, kind.substr(0, 40)));
                if (std::find(transports.begin(), transports.end(), kind) != transports.end()) continue;
                transports.push_back(kind);
                first_byte_.push_back(index_of(kind + std::string(first_byte_suffix)));
                last_byte_.push_back(index_of(kind + std::string(last_byte_suffix)));
            }
        lateness_ = index_of(lateness_column);
    }

    /// Throws InputError with line `number` and column.
    [[nodiscard]] TimingRow parse(std::string_view line, std::size_t number) const {
        const std::vector<std::string_view> fields = split(line);
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
        row.frame_id = static_cast<std::uint64_t>(whole(frame_id_));
        row.trigger_id = static_cast<std::uint64_t>(whole(trigger_id_));
        for (std::size_t i = 0; i < numbers_.size(); ++i)
            row.*number_columns[i].value = whole(numbers_[i]);
        for (std::size_t i = 0; i < transports.size(); ++i) {
            row.first_byte.push_back(whole(first_byte_[i]));
            row.last_byte.push_back(whole(last_byte_[i]));
        }
        if (fields.size() != titles_.size()) refuse(number, std::min(fields.size(), titles_.size()) - 1);
        row.row_lateness_us = lateness_of(fields[lateness_], number);
        return row;
    }

    std::vector<std::string> transports; ///< kinds

private:
    [[nodiscard]] std::size_t index_of(std::string_view title) const {
        const auto found = std::find(titles_.begin(), titles_.end(), title);
        if (found == titles_.end())
            throw InputError(fmt::format("{}:1: column {} is missing, allowed are the columns that obscurad "
                                         "--timing writes",
                                         name_, title));
        return static_cast<std::size_t>(found - titles_.begin());
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
            if (!good || values.size() == most_rows) refuse(number, lateness_);
            values.push_back(us);
            at = rest == end ? end : rest + 1;
        }
        return values;
    }
    [[noreturn]] void refuse(std::size_t line, std::size_t column) const {
        throw InputError(fmt::format("{}:{}: column {} is no whole number, allowed are the {} columns that "
                                     "obscurad --timing writes",
                                     name_, line, column + 1, titles_.size()));
    }

    const std::string& name_;
    std::vector<std::string_view> titles_;
    std::size_t frame_id_ = 0, trigger_id_ = 0, lateness_ = 0;
    std::vector<std::size_t> numbers_, first_byte_, last_byte_;
};

struct Span {
    const char* name;
    const char* key;
    std::int64_t TimingRow::*from;
    std::int64_t TimingRow::*to;
};

constexpr Span spans[] = {
    {"edge to seen", "edge_to_seen", &TimingRow::edge, &TimingRow::seen},
    {"seen to pose", "seen_to_pose", &TimingRow::seen, &TimingRow::pose},
    {"pose to render begin", "pose_to_render_begin", &TimingRow::pose, &TimingRow::render_begin},
    {"rendering", "rendering", &TimingRow::render_begin, &TimingRow::render_end},
    {"render end to detector end", "render_end_to_detector_end", &TimingRow::render_end,
     &TimingRow::detector_end},
    {"first row after its time", "first_row_lateness", &TimingRow::due, &TimingRow::first},
    {"last row after its time", "last_row_lateness", &TimingRow::last_due, &TimingRow::last},
    {"edge to first row", "edge_to_first_row", &TimingRow::edge, &TimingRow::first},
    {"edge to last row", "edge_to_last_row", &TimingRow::edge, &TimingRow::last},
};

double quantile(const std::vector<double>& sorted, double q) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
    return sorted[std::max<std::size_t>(rank, 1) - 1];
}

double to_us(std::int64_t ns) {
    return static_cast<double>(ns) * 1e-3;
}

SpanFigures figures_of(std::string name, std::string key, std::vector<double> values) {
    SpanFigures f;
    f.name = std::move(name);
    f.key = std::move(key);
    std::sort(values.begin(), values.end());
    f.count = values.size();
    if (f.count > 0) {
        f.p50 = quantile(values, 0.5);
        f.p90 = quantile(values, 0.9);
        f.p99 = quantile(values, 0.99);
        f.max = values.back();
    }
    for (const double us : values) {
        const auto bucket = std::lower_bound(bucket_ends_us.begin(), bucket_ends_us.end(), us);
        ++f.histogram[static_cast<std::size_t>(bucket - bucket_ends_us.begin())];
    }
    f.values = std::move(values);
    return f;
}

std::string in_time_units(double us) {
    return us < 1e3   ? fmt::format("{:g} us", us)
           : us < 1e6 ? fmt::format("{:g} ms", us * 1e-3)
                      : fmt::format("{:g} s", us * 1e-6);
}

} // namespace

TimingFile read_timing(std::istream& in, const std::string& name) {
    std::string header;
    std::getline(in, header);
    const Columns columns(header, name);
    TimingFile file;
    file.transports = columns.transports;
    std::string line;
    for (std::size_t number = 2; std::getline(in, line); ++number)
        file.rows.push_back(columns.parse(line, number));
    return file;
}

std::vector<SpanFigures> span_figures(const TimingFile& file) {
    const std::vector<TimingRow>& rows = file.rows;
    std::vector<SpanFigures> all;
    const auto add = [&](std::string name, std::string key, const auto& from, const auto& to) {
        std::vector<double> values;
        for (const TimingRow& row : rows)
            if (from(row) != 0 && to(row) != 0) values.push_back(to_us(to(row) - from(row)));
        all.push_back(figures_of(std::move(name), std::move(key), std::move(values)));
    };
    for (const Span& span : spans)
        add(
            span.name, span.key, [&](const TimingRow& row) { return row.*span.from; },
            [&](const TimingRow& row) { return row.*span.to; });
    std::vector<double> lateness_us;
    for (const TimingRow& row : rows)
        lateness_us.insert(lateness_us.end(), row.row_lateness_us.begin(), row.row_lateness_us.end());
    all.push_back(figures_of("each row after its time", "row_lateness", std::move(lateness_us)));
    for (std::size_t t = 0; t < file.transports.size(); ++t) {
        const bool used = std::any_of(rows.begin(), rows.end(),
                                      [t](const TimingRow& row) { return row.first_byte[t] != 0; });
        if (!used) continue;
        const auto edge = [](const TimingRow& row) { return row.edge; };
        const std::string& name = file.transports[t];
        add("edge to first byte, " + name, "edge_to_first_byte_" + name, edge,
            [t](const TimingRow& row) { return row.first_byte[t]; });
        add("edge to last byte, " + name, "edge_to_last_byte_" + name, edge,
            [t](const TimingRow& row) { return row.last_byte[t]; });
    }
    return all;
}

std::int64_t lateness(const TimingRow& row) noexcept {
    if (row.late_rows == 0) return 0;
    return row.last != 0 ? std::max<std::int64_t>(0, row.last - row.last_due) : row.worst_row;
}

std::string reason(const TimingRow& row) {
    if (row.late_rows == 0) return "in time";
    if (row.last == 0 || row.detector_end == 0)
        return fmt::format("given up with {} of {} rows late", row.late_rows, row.rows);
    const std::pair<std::int64_t, const char*> parts[] = {
        {row.seen - row.edge, "the edge was seen late"},
        {row.pose - row.seen, "wait for earlier frames"},
        {row.render_begin - row.pose, "wait for rendering"},
        {row.render_end - row.render_begin, "rendering"},
        {row.detector_end - row.render_end, "the detector"},
        {row.last - std::max(row.detector_end, row.last_due), "the release"},
    };
    const auto most = *std::max_element(std::begin(parts), std::end(parts));
    return fmt::format("{}, {:.3f} ms", most.second, static_cast<double>(most.first) * 1e-6);
}

std::vector<TimingRow> worst(std::span<const TimingRow> rows, std::size_t count) {
    std::vector<TimingRow> sorted(rows.begin(), rows.end());
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const TimingRow& a, const TimingRow& b) { return lateness(a) > lateness(b); });
    sorted.resize(std::min(sorted.size(), count));
    return sorted;
}

std::string timing_text(const TimingFile& file) {
    const std::vector<TimingRow>& rows = file.rows;
    const auto late =
        std::count_if(rows.begin(), rows.end(), [](const TimingRow& r) { return r.late_rows > 0; });
    const std::vector<SpanFigures> figures = span_figures(file);
    std::string out =
        fmt::format("{} frames, {} with late rows\n\n{:<30} {:>8} {:>12} {:>12} {:>12} {:>12}\n", rows.size(),
                    late, "microseconds", "count", "p50", "p90", "p99", "max");
    for (const SpanFigures& f : figures)
        out += f.count > 0
                   ? fmt::format("{:<30} {:>8} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f}\n", f.name, f.count,
                                 f.p50, f.p90, f.p99, f.max)
                   : fmt::format("{:<30} {:>8} {:>12} {:>12} {:>12} {:>12}\n", f.name, 0, "-", "-", "-", "-");
    // One column per decade, and a last column for longer values.
    out += fmt::format("\n{:<30}", "histogram: up to");
    for (std::size_t i = 0; i < bucket_ends_us.size(); i += 3)
        out += fmt::format(" {:>8}", in_time_units(bucket_ends_us[i]));
    out += fmt::format(" {:>8}\n", "more");
    for (const SpanFigures& f : figures) {
        if (f.count == 0) continue;
        out += fmt::format("{:<30}", f.name);
        for (std::size_t i = 0, from = 0; from < f.histogram.size(); from = i + 1, i += 3) {
            const std::size_t to = std::min(i + 1, f.histogram.size());
            out +=
                fmt::format(" {:>8}", std::accumulate(f.histogram.begin() + static_cast<std::ptrdiff_t>(from),
                                                      f.histogram.begin() + static_cast<std::ptrdiff_t>(to),
                                                      std::size_t{0}));
        }
        out += '\n';
    }
    out += fmt::format("\nThe worst frames\n{:>8} {:>12} {:>10} {:>10}  {}\n", "frame", "late, ms",
                       "late rows", "worst row", "why");
    for (const TimingRow& row : worst(rows, worst_count))
        out += fmt::format("{:>8} {:>12.3f} {:>10} {:>10}  {}\n", row.frame_id,
                           static_cast<double>(lateness(row)) * 1e-6, row.late_rows, row.worst_row_number,
                           reason(row));
    return out;
}

std::string timing_csv(const TimingFile& file) {
    const std::vector<TimingRow>& rows = file.rows;
    std::string out = "span,count,p50_us,p90_us,p99_us,max_us";
    for (const double end : bucket_ends_us)
        out += fmt::format(",to_{:g}_us", end);
    out += ",more\n";
    for (const SpanFigures& f : span_figures(file))
        out += fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.3f},{}\n", f.key, f.count, f.p50, f.p90, f.p99,
                           f.max, fmt::join(f.histogram, ","));
    out += "\nframe_id,late_us,late_rows,worst_row,why\n";
    for (const TimingRow& row : worst(rows, worst_count))
        out += fmt::format("{},{:.3f},{},{},\"{}\"\n", row.frame_id, to_us(lateness(row)), row.late_rows,
                           row.worst_row_number, reason(row));
    return out;
}

std::string timing_svg(const TimingFile& file) {
    const std::vector<TimingRow>& rows = file.rows;
    // 1 us to 10 s over 700 px, 100 px a decade; fractions of the frames over 400 px; the worst frames below.
    constexpr double left = 60, top = 30, decade = 100, height = 400;
    constexpr const char* colours[] = {"#4477aa", "#66ccee", "#228833", "#ccbb44",
                                       "#ee6677", "#aa3377", "#999999", "#000000"};
    const auto x_of = [](double us) {
        return left + decade * std::clamp(std::log10(std::max(us, 1.0)), 0.0, 7.0);
    };
    const auto y_of = [](double part) { return top + height * (1 - part); };
    std::string out =
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1040\" height=\"670\" font-family=\"sans-serif\" "
        "font-size=\"12\">\n<rect width=\"1040\" height=\"670\" fill=\"white\"/>\n";
    constexpr const char* marks[] = {"1 us", "10 us", "100 us", "1 ms", "10 ms", "100 ms", "1 s", "10 s"};
    for (int i = 0; i <= 7; ++i) {
        const double x = left + decade * i;
        out += fmt::format("<line x1=\"{0}\" y1=\"{1}\" x2=\"{0}\" y2=\"{2}\" stroke=\"#dddddd\"/>\n"
                           "<text x=\"{0}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>\n",
                           x, top, top + height, top + height + 18, marks[i]);
    }
    for (const double part : {0.0, 0.5, 0.9, 0.99, 1.0})
        out += fmt::format("<line x1=\"{0}\" y1=\"{1:.1f}\" x2=\"{2}\" y2=\"{1:.1f}\" stroke=\"#dddddd\"/>\n"
                           "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:g} %</text>\n",
                           left, y_of(part), left + 7 * decade, left - 6, y_of(part) + 4, part * 100);
    const std::vector<SpanFigures> figures = span_figures(file);
    for (std::size_t s = 0; s < figures.size(); ++s) {
        const SpanFigures& f = figures[s];
        const char* const colour = colours[s % std::size(colours)];
        const char* const dashes = s < std::size(colours)       ? "none"
                                   : s < 2 * std::size(colours) ? "6 3"
                                                                : "2 2";
        out += fmt::format("<text x=\"780\" y=\"{}\" fill=\"{}\">{}</text>\n",
                           top + 20 * static_cast<double>(s) + 12, colour, f.name);
        if (f.count == 0) continue;
        out += fmt::format("<polyline fill=\"none\" stroke-width=\"1.5\" stroke-dasharray=\"{}\" "
                           "stroke=\"{}\" points=\"",
                           dashes, colour);
        // Draw at most a few hundred points, whatever the count of frames.
        const std::size_t step = std::max<std::size_t>(1, f.count / 500);
        for (std::size_t i = 0; i < f.count; i += step)
            out += fmt::format("{:.1f},{:.1f} ", x_of(f.values[i]),
                               y_of(static_cast<double>(i + 1) / static_cast<double>(f.count)));
        out += fmt::format("{:.1f},{:.1f}\"/>\n", x_of(f.max), y_of(1));
    }
    double y = top + height + 50;
    for (const TimingRow& row : worst(rows, worst_count)) {
        out += fmt::format(
            "<text x=\"{}\" y=\"{}\">frame {}: {:.3f} ms late, {} rows, the worst row {}; {}</text>\n", left,
            y, row.frame_id, static_cast<double>(lateness(row)) * 1e-6, row.late_rows, row.worst_row_number,
            reason(row));
        y += 18;
    }
    return out + "</svg>\n";
}

} // namespace obscura::tools
