// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/frame_reports.hpp"

#include <algorithm>
#include <string_view>

namespace obscura::instrument {
namespace {

/// Numbers of a row by the names of the columns; what is not there is none.
class RowReader {
public:
    RowReader(const TimingAnswer& answer, std::size_t row, std::int64_t tai_offset_ns)
        : answer_(answer), row_(answer.rows[row]), tai_offset_ns_(tai_offset_ns) {}

    [[nodiscard]] std::optional<std::int64_t> number(std::string_view column) const {
        const auto found = std::find(answer_.columns.begin(), answer_.columns.end(), column);
        const auto place = static_cast<std::size_t>(found - answer_.columns.begin());
        return found != answer_.columns.end() && place < row_.size() ? row_[place] : std::nullopt;
    }
    [[nodiscard]] std::uint64_t count(std::string_view column) const {
        return static_cast<std::uint64_t>(std::max<std::int64_t>(number(column).value_or(0), 0));
    }
    [[nodiscard]] std::uint32_t small(std::string_view column) const {
        return static_cast<std::uint32_t>(std::min<std::uint64_t>(count(column), UINT32_MAX));
    }
    [[nodiscard]] std::optional<std::int64_t> instant(std::string_view column) const {
        const auto ns = number(column);
        return ns ? std::optional(*ns + tai_offset_ns_) : std::nullopt;
    }

private:
    const TimingAnswer& answer_;
    const std::vector<std::optional<std::int64_t>>& row_;
    const std::int64_t tai_offset_ns_;
};

} // namespace

std::vector<FrameReport> FrameReports::take(std::uint32_t camera, const TimingAnswer& answer,
                                            std::int64_t tai_offset_ns) {
    std::vector<FrameReport> reports;
    if (after_ && answer.last > *after_) {
        const std::uint64_t fresh = answer.last - *after_;
        // An answer has no more rows than that; one that had would be of another daemon.
        const std::size_t count = std::min<std::uint64_t>(fresh, answer.rows.size());
        for (std::size_t i = answer.rows.size() - count; i < answer.rows.size(); ++i) {
            const RowReader row(answer, i, tai_offset_ns);
            FrameReport& report = reports.emplace_back();
            report.camera = camera;
            report.acquisition = row.small("acquisition");
            report.frame = row.count("frame_id");
            report.trigger = row.count("trigger_id");
            report.edge_tai_ns = row.instant("edge_ns").value_or(0);
            report.due_tai_ns = row.instant("due_ns");
            report.first_tai_ns = row.instant("first_ns");
            report.last_due_tai_ns = row.instant("last_due_ns");
            report.last_tai_ns = row.instant("last_ns");
            report.rows = row.small("rows");
            report.late_rows = row.small("late_rows");
            report.stalled_rows = row.small("stalled_rows");
            report.flags = row.small("flags");
            if (const auto pixels = row.number("saturated"))
                report.saturated = static_cast<std::uint32_t>(*pixels);
        }
        if (!reports.empty()) reports.front().lost_before = fresh - count;
    }
    if (!after_ || answer.last > *after_) after_ = answer.last;
    return reports;
}

} // namespace obscura::instrument
