// Makes sense of the stamps that obscurad --timing wrote: spans, their spread, the worst frames and why.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// One frame of the file; times in ns of the scheduling clock, 0 where a stamp was not reached.
struct TimingRow {
    std::uint64_t frame_id = 0, trigger_id = 0;
    std::int64_t edge = 0, seen = 0, render_begin = 0, render_end = 0, detector_end = 0;
    std::int64_t due = 0, first = 0, last_due = 0, last = 0;
    std::int64_t rows = 0, late_rows = 0, worst_row = 0, flags = 0;
};

/// Throws InputError with file and line. `name` is used in messages.
[[nodiscard]] std::vector<TimingRow> read_timing(std::istream& in, const std::string& name);

/// The spread of one span over all frames that have it, microseconds.
struct SpanFigures {
    std::string name; ///< "trigger to first row" and so on
    std::string key;  ///< "trigger_to_first_row"
    std::size_t count = 0;
    double p50 = 0, p90 = 0, p99 = 0, max = 0;
    std::vector<double> values; ///< sorted
};
[[nodiscard]] std::vector<SpanFigures> span_figures(std::span<const TimingRow> rows);

/// How far a frame's last row missed its time, ns: 0 when it was in time.
[[nodiscard]] std::int64_t lateness(const TimingRow& row) noexcept;
/// What took the time, of a frame that was late; "in time" for others.
[[nodiscard]] std::string reason(const TimingRow& row);
/// The `count` latest frames, latest first.
[[nodiscard]] std::vector<TimingRow> worst(std::span<const TimingRow> rows, std::size_t count);

/// The table for people, with the ten worst frames.
[[nodiscard]] std::string timing_text(std::span<const TimingRow> rows);
/// One line a span: key,count,p50_us,p90_us,p99_us,max_us.
[[nodiscard]] std::string timing_csv(std::span<const TimingRow> rows);
/// Cumulative distributions of all spans over a logarithmic time axis, as an SVG picture.
[[nodiscard]] std::string timing_svg(std::span<const TimingRow> rows);

} // namespace obscura::tools
