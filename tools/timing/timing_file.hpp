// SPDX-License-Identifier: Apache-2.0
// Timing file of a run, as obscurad --timing writes it.
#pragma once

#include <cstdint>
#include <iosfwd>
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

    // What older files do not have is 0, but for the acquisition.
    std::int64_t acquisition = 0; ///< from 1
    std::int64_t min_period = 0;  ///< of the chip, from one frame to the next
    std::int64_t width = 0, height = 0;
    std::int64_t render_threads = 0, render_cores = 0;
    std::int64_t samples_per_pixel = 0, target_error_ppm = 0, max_instants = 0; ///< settings
    /// Parts of rendering, sums over the render threads in ns; see renderer::RenderPart.
    std::int64_t setup = 0, sampling = 0, grid = 0, wings = 0, points = 0, rest = 0;
    std::int64_t measured = 0, measured_cpu = 0; ///< see renderer::RenderWork
    std::int64_t preemptions = 0;
    std::int64_t rendered_rows = 0, row_instants = 0; ///< rows, and the sum of their instants
    std::int64_t samples = 0, rays = 0;
    std::int64_t detector_wait = 0, detector = 0, ahead = 0, ahead_error = 0; ///< see emulator::FrameWork
    std::int64_t level_max = 0, rows_degraded = 0, quality_reasons = 0;       ///< see FrameQuality
    std::int64_t error_ppm = 0, budget_us = 0, spent_us = 0, margin_us = 0;
    std::int64_t error_worst_ppm = 0, error_goal_ppm = 0, noise_ratio_ppm = 0, unknown_ppm = 0;
    std::int64_t page_faults = 0;   ///< see renderer::RenderWork
    std::int64_t stalled_rows = 0;  ///< see emulator::ReleaseCounters
    std::string levels;             ///< a digit for each group of rows: QualityLevel
    std::vector<std::int64_t> pace; ///< see Transport::pace_ns(), by TimingFile::transports
};

struct TimingFile {
    std::vector<std::string> transports; ///< kinds, in the order of the file's columns
    std::vector<TimingRow> rows;
};

/// Reads columns by their names in the first line, in any order; columns that it does not know are left out.
/// Throws InputError with file and line; it names a column that is missing. `name` is used in messages.
[[nodiscard]] TimingFile read_timing(std::istream& in, const std::string& name);

/// The frames of each acquisition, in the order of the file.
[[nodiscard]] std::vector<TimingFile> acquisitions(const TimingFile& file);

} // namespace obscura::tools
