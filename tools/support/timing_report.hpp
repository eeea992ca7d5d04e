// SPDX-License-Identifier: Apache-2.0
// Report on the timing file of a run (obscurad --timing): spans, quantiles, the worst frames and why.
#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// One frame of a timing file. Times in ns of the scheduling clock; 0 if the frame did not reach that stage.
struct TimingRow {
    std::uint64_t frame_id = 0, trigger_id = 0;
    std::int64_t edge = 0, seen = 0, pose = 0, render_begin = 0, render_end = 0, detector_end = 0;
    std::int64_t due = 0, first = 0, last_due = 0, last = 0;
    std::int64_t rows = 0, late_rows = 0, worst_row = 0, worst_row_number = 0, flags = 0;
    std::vector<std::int64_t> first_byte, last_byte; ///< transmit times, by TimingFile::transports
    std::vector<std::int32_t> row_lateness_us;       ///< how long after its time each row left
};

struct TimingFile {
    std::vector<std::string> transports; ///< kinds, in the order of the file's columns
    std::vector<TimingRow> rows;
};

/// Reads columns by their names in the first line, in any order; columns that it does not know are left out.
/// Throws InputError with file and line; it names a column that is missing. `name` is used in messages.
[[nodiscard]] TimingFile read_timing(std::istream& in, const std::string& name);

/// Upper limits of the histogram buckets in microseconds; one more bucket holds longer values.
constexpr std::array bucket_ends_us{1.,  2.,  5.,  1e1, 2e1, 5e1, 1e2, 2e2, 5e2, 1e3,
                                    2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6};

/// Distribution of one latency over all frames (or rows) that have it, in microseconds.
struct SpanFigures {
    std::string name; ///< "trigger to first row" and so on
    std::string key;  ///< "trigger_to_first_row"
    std::size_t count = 0;
    double p50 = 0, p90 = 0, p99 = 0, max = 0;
    std::array<std::size_t, bucket_ends_us.size() + 1> histogram{};
    std::vector<double> values; ///< sorted
};
[[nodiscard]] std::vector<SpanFigures> span_figures(const TimingFile& file);

/// Lateness of the last row of a frame in ns; 0 if it was in time.
[[nodiscard]] std::int64_t lateness(const TimingRow& row) noexcept;
/// Stage that took the longest in a late frame, with its duration; "in time" for other frames.
[[nodiscard]] std::string reason(const TimingRow& row);
/// The `count` frames of largest lateness, in descending order.
[[nodiscard]] std::vector<TimingRow> worst(std::span<const TimingRow> rows, std::size_t count);

/// Text tables: quantiles, histograms, the ten worst frames and why.
[[nodiscard]] std::string timing_text(const TimingFile& file);
/// CSV with one line per latency: key, count, quantiles and histogram; after an empty line the ten worst
/// frames.
[[nodiscard]] std::string timing_csv(const TimingFile& file);
/// SVG picture: cumulative distributions of all latencies over a logarithmic time axis, and the ten worst
/// frames.
[[nodiscard]] std::string timing_svg(const TimingFile& file);

} // namespace obscura::tools
