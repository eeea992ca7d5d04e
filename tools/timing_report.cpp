#include "tools/timing_report.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <istream>

namespace obscura::tools {
namespace {

constexpr const char* expected_header =
    "frame_id,trigger_id,edge_ns,seen_ns,render_begin_ns,render_end_ns,detector_end_ns,due_ns,first_ns,"
    "last_due_ns,last_ns,rows,late_rows,worst_row_ns,flags";

TimingRow parse_row(const std::string& line, const std::string& name, std::size_t number) {
    std::array<std::int64_t, 15> values{};
    const char* at = line.data();
    const char* const end = line.data() + line.size();
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto [rest, error] = std::from_chars(at, end, values[i]);
        const bool good =
            error == std::errc() && (i + 1 == values.size() ? rest == end : rest != end && *rest == ',');
        if (!good)
            throw InputError(
                fmt::format("{}:{}: column {} is no whole number, allowed are the 15 columns that "
                            "obscurad --timing writes",
                            name, number, i + 1));
        at = rest + 1;
    }
    TimingRow row;
    row.frame_id = static_cast<std::uint64_t>(values[0]);
    row.trigger_id = static_cast<std::uint64_t>(values[1]);
    std::int64_t* const fields[] = {&row.edge,         &row.seen, &row.render_begin, &row.render_end,
                                    &row.detector_end, &row.due,  &row.first,        &row.last_due,
                                    &row.last,         &row.rows, &row.late_rows,    &row.worst_row,
                                    &row.flags};
    for (std::size_t i = 0; i < std::size(fields); ++i)
        *fields[i] = values[i + 2];
    return row;
}

struct Span {
    const char* name;
    const char* key;
    std::int64_t TimingRow::*from;
    std::int64_t TimingRow::*to;
};

constexpr Span spans[] = {
    {"edge to seen", "edge_to_seen", &TimingRow::edge, &TimingRow::seen},
    {"seen to render begin", "seen_to_render_begin", &TimingRow::seen, &TimingRow::render_begin},
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

} // namespace

std::vector<TimingRow> read_timing(std::istream& in, const std::string& name) {
    std::string line;
    if (!std::getline(in, line) || line != expected_header)
        throw InputError(
            fmt::format("{}:1: this is no timing file, allowed is what obscurad --timing writes", name));
    std::vector<TimingRow> rows;
    for (std::size_t number = 2; std::getline(in, line); ++number)
        rows.push_back(parse_row(line, name, number));
    return rows;
}

std::vector<SpanFigures> span_figures(std::span<const TimingRow> rows) {
    std::vector<SpanFigures> all;
    for (const Span& span : spans) {
        SpanFigures f;
        f.name = span.name;
        f.key = span.key;
        for (const TimingRow& row : rows)
            if (row.*span.from != 0 && row.*span.to != 0)
                f.values.push_back(static_cast<double>(row.*span.to - row.*span.from) * 1e-3);
        std::sort(f.values.begin(), f.values.end());
        f.count = f.values.size();
        if (f.count > 0) {
            f.p50 = quantile(f.values, 0.5);
            f.p90 = quantile(f.values, 0.9);
            f.p99 = quantile(f.values, 0.99);
            f.max = f.values.back();
        }
        all.push_back(std::move(f));
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
        {row.render_begin - row.seen, "it waited to be rendered"},
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

std::string timing_text(std::span<const TimingRow> rows) {
    const auto late =
        std::count_if(rows.begin(), rows.end(), [](const TimingRow& r) { return r.late_rows > 0; });
    std::string out =
        fmt::format("{} frames, {} with late rows\n\n{:<28} {:>8} {:>12} {:>12} {:>12} {:>12}\n", rows.size(),
                    late, "microseconds", "frames", "p50", "p90", "p99", "max");
    for (const SpanFigures& f : span_figures(rows))
        out += f.count > 0
                   ? fmt::format("{:<28} {:>8} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f}\n", f.name, f.count,
                                 f.p50, f.p90, f.p99, f.max)
                   : fmt::format("{:<28} {:>8} {:>12} {:>12} {:>12} {:>12}\n", f.name, 0, "-", "-", "-", "-");
    out +=
        fmt::format("\nThe worst frames\n{:>8} {:>12} {:>10}  {}\n", "frame", "late, ms", "late rows", "why");
    for (const TimingRow& row : worst(rows, 10))
        out += fmt::format("{:>8} {:>12.3f} {:>10}  {}\n", row.frame_id,
                           static_cast<double>(lateness(row)) * 1e-6, row.late_rows, reason(row));
    return out;
}

std::string timing_csv(std::span<const TimingRow> rows) {
    std::string out = "span,count,p50_us,p90_us,p99_us,max_us\n";
    for (const SpanFigures& f : span_figures(rows))
        out += fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.3f}\n", f.key, f.count, f.p50, f.p90, f.p99, f.max);
    return out;
}

std::string timing_svg(std::span<const TimingRow> rows) {
    // 1 us to 10 s over 700 px, 100 px a decade; fractions of the frames over 400 px.
    constexpr double left = 60, top = 30, decade = 100, height = 400;
    constexpr const char* colours[] = {"#4477aa", "#66ccee", "#228833", "#ccbb44",
                                       "#ee6677", "#aa3377", "#999999", "#000000"};
    const auto x_of = [](double us) {
        return left + decade * std::clamp(std::log10(std::max(us, 1.0)), 0.0, 7.0);
    };
    const auto y_of = [](double part) { return top + height * (1 - part); };
    std::string out =
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1040\" height=\"490\" font-family=\"sans-serif\" "
        "font-size=\"12\">\n<rect width=\"1040\" height=\"490\" fill=\"white\"/>\n";
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
    const std::vector<SpanFigures> figures = span_figures(rows);
    for (std::size_t s = 0; s < figures.size(); ++s) {
        const SpanFigures& f = figures[s];
        out += fmt::format("<text x=\"780\" y=\"{}\" fill=\"{}\">{}</text>\n",
                           top + 20 * static_cast<double>(s) + 12, colours[s], f.name);
        if (f.count == 0) continue;
        out +=
            fmt::format("<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"{}\" points=\"", colours[s]);
        // At most some hundred points, however many frames.
        const std::size_t step = std::max<std::size_t>(1, f.count / 500);
        for (std::size_t i = 0; i < f.count; i += step)
            out += fmt::format("{:.1f},{:.1f} ", x_of(f.values[i]),
                               y_of(static_cast<double>(i + 1) / static_cast<double>(f.count)));
        out += fmt::format("{:.1f},{:.1f}\"/>\n", x_of(f.max), y_of(1));
    }
    return out + "</svg>\n";
}

} // namespace obscura::tools
