// SPDX-License-Identifier: Apache-2.0
// Report on the timing file of a run (obscurad --timing): spans, quantiles, the worst frames and why.
#pragma once

#include "core/realtime/latency_histogram.hpp"
#include "tools/timing/timing_causes.hpp"
#include "tools/timing/timing_file.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// Distribution of one latency over all frames (or rows) that have it, in microseconds.
struct SpanFigures {
    std::string name; ///< "trigger to first row" and so on
    std::string key;  ///< "trigger_to_first_row"
    std::size_t count = 0;
    double p50 = 0, p90 = 0, p99 = 0, max = 0;
    std::array<std::size_t, latency_bounds_us.size() + 1> histogram{}; ///< shown_bucket_of()
    std::vector<double> values;                                        ///< sorted
};
[[nodiscard]] std::vector<SpanFigures> span_figures(const TimingFile& file);

/// The `count` frames of largest lateness, in descending order.
[[nodiscard]] std::vector<TimingRow> worst(std::span<const TimingRow> rows, std::size_t count);

/// Text tables for each acquisition: quantiles, histograms, the ten worst frames and why, where the time of
/// the late frames went, what would help, and degraded frames by their reasons, with `degraded` one by one.
[[nodiscard]] std::string timing_text(const TimingFile& file, bool degraded = false);
/// The same as CSV tables with an empty line between them, with the acquisition in the first column: the
/// fifth has each degraded frame.
[[nodiscard]] std::string timing_csv(const TimingFile& file);
/// SVG picture: for each acquisition the cumulative distributions of all latencies over a logarithmic time
/// axis, and the ten worst frames.
[[nodiscard]] std::string timing_svg(const TimingFile& file);

} // namespace obscura::tools
