// SPDX-License-Identifier: Apache-2.0
#include "tools/timing/quality_replay.hpp"

#include "core/error.hpp"
#include "tools/timing/timing_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace obscura::tools {

QualityReplay::QualityReplay(const std::string& file, const ReadoutAnswer& readout) {
    if (file.empty()) return;
    std::ifstream in(file);
    if (!in) throw InputError(fmt::format("{}: cannot be opened", file), errno);
    const std::vector<TimingFile> runs = acquisitions(read_timing(in, file));
    if (runs.empty())
        throw InputError(fmt::format("{}: no frames, allowed is the timing file of a run", file));
    std::int32_t height = 0;
    for (std::uint32_t w = 0; w < readout.window_count; ++w)
        height = std::max(height, readout.windows[w].image_y + readout.windows[w].sensor.height);
    const std::int32_t group_rows = FrameQuality::group_rows_for(height);
    const auto groups = static_cast<std::size_t>((height + group_rows - 1) / group_rows);
    bool whole_before = false; // some frame before this one has no rows of an earlier one
    double whole_error_px = 0; // how far that one is from where things were
    for (const TimingRow& row : runs.back().rows) {
        bool earlier = false;
        if (!row.levels.empty() && row.levels.size() != groups)
            throw InputError(fmt::format(
                "{}: frame {}: {} levels, allowed are {}: one for each {} rows of the configured image", file,
                row.frame_id, row.levels.size(), groups, group_rows));
        for (const char digit : row.levels) {
            const auto level = static_cast<QualityLevel>(digit - '0');
            if (level > QualityLevel::repeated)
                throw InputError(fmt::format("{}: frame {}: level {}, allowed are 0 to {}", file,
                                             row.frame_id, digit, static_cast<int>(QualityLevel::repeated)));
            earlier = earlier || level >= QualityLevel::reprojected;
            levels_[row.frame_id].push_back(level);
        }
        if (!earlier) {
            whole_before = true;
            whole_error_px = row.ahead_error_px;
            continue;
        }
        needs_earlier_ = true;
        if (!whole_before)
            throw InputError(fmt::format(
                "{}: frame {}: rows of an earlier frame, allowed is a file with a frame before it that has none",
                file, row.frame_id));
        if (row.ahead_error_px > 0 || whole_error_px > 0)
            throw InputError(fmt::format(
                "{}: frame {}: rows of a rendering for another instant than that of the trigger, allowed are exact predictions",
                file, row.frame_id));
    }
}

std::span<const QualityLevel> QualityReplay::of(std::uint64_t frame_id) const {
    const auto found = levels_.find(frame_id);
    return found == levels_.end() ? std::span<const QualityLevel>{} : found->second;
}

} // namespace obscura::tools
