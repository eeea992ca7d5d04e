// SPDX-License-Identifier: Apache-2.0
#include "tools/timing/timing_report.hpp"

#include "core/camera/frame.hpp"
#include "core/text/text.hpp"
#include "tools/timing/timing_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::size_t worst_count = 10;

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

SpanFigures report_figures(std::string name, std::string key, std::vector<double> values) {
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
    for (const double us : values)
        ++f.histogram[shown_bucket_of(us)];
    f.values = std::move(values);
    return f;
}

std::string csv_text(const std::string& text) {
    std::string out = "\"";
    for (const char c : text)
        out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + '"';
}

std::string in_time_units(double us) {
    return us < 1e3   ? fmt::format("{:g} us", us)
           : us < 1e6 ? fmt::format("{:g} ms", us * 1e-3)
                      : fmt::format("{:g} s", us * 1e-6);
}

} // namespace

std::vector<SpanFigures> span_figures(const TimingFile& file) {
    const std::vector<TimingRow>& rows = file.rows;
    std::vector<SpanFigures> all;
    const auto add = [&](std::string name, std::string key, const auto& from, const auto& to) {
        std::vector<double> values;
        for (const TimingRow& row : rows)
            if (from(row) != 0 && to(row) != 0) values.push_back(to_us(to(row) - from(row)));
        all.push_back(report_figures(std::move(name), std::move(key), std::move(values)));
    };
    for (const Span& span : spans)
        add(
            span.name, span.key, [&](const TimingRow& row) { return row.*span.from; },
            [&](const TimingRow& row) { return row.*span.to; });
    std::vector<double> lateness_us;
    for (const TimingRow& row : rows)
        lateness_us.insert(lateness_us.end(), row.row_lateness_us.begin(), row.row_lateness_us.end());
    all.push_back(report_figures("each row after its time", "row_lateness", std::move(lateness_us)));
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

std::vector<TimingRow> worst(std::span<const TimingRow> rows, std::size_t count) {
    std::vector<TimingRow> sorted(rows.begin(), rows.end());
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const TimingRow& a, const TimingRow& b) { return lateness(a) > lateness(b); });
    sorted.resize(std::min(sorted.size(), count));
    return sorted;
}

namespace {

/// The frames whose causes are worth a table: the late ones, or all if none is late.
std::vector<TimingRow> judged(const TimingFile& file) {
    std::vector<TimingRow> late;
    std::copy_if(file.rows.begin(), file.rows.end(), std::back_inserter(late),
                 [](const TimingRow& row) { return row.late_rows > 0 && row.last != 0; });
    return late.empty() ? file.rows : late;
}

std::string causes_text(const TimingFile& file) {
    const std::vector<TimingRow> frames = judged(file);
    const std::vector<TimePart> parts = time_parts(frames);
    if (parts.empty()) return {};
    std::string out = fmt::format("\nWhere the time of {} went, mean\n{:>10}  {:<34}  {}\n",
                                  frames.front().late_rows > 0 ? "late frames" : "frames (none was late)",
                                  "ms", "part", "set by");
    for (const TimePart& part : parts)
        out += fmt::format("{:>10.3f}  {:<34}  {}\n", part.ms, part.name, part.setting);
    const std::vector<Cure> help = cures(frames);
    if (!help.empty()) out += "\nWhat would help, each alone\n";
    for (const Cure& cure : help)
        out += fmt::format("  {}\n", cure.text());
    const std::vector<std::string> more = remarks(file);
    if (!more.empty()) out += '\n';
    for (const std::string& line : more)
        out += line + '\n';
    return out;
}

/// Says what the system cost, apart from what rendering cost; empty if nothing.
std::string stalled_text(const std::vector<TimingRow>& rows) {
    std::int64_t frames = 0, stalled = 0;
    for (const TimingRow& row : rows) {
        frames += row.stalled_rows > 0 ? 1 : 0;
        stalled += row.stalled_rows;
    }
    if (stalled == 0) return {};
    return fmt::format(
        "{} rows of {} frames were ready in time and left more than {} ms late: the system did not run the thread that releases them, or the frame before was still being released\n"
        "(real-time priority, a core without rendering (threads.render_cores) or, with quality = \"adapt\", a larger deadline.reserve_us helps)\n",
        stalled, frames, release_stall_ns / ns_per_ms);
}

std::string acquisition_text(const TimingFile& file, bool degraded) {
    const std::vector<TimingRow>& rows = file.rows;
    const auto late =
        std::count_if(rows.begin(), rows.end(), [](const TimingRow& r) { return r.late_rows > 0; });
    const std::vector<SpanFigures> figures = span_figures(file);
    std::string out = fmt::format("{} frames, {} with late rows\n", rows.size(), late);
    out += stalled_text(rows);
    out += fmt::format("\n{:<30} {:>8} {:>12} {:>12} {:>12} {:>12}\n", "microseconds", "count", "p50", "p90",
                       "p99", "max");
    for (const SpanFigures& f : figures)
        out += f.count > 0
                   ? fmt::format("{:<30} {:>8} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f}\n", f.name, f.count,
                                 f.p50, f.p90, f.p99, f.max)
                   : fmt::format("{:<30} {:>8} {:>12} {:>12} {:>12} {:>12}\n", f.name, 0, "-", "-", "-", "-");
    // One column per decade, and a last column for longer values.
    out += fmt::format("\n{:<30}", "histogram: up to");
    for (std::size_t i = 0; i < latency_bounds_us.size(); i += 3)
        out += fmt::format(" {:>8}", in_time_units(latency_bounds_us[i]));
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
    return out + causes_text(file) + degraded_text(file.rows, degraded);
}

} // namespace

