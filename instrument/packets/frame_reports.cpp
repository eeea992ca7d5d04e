// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/frame_reports.hpp"

#include <algorithm>
#include <optional>

namespace obscura::instrument {
namespace {

/// The frame of a row, as far as there are columns for it.
FrameRecord record_of(const TimingAnswer& answer, std::size_t row) {
    FrameRecord frame;
    const auto& numbers = answer.rows[row];
    for (std::size_t i = 0; i < std::min(answer.columns.size(), numbers.size()); ++i)
        for (const TimingColumn& column : timing_columns())
            if (numbers[i] && column.name == answer.columns[i]) column.set(frame, *numbers[i]);
    return frame;
}

std::optional<std::uint32_t> saturated_of(const TimingAnswer& answer, std::size_t row) {
    const auto found = std::find(answer.columns.begin(), answer.columns.end(), "saturated");
    const auto place = static_cast<std::size_t>(found - answer.columns.begin());
    const auto& numbers = answer.rows[row];
    if (found == answer.columns.end() || place >= numbers.size() || !numbers[place]) return std::nullopt;
    return static_cast<std::uint32_t>(*numbers[place]);
}

} // namespace

std::vector<FrameReport> FrameReports::take(std::uint32_t camera, const TimingAnswer& answer,
                                            std::int64_t tai_offset_ns) {
    std::vector<FrameReport> reports;
    if (after_ && answer.last > *after_) {
        const std::uint64_t fresh = answer.last - *after_;
        // An answer has no more rows than that; one that had would be of another daemon.
        const std::size_t count = std::min<std::uint64_t>(fresh, answer.rows.size());
        for (std::size_t i = answer.rows.size() - count; i < answer.rows.size(); ++i) {
            FrameReport& report = reports.emplace_back();
            report.camera = camera;
            report.frame = record_of(answer, i);
            report.tai_offset_ns = tai_offset_ns;
            report.saturated = saturated_of(answer, i);
        }
        if (!reports.empty()) reports.front().lost_before = fresh - count;
    }
    if (!after_ || answer.last > *after_) after_ = answer.last;
    return reports;
}

} // namespace obscura::instrument