std::string timing_text(const TimingFile& file, bool degraded) {
    const std::vector<TimingFile> all = acquisitions(file);
    if (all.size() < 2) return acquisition_text(file, degraded);
    std::string out;
    for (const TimingFile& one : all)
        out += fmt::format("{}Acquisition {}\n\n{}", out.empty() ? "" : "\n\n", one.rows.front().acquisition,
                           acquisition_text(one, degraded));
    return out;
}

std::string timing_csv(const TimingFile& file) {
    const std::vector<TimingFile> all = acquisitions(file);
    std::string out = "acquisition,span,count,p50_us,p90_us,p99_us,max_us";
    for (const double end : latency_bounds_us)
        out += fmt::format(",to_{:g}_us", end);
    out += ",more\n";
    for (const TimingFile& one : all)
        for (const SpanFigures& f : span_figures(one))
            out += fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{}\n", one.rows.front().acquisition,
                               f.key, f.count, f.p50, f.p90, f.p99, f.max, fmt::join(f.histogram, ","));
    out += "\nacquisition,frame_id,late_us,late_rows,worst_row,why\n";
    for (const TimingFile& one : all)
        for (const TimingRow& row : worst(one.rows, worst_count))
            out += fmt::format("{},{},{:.3f},{},{},{}\n", row.acquisition, row.frame_id, to_us(lateness(row)),
                               row.late_rows, row.worst_row_number, csv_text(reason(row)));
    out += "\nacquisition,part,ms,set_by\n";
    for (const TimingFile& one : all)
        for (const TimePart& part : time_parts(judged(one)))
            out += fmt::format("{},{},{:.3f},{}\n", one.rows.front().acquisition, csv_text(part.name),
                               part.ms, csv_text(part.setting));
    out += "\nacquisition,cause,ms,of_ms,with_ms,cure\n";
    for (const TimingFile& one : all)
        for (const Cure& cure : cures(judged(one)))
            out +=
                fmt::format("{},{},{:.3f},{:.3f},{:.3f},{}\n", one.rows.front().acquisition,
                            csv_text(cure.cause), cure.ms, cure.of_ms, cure.with_ms, csv_text(cure.advice));
    return out + '\n' + degraded_csv(file.rows);
}

namespace {

constexpr double panel_height = 850;

/// Curves and worst frames of one acquisition.
std::string panel(const TimingFile& file) {
    const std::vector<TimingRow>& rows = file.rows;
    // 1 us to 10 s over 700 px, 100 px a decade; fractions of the frames over 400 px; the worst frames below.
    constexpr double left = 60, top = 30, decade = 100, height = 400;
    constexpr const char* colours[] = {"#4477aa", "#66ccee", "#228833", "#ccbb44",
                                       "#ee6677", "#aa3377", "#999999", "#000000"};
    const auto x_of = [](double us) {
        return left + decade * std::clamp(std::log10(std::max(us, 1.0)), 0.0, 7.0);
    };
    const auto y_of = [](double part) { return top + height * (1 - part); };
    std::string out;
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
        out += fmt::format(
            "<polyline fill=\"none\" stroke-width=\"1.5\" stroke-dasharray=\"{}\" stroke=\"{}\" points=\"",
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
        // The cure stands on a line of its own, which the picture is wide enough for.
        const std::string why = escaped_xml(reason(row));
        const std::size_t cure = std::min(why.find("; "), why.size());
        out += fmt::format(
            "<text x=\"{}\" y=\"{}\">frame {}: {:.3f} ms late, {} rows, the worst row {}; {}</text>\n", left,
            y, row.frame_id, static_cast<double>(lateness(row)) * 1e-6, row.late_rows, row.worst_row_number,
            why.substr(0, cure));
        if (cure < why.size())
            out += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"#555555\">{}</text>\n", left + 20, y + 15,
                               why.substr(cure + 2));
        y += 36;
    }
    return out;
}

} // namespace

std::string timing_svg(const TimingFile& file) {
    const std::vector<TimingFile> all = acquisitions(file);
    const double height = panel_height * static_cast<double>(std::max<std::size_t>(1, all.size()));
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1040\" height=\"{0:g}\" font-family=\"sans-serif\" font-size=\"12\">\n"
        "<rect width=\"1040\" height=\"{0:g}\" fill=\"white\"/>\n",
        height);
    if (all.size() < 2) return out + panel(file) + "</svg>\n";
    for (std::size_t i = 0; i < all.size(); ++i)
        out += fmt::format("<g transform=\"translate(0,{:g})\">\n"
                           "<text x=\"60\" y=\"20\" font-weight=\"bold\">Acquisition {}</text>\n"
                           "{}</g>\n",
                           panel_height * static_cast<double>(i), all[i].rows.front().acquisition,
                           panel(all[i]));
    return out + "</svg>\n";
}

} // namespace obscura::tools
